"""The cases of demos/extreme_cases.py, family by family."""

from . import friction, incompressible, load, mesh, stiffness_and_scale
from .collected import CASES

__all__ = ["CASES", "friction", "incompressible", "load", "mesh", "stiffness_and_scale"]
