"""Ready-made meshes with named boundaries and nested refinement."""
