"""The generalised-alpha method and its special case HHT-alpha: Newmark with equilibrium at shifted times.

    (1 - am) M a1 + am M a0 + (1 - af) (C v1 + K u1 - load1) + af (C v0 + K u0 - load0) = contact forces,

with the contact force of the end of the step. High frequencies are damped: that tames the oscillation of the
contact force and does not cure its cause.

Sources: Chung and Hulbert, J. Appl. Mech. 60 (1993) 371; Hilber, Hughes and Taylor, Earthquake Engng Struct.
Dyn. 5 (1977) 283.
"""

from time import perf_counter
from typing import Any

import numpy as np

from checks import between
from model.dynamics.block_sums import weighted_sum
from model.dynamics.moving_body import MovingBody
from model.dynamics.time_integrator import State, TimeIntegrator


class GeneralisedAlpha(TimeIntegrator):
    """The generalised-alpha method.

    Parameters
    ----------
    body, dt, correction, tolerance
        As for `TimeIntegrator`.
    rho : float
        Spectral radius at infinite frequency, 0 (annihilates) to 1 (keeps all).

    Raises
    ------
    ValueError
        Unless 0 <= rho <= 1.

    Examples
    --------
    >>> from forms import Elasticity, Isotropic
    >>> from geometry import Body, Plane, rectangle
    >>> from model import MovingBody, GeneralisedAlpha
    >>> elasticity = Elasticity(Body.from_grid(rectangle(2.0, 1.0, 4, 2)), Isotropic(E=1e4, nu=0.3))
    >>> weight = elasticity.body_force((0.0, -10.0))
    >>> body = MovingBody.from_forms(elasticity, 1.0, weight, Plane(point=(0.0, -0.001)), "bottom")
    >>> scheme = GeneralisedAlpha(body, dt=0.001, rho=0.9)
    >>> state = scheme.run(scheme.start(), 20)
    >>> bool(state.gap.min() == 0.0)  # it has landed
    True
    """

    name = "generalised-alpha"

    def __init__(self, body: MovingBody, dt: float, rho: float = 0.8, **options: Any):
        between(0.0, 1.0, rho=rho)
        self._shift((2.0 * rho - 1.0) / (rho + 1.0), rho / (rho + 1.0))
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
        b = (1.0 - self.alpha_f) * body.missing_force((before.step + 1) * dt, u0 + moved, speed)
        b += self.alpha_f * body.missing_force(before.step * dt, u0, v0)
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
        work.numerical = np.nan
        return self.after(
            before,
            touch,
            began,
            displacement=u0 + change,
            velocity=v1,
            acceleration=a1,
            mean_force=mean,
            work=work,
            memory=leading,
        )


class HHT(GeneralisedAlpha):
    """The method of Hilber, Hughes and Taylor.

    Parameters
    ----------
    body, dt, correction, tolerance
        As for `TimeIntegrator`.
    alpha : float
        Shift, 0 (Newmark) to 1/3 (strongest damping).

    Raises
    ------
    ValueError
        Unless 0 <= alpha <= 1/3.

    Examples
    --------
    >>> from forms import Elasticity, Isotropic
    >>> from geometry import Body, Plane, rectangle
    >>> from model import MovingBody, HHT
    >>> elasticity = Elasticity(Body.from_grid(rectangle(2.0, 1.0, 4, 2)), Isotropic(E=1e4, nu=0.3))
    >>> weight = elasticity.body_force((0.0, -10.0))
    >>> body = MovingBody.from_forms(elasticity, 1.0, weight, Plane(point=(0.0, -0.001)), "bottom")
    >>> scheme = HHT(body, dt=0.001, alpha=0.1)
    >>> state = scheme.run(scheme.start(), 20)
    >>> bool(state.gap.min() == 0.0)  # it has landed
    True
    """

    name = "HHT-alpha"

    def __init__(self, body: MovingBody, dt: float, alpha: float = 0.1, **options: Any):
        between(0.0, 1.0 / 3.0, alpha=alpha)
        self.alpha = alpha
        super().__init__(body, dt, **options)

    def _shift(self, alpha_m: float, alpha_f: float) -> None:
        super()._shift(0.0, self.alpha)
