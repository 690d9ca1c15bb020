"""The generalised-alpha method and its special case HHT-alpha: Newmark with equilibrium at shifted times.

    (1 - am) M a1 + am M a0 + (1 - af) (C v1 + K u1 - load1) + af (C v0 + K u0 - load0) = contact forces,

with the contact force of the end of the step. High frequencies are damped: that tames the oscillation of the
contact force and does not cure its cause.

Sources: Chung and Hulbert, J. Appl. Mech. 60 (1993) 371; Hilber, Hughes and Taylor, Earthquake Engng Struct.
Dyn. 5 (1977) 283.
"""

from typing import Any

from checks import between
from model.dynamics.moving_body import MovingBody
from model.dynamics.newmark import Newmark
from model.dynamics.time_integrator import TimeIntegrator


class GeneralisedAlpha(Newmark):
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
        TimeIntegrator.__init__(self, body, dt, **options)


class HHT(Newmark):
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
        self._shift(0.0, alpha)
        TimeIntegrator.__init__(self, body, dt, **options)
