"""What touches what: bodies with named boundaries, and rigid roads."""

from geometry.body import Body
from geometry.gmsh_bodies import half_cylinder_gmsh, read_msh
from geometry.grid import Grid
from geometry.half_cylinder import half_cylinder, half_cylinder_nested
from geometry.rectangle import box, rectangle
from geometry.ring import ring
from geometry.road import Plane, Road

__all__ = [
    "Body",
    "Grid",
    "Plane",
    "Road",
    "box",
    "half_cylinder",
    "half_cylinder_gmsh",
    "half_cylinder_nested",
    "read_msh",
    "rectangle",
    "ring",
]
