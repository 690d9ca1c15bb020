"""What touches what: bodies with named boundaries, and rigid roads."""

from geometry.body import Body
from geometry.grid import Grid
from geometry.meshes.gmsh_bodies import half_cylinder_gmsh
from geometry.meshes.half_ball import half_ball
from geometry.meshes.half_cylinder import half_cylinder, half_cylinder_nested
from geometry.meshes.join import join, shifted
from geometry.meshes.mesh_file import read_mesh, read_msh
from geometry.meshes.rectangle import box, rectangle
from geometry.meshes.ring import ring
from geometry.meshes.tread_block import tread_block
from geometry.obstacles.linear_road import LinearRoad
from geometry.obstacles.moving_road import ExtrudedRoad, MovingRoad, RoadSeenFromAfar, ShiftedRoad
from geometry.obstacles.plane import Plane, Road
from geometry.obstacles.road_file import read_samples
from geometry.obstacles.round_road import RoundRoad
from geometry.obstacles.several_roads import SeveralRoads
from geometry.obstacles.smooth_road import SmoothRoad
from geometry.obstacles.surface_road import PolylineRoad, SurfaceRoad
from geometry.obstacles.topography import read_topography, samples_of

__all__ = [
    "Body",
    "ExtrudedRoad",
    "Grid",
    "LinearRoad",
    "MovingRoad",
    "Plane",
    "PolylineRoad",
    "Road",
    "RoadSeenFromAfar",
    "RoundRoad",
    "SeveralRoads",
    "ShiftedRoad",
    "SmoothRoad",
    "SurfaceRoad",
    "box",
    "half_ball",
    "half_cylinder",
    "half_cylinder_gmsh",
    "half_cylinder_nested",
    "join",
    "read_mesh",
    "read_msh",
    "read_samples",
    "read_topography",
    "rectangle",
    "ring",
    "samples_of",
    "shifted",
    "tread_block",
]
