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
    """Contact-stabilised Newmark; parameters as for `TimeIntegrator`."""

    name = "contact-stabilised Newmark"

    def __init__(self, body: MovingBody, dt: float, **options: Any):
        super().__init__(body, dt, **options)
        self.solvers["projection"] = self.step_solver(self.M * (2.0 / self.dt**2), friction=False)
        self._no_force = np.zeros_like(body.coordinates)

    def guess(self, before: State) -> tuple[np.ndarray, np.ndarray | None]:
        """Return the projected guess, less u0, and the forces of the projection."""
        moved = self.dt * before.velocity
        gap, normal = self.ground(before)
        below = gap + np.einsum("ca,ca->c", normal, moved[self.body.contact_nodes])
        if below.min() >= 0.0:
            return moved, None
        projection = self.touch(before, moved, self._no_force, solver="projection")
        return moved + projection.increment, np.einsum("ca,ca->c", normal, projection.force)
