"""How it touches: the node loop, friction laws, corrections, load and time steps, closed forms."""

from .body_on_road import BodyOnRoad
from .central_differences import CentralDifferences
from .checkpoint import load_checkpoint, save_checkpoint
from .contact_stabilised import ContactStabilised
from .friction import FrictionLaw, coulomb, friction_law, static_kinetic, stribeck, viscous
from .generalised_alpha import HHT, GeneralisedAlpha
from .history import History
from .linear_limits import BeyondLinear, linear_limits
from .load_path import follow
from .march import march
from .mass_redistribution import MassRedistribution
from .moving_body import MovingBody
from .newmark import Newmark
from .problem import ContactProblem
from .record import NotConverged
from .resolution import UnresolvedWaves
from .solve import ContactSolver, Solution, solve

__all__ = [
    "HHT",
    "BeyondLinear",
    "BodyOnRoad",
    "CentralDifferences",
    "ContactProblem",
    "ContactSolver",
    "ContactStabilised",
    "FrictionLaw",
    "GeneralisedAlpha",
    "History",
    "MassRedistribution",
    "MovingBody",
    "Newmark",
    "NotConverged",
    "Solution",
    "UnresolvedWaves",
    "coulomb",
    "follow",
    "friction_law",
    "linear_limits",
    "load_checkpoint",
    "march",
    "save_checkpoint",
    "solve",
    "static_kinetic",
    "stribeck",
    "viscous",
]
