"""A body in motion of finite strain in motion: M u'' + internal force(u) = load + contact forces."""

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from model.dynamics.moving_body import MovingBody
from model.finite_strain.supported import Supported


@dataclass
class FiniteBody(MovingBody):
    """What `EnergyMomentum` needs to know; K is the tangent at rest, the rest as for `MovingBody`.

    Make one with `FiniteBody.from_forms`, as one makes a `MovingBody`, from `forms.Hyperelasticity`.

    Attributes
    ----------
    elastic : forms.Hyperelasticity
    """

    elastic: Any = field(default=None, repr=False)

    @classmethod
    def from_forms(cls, elasticity: Any, *arguments: Any, **options: Any) -> "FiniteBody":
        """Assemble the mass, and the tangent at rest; arguments as for `MovingBody.from_forms`.

        Raises
        ------
        ValueError
            As `MovingBody.from_forms`, and for a damping, which is not built for finite strain.
        """
        body = super().from_forms(elasticity, *arguments, **options)
        if body.C is not None:
            raise ValueError(
                "Rayleigh's damping is for linear strain: it would resist rotation; leave it out."
            )
        body.elastic = elasticity  # type: ignore[attr-defined]
        return body  # type: ignore[return-value]

    @cached_property
    def supported(self) -> Supported:
        """Energy, forces and tangents at the nodes of the system."""
        return Supported(self.elastic, self.node_of, self.prescribed)

    def missing_force(self, time: float, u: np.ndarray, v: np.ndarray | None = None) -> np.ndarray:
        """Load less internal forces, (N, d), at displacement `u` (N, d)."""
        return np.where(self.prescribed, 0.0, self.load_at(time) - self.supported.internal_force(u))

    def strain_energy(self, u: np.ndarray) -> float:
        """Elastic energy at displacement u (N, d)."""
        return self.supported.strain_energy(u)
