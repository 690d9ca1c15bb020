"""How it touches: the node loop, friction laws, corrections, load and time steps, closed forms."""

from importlib import import_module
from typing import Any

from model.closed_forms.carter import Carter
from model.closed_forms.hertz import HertzCylinder, HertzSphere, effective_modulus
from model.closed_forms.mindlin import MindlinCylinder, MindlinSphere
from model.closed_forms.rod import RodImpact
from model.closed_forms.spence import Spence, dundurs_beta, goodman_stick_ratio
from model.dynamics.central_differences import CentralDifferences
from model.dynamics.contact_stabilised import ContactStabilised
from model.dynamics.curved_steps import on_curved_road
from model.dynamics.generalised_alpha import HHT, GeneralisedAlpha
from model.dynamics.mass_redistribution import MassRedistribution
from model.dynamics.moving_body import MovingBody
from model.dynamics.newmark import Newmark
from model.finite_strain.energy_momentum import EnergyMomentum
from model.finite_strain.lossless_contact import LosslessContact
from model.finite_strain.moving_body import FiniteBody
from model.finite_strain.statics import FiniteContact
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
from model.quasistatics.curved_contact import CurvedContact
from model.quasistatics.other_answers import other_answers
from model.quasistatics.solve import follow, solve
from model.recording.checkpoint import load_checkpoint, save_checkpoint
from model.recording.energy_balance import EnergyGrowth
from model.recording.history import History
from model.recording.time_loop import integrate
from model.recording.wave_resolution import UnresolvedWaves
from model.results.body_on_road import BodyOnRoad, von_mises
from model.results.pressure import (
    HalfWidth,
    consistent,
    contact_half_width,
    line_error,
    lumped,
    surface_error,
)
from model.results.reactions import Balance
from model.results.road_surface import write_road
from model.results.vtkhdf import write_vtkhdf
from model.solvers.contact_solver import ContactSolver, FrictionLeftOut, Solution
from model.solvers.convergence_record import NotConverged
from model.solvers.uniqueness import SeveralAnswers, UnstableBalance

# What draws or writes comes when asked for, so that `import model` needs neither matplotlib nor dolfinx.
LATE = {
    "model.figures.contact_map": ("contact_map", "cut_figure"),
    "model.figures.figures": (
        "body_picture",
        "convergence_figure",
        "mesh_figure",
        "new_figure",
        "outlines",
        "pressure_figure",
        "stick_slip_figure",
    ),
    "model.figures.motion_figures": ("bounce_figure", "film", "force_figure", "ledger_figure"),
    "model.results.xdmf": ("Series", "on_body", "write_xdmf"),
}

__all__ = [
    "HHT",
    "Balance",
    "BeyondLinear",
    "BodyOnRoad",
    "Carter",
    "CentralDifferences",
    "ContactProblem",
    "ContactSolver",
    "ContactStabilised",
    "CurvedContact",
    "EnergyGrowth",
    "EnergyMomentum",
    "FiniteBody",
    "FiniteContact",
    "FrictionLaw",
    "FrictionLeftOut",
    "GeneralisedAlpha",
    "HalfWidth",
    "HertzCylinder",
    "HertzSphere",
    "History",
    "LosslessContact",
    "MassRedistribution",
    "MindlinCylinder",
    "MindlinSphere",
    "MovingBody",
    "Newmark",
    "NotConverged",
    "RodImpact",
    "Series",
    "SeveralAnswers",
    "Solution",
    "Spence",
    "Status",
    "UnresolvedWaves",
    "UnstableBalance",
    "body_picture",
    "bounce_figure",
    "consistent",
    "contact_half_width",
    "contact_map",
    "convergence_figure",
    "coulomb",
    "cut_figure",
    "dundurs_beta",
    "effective_modulus",
    "film",
    "follow",
    "force_figure",
    "friction_law",
    "goodman_stick_ratio",
    "integrate",
    "ledger_figure",
    "line_error",
    "linear_limits",
    "load_checkpoint",
    "lumped",
    "mesh_figure",
    "new_figure",
    "on_body",
    "on_curved_road",
    "other_answers",
    "outlines",
    "pressure_figure",
    "save_checkpoint",
    "solve",
    "static_kinetic",
    "stick_slip_figure",
    "stribeck",
    "surface_error",
    "viscous",
    "von_mises",
    "write_road",
    "write_vtkhdf",
    "write_xdmf",
]


def __getattr__(name: str) -> Any:
    for module, names in LATE.items():
        if name in names:
            return getattr(import_module(module), name)
    raise AttributeError(f"module 'model' has no attribute {name!r}")


def __dir__() -> list[str]:
    return __all__
