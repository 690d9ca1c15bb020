"""Contact-stabilised Newmark: the midpoint rule from a guess that keeps off the road.

u0 + dt v0 would carry nodes below the road, and the force that brings them back would count as work. Here the
guess is the admissible displacement nearest to it in the mass norm,

    u* = arg min |u - (u0 + dt v0)|_M  over  g(u) >= 0,

which is a contact problem with the mass for a matrix, solved by the same loop. The energy then changes per
step by

    - p1 g0 - q g1 <= 0,    q = 2 / dt^2 times the contact forces of the projection,

less what friction and damping dissipate: it never grows.

Source: Deuflhard, Krause and Ertel, Int. J. Numer. Meth. Engng 73 (2008) 1274.
"""

from typing import Any

import numpy as np

from model.dynamics.midpoint import Midpoint
from model.dynamics.moving_body import MovingBody
from model.dynamics.time_integrator import State


class ContactStabilised(Midpoint):
    """Contact-stabilised Newmark; parameters as for `TimeIntegrator`.

    Examples
    --------
    >>> from forms import Elasticity, Isotropic
    >>> from geometry import Body, Plane, rectangle
    >>> from model import MovingBody, ContactStabilised
    >>> elasticity = Elasticity(Body.from_grid(rectangle(2.0, 1.0, 4, 2)), Isotropic(E=1e4, nu=0.3))
    >>> weight = elasticity.body_force((0.0, -10.0))
    >>> body = MovingBody.from_forms(elasticity, 1.0, weight, Plane(point=(0.0, -0.001)), "bottom")
    >>> scheme = ContactStabilised(body, dt=0.001)
    >>> state = scheme.run(scheme.start(), 20)
    >>> bool(state.gap.min() == 0.0)  # it has landed
    True
    """

    name = "contact-stabilised Newmark"

    def __init__(self, body: MovingBody, dt: float, **options: Any):
        super().__init__(body, dt, **options)
        self.solvers["projection"] = self.step_solver(self.M * (2.0 / self.dt**2), friction=False)
        self._no_force = np.zeros_like(body.coordinates)

    def guess(self, before: State) -> tuple[np.ndarray, np.ndarray | None]:
        """Return the projected guess, less u0, and the forces of the projection."""
        moved = self.dt * before.velocity
        gap, normal = self.ground(before)
        way = moved[self.body.contact_nodes] - self.way(before)
        below = gap + np.einsum("ca,ca->c", normal, way)
        if not self.body.ranks.any(bool((below < 0.0).any())):
            return moved, None
        projection = self.touch(before, moved, self._no_force, solver="projection")
        return moved + projection.increment, np.einsum("ca,ca->c", normal, projection.force)
