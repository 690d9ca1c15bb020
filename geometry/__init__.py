"""What touches what: bodies with named boundaries, and rigid roads."""

from geometry.body import Body
from geometry.gmsh_bodies import half_cylinder_gmsh, read_msh
from geometry.grid import Grid
from geometry.half_ball import half_ball
from geometry.half_cylinder import half_cylinder, half_cylinder_nested
from geometry.join import join, shifted
from geometry.linear_road import LinearRoad
from geometry.moving_road import ExtrudedRoad, MovingRoad, RoadSeenFromAfar, ShiftedRoad
from geometry.rectangle import box, rectangle
from geometry.ring import ring
from geometry.road import Plane, Road
from geometry.road_file import read_samples
from geometry.round_road import RoundRoad
from geometry.smooth_road import SmoothRoad
from geometry.tread_block import tread_block

__all__ = [
    "Body",
    "ExtrudedRoad",
    "Grid",
    "LinearRoad",
    "MovingRoad",
    "Plane",
    "Road",
    "RoadSeenFromAfar",
    "RoundRoad",
    "ShiftedRoad",
    "SmoothRoad",
    "box",
    "half_ball",
    "half_cylinder",
    "half_cylinder_gmsh",
    "half_cylinder_nested",
    "join",
    "read_msh",
    "read_samples",
    "rectangle",
    "ring",
    "shifted",
    "tread_block",
]
