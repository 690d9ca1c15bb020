"""How it touches: the node loop, friction laws, corrections, load and time steps, closed forms."""

from model.dynamics.central_differences import CentralDifferences
from model.dynamics.contact_stabilised import ContactStabilised
from model.dynamics.generalised_alpha import HHT, GeneralisedAlpha
from model.dynamics.mass_redistribution import MassRedistribution
from model.dynamics.moving_body import MovingBody
from model.dynamics.newmark import Newmark
from model.node_loop.friction_laws import (
    FrictionLaw,
    coulomb,
    friction_law,
    static_kinetic,
    stribeck,
    viscous,
)
from model.node_loop.status import Status
from model.problem.contact_problem import ContactProblem
from model.problem.linear_limits import BeyondLinear, linear_limits
from model.quasistatics.solve import follow, solve
from model.recording.checkpoint import load_checkpoint, save_checkpoint
from model.recording.energy_balance import EnergyGrowth
from model.recording.history import History
from model.recording.time_loop import march
from model.recording.wave_resolution import UnresolvedWaves
from model.results.body_on_road import BodyOnRoad
from model.results.road_surface import write_road
from model.results.vtkhdf import write_vtkhdf
from model.solvers.contact_solver import ContactSolver, Solution
from model.solvers.convergence_record import NotConverged

__all__ = [
    "HHT",
    "BeyondLinear",
    "BodyOnRoad",
    "CentralDifferences",
    "ContactProblem",
    "ContactSolver",
    "ContactStabilised",
    "EnergyGrowth",
    "FrictionLaw",
    "GeneralisedAlpha",
    "History",
    "MassRedistribution",
    "MovingBody",
    "Newmark",
    "NotConverged",
    "Solution",
    "Status",
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
    "write_road",
    "write_vtkhdf",
]
