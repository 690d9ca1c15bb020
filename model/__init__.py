"""How it touches: the node loop, friction laws, corrections, load and time steps, closed forms."""

from .body_on_road import BodyOnRoad
from .friction import FrictionLaw, coulomb, friction_law, static_kinetic, stribeck, viscous
from .load_path import follow
from .problem import ContactProblem
from .record import NotConverged
from .solve import ContactSolver, Solution, solve

__all__ = [
    "BodyOnRoad",
    "ContactProblem",
    "ContactSolver",
    "FrictionLaw",
    "NotConverged",
    "Solution",
    "coulomb",
    "follow",
    "friction_law",
    "solve",
    "static_kinetic",
    "stribeck",
    "viscous",
]
