"""A body in motion of finite strain in motion: M u'' + internal force(u) = load + contact forces."""

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from model.dynamics.moving_body import MovingBody
from model.finite_strain.system_forces import SystemForces


@dataclass
class FiniteBody(MovingBody):
    """What `EnergyMomentum` needs to know; K is the tangent at rest, the rest as for `MovingBody`.

    Make one as one makes a `MovingBody`, with `FiniteBody.from_forms` or `FiniteBody.from_contact`, from
    `forms.Hyperelasticity`.

    Attributes
    ----------
    elastic : forms.Hyperelasticity

    Examples
    --------
    >>> from forms import Hyperelasticity, NeoHookean
    >>> from geometry import Body, Plane, rectangle
    >>> from model import FiniteBody
    >>> rubber = Hyperelasticity(Body.from_grid(rectangle(2.0, 1.0, 4, 4)), NeoHookean(E=1e4, nu=0.3))
    >>> weight = rubber.body_force((0.0, -10.0))
    >>> body = FiniteBody.from_forms(rubber, 1.0, weight, Plane(point=(0.0, -0.001)), "bottom")
    >>> body.elastic is rubber, body.M.shape
    (True, (50, 50))
    """

    elastic: Any = field(default=None, repr=False)
    finite_strain = True

    @classmethod
    def _of(cls, system: Any, nodes: np.ndarray, road: Any, friction: Any, limits: Any) -> "FiniteBody":
        if system.elastic is None:
            raise ValueError("FiniteBody is for forms.Hyperelasticity; linear strain takes MovingBody.")
        if system.exchanges:
            raise ValueError("Bodies of finite strain are not shared among ranks yet; run on one rank.")
        if hasattr(road, "at"):
            raise ValueError(
                "The road moves, but under a body of finite strain it must rest; prescribe the motion of the "
                "body's supports, or take linear strain."
            )
        if system.C is not None:
            raise ValueError(
                "Rayleigh's damping would resist rotation: it is for linear strain; leave it out."
            )
        body = super()._of(system, nodes, road, friction, None)
        load = system.external_load if system.varies else system.external_load()
        return replace(body, load=load, elastic=system.elastic)  # type: ignore[return-value, call-arg]

    @cached_property
    def forces(self) -> SystemForces:
        """Energy, forces and tangents at the nodes of the system."""
        return SystemForces(self.elastic, self.node_of, self.prescribed)

    @cached_property
    def surface(self) -> SystemForces:
        """The same of the cells at nodes that may touch: forces and tangents there at less cost."""
        nodes = (
            self.contact_nodes
            if self.node_of is None
            else np.isin(self.node_of, self.contact_nodes).nonzero()[0]
        )
        return SystemForces(self.elastic.around(nodes), self.node_of, self.prescribed)

    def missing_force(self, time: float, u: np.ndarray, v: np.ndarray | None = None) -> np.ndarray:
        """Load less internal forces, (N, d), at displacement `u` (N, d)."""
        return np.where(self.prescribed, 0.0, self.load_at(time) - self.forces.internal_force(u))

    def stiffness_at(self, u: np.ndarray) -> Any:
        """Tangent (N d, N d) at displacement u (N, d)."""
        return self.forces.tangent(u)

    def strain_energy(self, u: np.ndarray) -> float:
        """Elastic energy at displacement u (N, d)."""
        return self.forces.strain_energy(u)
