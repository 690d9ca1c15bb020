"""The cases of demos/reports/extreme_cases.py, family by family."""

from . import friction, incompressible, load, mesh, rigid_motion, road, stiffness_and_scale, time
from .collected import CASES

__all__ = [
    "CASES",
    "friction",
    "incompressible",
    "load",
    "mesh",
    "rigid_motion",
    "road",
    "stiffness_and_scale",
    "time",
]
