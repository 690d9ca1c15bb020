"""The implicit midpoint rule with the contact force of the step's end: the trunk of both stabilised schemes.

    u* = u0 + dt v0 (or what a scheme makes of it),       u1 = u* + e,       v1 = v0 + 2 e / dt,
    M (v1 - v0) / dt + C (u1 - u0) / dt + K (u0 + u1) / 2 = load + p1.

With u* as it stands, the energy changes per step by p1 . (u1 - u0) less dissipation: the road takes p1 g0
from a node that touches down, friction opposes the slip, and nothing is given back.
"""

from time import perf_counter
from typing import Any

import numpy as np

from model.dynamics.block_sums import weighted_sum
from model.dynamics.time_integrator import State, TimeIntegrator


class Midpoint(TimeIntegrator):
    """The implicit midpoint rule; parameters as for `TimeIntegrator`."""

    name = "midpoint"

    def effective_matrix(self) -> Any:
        """Return 2 M / dt^2 + C / dt + K / 2."""
        return weighted_sum((2.0 / self.dt**2, self.M), (0.5, self.body.K), (1.0 / self.dt, self.body.C))

    def guess(self, before: State) -> tuple[np.ndarray, np.ndarray | None]:
        """Return u* - u0 (N, d), and the normal forces (n,) of the road that it took, if any."""
        return self.dt * before.velocity, None

    def mean_load(self, before: State) -> np.ndarray:
        """Nodal forces (N, d) in the middle of the step."""
        return self.body.load_at(before.time + 0.5 * self.dt)

    def step(self, before: State) -> State:
        """Return the state one step later."""
        began = perf_counter()
        dt, u0, v0 = self.dt, before.displacement, before.velocity
        moved, push = self.guess(before)
        b = self.body.missing_force((before.step + 0.5) * dt, u0 + 0.5 * moved, moved / dt)
        touch = self.touch(before, moved, b)
        v1 = v0 + (2.0 / dt) * touch.increment
        change = moved + touch.increment
        work = self.work(touch.force, change, before, touch.gap)
        work.damping = self.damping_work(change / dt, change)
        given_back = 0.0 if push is None else self.body.ranks.sum(float(push @ touch.gap))
        work.numerical = work.normal - given_back
        return self.after(before, touch, began, u0 + change, v1, (v1 - v0) / dt, touch.force, work)
