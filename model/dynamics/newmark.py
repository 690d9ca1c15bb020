"""Newmark's method (section 2.3 of the paper), contact exact at the end of each step.

    u1 = u0 + dt v0 + dt^2 [(1/2 - beta) a0 + beta a1],     v1 = v0 + dt [(1 - gamma) a0 + gamma a1]     (10),
    (11)

With the guess u* = u0 + dt v0 + dt^2 (1/2 - beta) a0 the increment is e = beta dt^2 a1, and the equation of
motion at the end of the step becomes

    (M / (beta dt^2) + gamma / (beta dt) C + K) e = load - K u* - C v* + contact forces.

For beta = 1/4, gamma = 1/2, on a flat road and without friction and damping, the energy changes per step by
1/2 sum (p0 + p1)(g1 - g0), p the nodal contact forces: it loses at impact and gains at release.
"""

from time import perf_counter
from typing import Any

import numpy as np

from checks import finite
from model.dynamics.block_sums import weighted_sum
from model.dynamics.moving_body import MovingBody
from model.dynamics.time_integrator import State, TimeIntegrator


class Newmark(TimeIntegrator):
    """Newmark's method.

    Parameters
    ----------
    body, dt, correction, tolerance
        As for `TimeIntegrator`.
    beta, gamma : float
        1/4 and 1/2, the trapezoidal rule, are the paper's.

    Raises
    ------
    ValueError
        Unless 2 beta >= gamma >= 1/2, where the method is stable for every dt.

    Examples
    --------
    >>> from forms import Elasticity, Isotropic
    >>> from geometry import Body, Plane, rectangle
    >>> from model import MovingBody, Newmark
    >>> elasticity = Elasticity(Body.from_grid(rectangle(2.0, 1.0, 4, 2)), Isotropic(E=1e4, nu=0.3))
    >>> weight = elasticity.body_force((0.0, -10.0))
    >>> body = MovingBody.from_forms(elasticity, 1.0, weight, Plane(point=(0.0, -0.001)), "bottom")
    >>> scheme = Newmark(body, dt=0.001)
    >>> state = scheme.run(scheme.start(), 20)
    >>> bool(state.gap.min() == 0.0)  # it has landed
    True
    """

    name = "Newmark"
    alpha_m = alpha_f = 0.0  # shifts of the times at which inertia and forces are balanced

    def __init__(self, body: MovingBody, dt: float, beta: float = 0.25, gamma: float = 0.5, **options: Any):
        finite(beta=beta, gamma=gamma)
        if not 2.0 * beta >= gamma >= 0.5:
            raise ValueError(f"beta is {beta} and gamma {gamma}, but 2 beta >= gamma >= 1/2 is needed.")
        self.beta, self.gamma = beta, gamma
        super().__init__(body, dt, **options)

    def _shift(self, alpha_m: float, alpha_f: float) -> None:
        """Set the shifts, and with them the beta and gamma of second order and best damping."""
        self.alpha_m, self.alpha_f = alpha_m, alpha_f
        self.gamma = 0.5 - alpha_m + alpha_f
        self.beta = 0.25 * (1.0 - alpha_m + alpha_f) ** 2

    def effective_matrix(self) -> Any:
        """Return (1 - am) M / (beta dt^2) + (1 - af) (gamma / (beta dt) C + K)."""
        scale = 1.0 / (self.beta * self.dt**2)
        late = 1.0 - self.alpha_f
        return weighted_sum(
            ((1.0 - self.alpha_m) * scale, self.M),
            (late, self.body.K),
            (late * self.gamma * self.dt * scale, self.body.C),
        )

    def step(self, before: State) -> State:
        """Return the state one step later."""
        began = perf_counter()
        dt, beta, gamma, body = self.dt, self.beta, self.gamma, self.body
        u0, v0, a0 = before.displacement, before.velocity, before.acceleration
        moved = dt * v0 + (dt**2 * (0.5 - beta)) * a0
        speed = v0 + (dt * (1.0 - gamma)) * a0
        b = body.missing_force((before.step + 1) * dt, u0 + moved, speed)
        if self.alpha_f:
            b = (1.0 - self.alpha_f) * b + self.alpha_f * body.missing_force(before.step * dt, u0, v0)
        if self.alpha_m:
            b -= self.alpha_m * (self.M @ a0.ravel()).reshape(a0.shape)
        touch = self.touch(before, moved, b)
        a1 = touch.increment / (beta * dt**2)
        v1 = speed + (dt * gamma) * a1
        change = moved + touch.increment
        # the part of M a that the road is answerable for lags behind its force
        lagging = before.contact_force if before.memory is None else before.memory
        leading = (touch.force - self.alpha_m * lagging) / (1.0 - self.alpha_m)
        mean = (1.0 - gamma) * lagging + gamma * leading
        work = self.work(mean, change, before, touch.gap)
        work.damping = self.damping_work(0.5 * (v0 + v1), change)
        work.numerical = work.normal if self.identity else np.nan
        memory = leading if self.alpha_m else None
        return self.after(before, touch, began, u0 + change, v1, a1, mean, work, memory)

    @property
    def identity(self) -> bool:
        """Whether the change of energy is known: where normals turn, p does not work on gaps alone."""
        paper = (self.beta, self.gamma, self.alpha_f) == (0.25, 0.5, 0.0)
        return paper and getattr(self.body.road, "flat", False)
