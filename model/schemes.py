"""All time integrators by name, each with its own defaults: `SCHEMES["HHT"](body, dt)`."""

from .central_differences import CentralDifferences
from .contact_stabilised import ContactStabilised
from .generalised_alpha import HHT, GeneralisedAlpha
from .mass_redistribution import MassRedistribution
from .newmark import Newmark
from .time_integrator import TimeIntegrator

IMPLICIT: dict[str, type[TimeIntegrator]] = {
    "Newmark": Newmark,
    "HHT": HHT,
    "generalised alpha": GeneralisedAlpha,
    "contact-stabilised": ContactStabilised,
    "mass redistribution": MassRedistribution,
}
SCHEMES = IMPLICIT | {"central differences": CentralDifferences}
