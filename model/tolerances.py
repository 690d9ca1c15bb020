"""Sizes that many rooms share: what is asked for where nothing is said, and what counts as rounding."""

# Natural residual: six digits beyond what the finest meshes of the studies resolve, 1e-4 of the pressure.
TOLERANCE = 1e-10
# Of the body's size: a node so near to the road is on it. Nearest points of roads are found to 1e-16 of it,
# a hundred sizes from the origin to 1e-15.
ON_ROAD = 1e-12
