"""Contact on curved roads: tangent planes at the nodes and their fixed-point iteration."""
