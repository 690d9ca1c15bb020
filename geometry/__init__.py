"""What touches what: bodies, tagged boundaries, nested refinement and rigid roads."""
