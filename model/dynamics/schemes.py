"""All time integrators by name, each with its own defaults: `SCHEMES["HHT"](body, dt)`."""

from model.dynamics.central_differences import CentralDifferences
from model.dynamics.contact_stabilised import ContactStabilised
from model.dynamics.generalised_alpha import HHT, GeneralisedAlpha
from model.dynamics.mass_redistribution import MassRedistribution
from model.dynamics.newmark import Newmark
from model.dynamics.time_integrator import TimeIntegrator

IMPLICIT: dict[str, type[TimeIntegrator]] = {
    "Newmark": Newmark,
    "HHT": HHT,
    "generalised alpha": GeneralisedAlpha,
    "contact-stabilised": ContactStabilised,
    "mass redistribution": MassRedistribution,
}
SCHEMES = IMPLICIT | {"central differences": CentralDifferences}
