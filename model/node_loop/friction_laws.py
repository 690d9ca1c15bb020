"""Friction laws: how large the tangential force on a contact node can be.

A law is one small compiled function

    bound(pressure, slip, state) -> largest tangential force,

with `pressure` the nodal contact force (>= 0), `slip` the length of the node's slip in the step, times the
`slip_rate` of the solve (1 for increments; 1/dt turns it into a speed), and `state` 1.0 where the node was
slipping at the end of the last step, else 0.0. A node sticks while its tangential force stays below bound(p,
0, state); otherwise it slips, and the force equals bound(p, slip, state) and opposes the slip. The loop calls
laws through their address: one compiled loop serves them all, and a frictionless scene compiles none of it.
"""

from functools import cache
from math import exp, isfinite
from typing import Any

from llvmlite import ir
from numba import cfunc, types
from numba.extending import intrinsic

SIGNATURE = "float64(float64, float64, float64)"


class FrictionLaw:
    """A friction law for the contact loop.

    Parameters
    ----------
    bound : callable
        The compiled function `bound(pressure, slip, state)`, as made by `friction_law`.
    name : str
        How reports call it.
    coefficient : float
        The coefficient at rest, tau / p; it decides whether friction can hold a body.

    Examples
    --------
    >>> from model import coulomb
    >>> law = coulomb(0.5)
    >>> law, law.coefficient, law.bound.ctypes(10.0, 0.0, 0.0)  # 10 N of pressure, no slip
    (Coulomb(mu=0.5), 0.5, 5.0)
    """

    def __init__(self, bound: Any, name: str, coefficient: float):
        self.bound = bound
        self.name = name
        self.coefficient = coefficient

    @property
    def address(self) -> int:
        """Where the compiled function lies in memory.

        What the loop gets, since an integer costs nothing to pass.
        """
        return self.bound.address

    def __repr__(self) -> str:
        """Return the law's name with its coefficients."""
        return self.name


@intrinsic
def allowed(typing: Any, address: Any, pressure: Any, slip: Any, state: Any) -> Any:
    """Call, from compiled code, the law at an address: the largest tangential force."""
    if not isinstance(address, types.Integer):
        return None
    signature = types.float64(address, types.float64, types.float64, types.float64)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        number = ir.DoubleType()
        law = builder.inttoptr(arguments[0], ir.FunctionType(number, [number] * 3).as_pointer())
        return builder.call(law, arguments[1:])

    return signature, generate


def friction_law(function: Any, coefficient: float = 0.0) -> FrictionLaw:
    """Turn a user's own function `bound(pressure, slip, state)` into a law.

    Parameters
    ----------
    function : callable
        Plain Python arithmetic on three floats; numba compiles it. Its value must be finite and >= 0, and
        must not exceed what it is at zero slip by more than the elastic body can follow.
    coefficient : float
        Coefficient of friction at rest, used only to judge whether the road can hold the body.

    Returns
    -------
    FrictionLaw

    Examples
    --------
    >>> from model import friction_law
    >>> def limited(pressure, slip, state):
    ...     return min(0.5 * pressure, 2.0)  # no more than the material bears
    >>> friction_law(limited, coefficient=0.5).bound.ctypes(10.0, 0.0, 0.0)
    2.0
    """
    return FrictionLaw(cfunc(SIGNATURE)(function), getattr(function, "__name__", "friction law"), coefficient)


def _checked(**coefficients: float) -> None:
    for name, value in coefficients.items():
        if not (isfinite(value) and value >= 0.0):
            raise ValueError(f"{name} is {value}, but a friction coefficient is a finite number >= 0.")


def coulomb(mu: float) -> FrictionLaw:
    """Coulomb's law, |tau| <= mu p (eq. (7) of the paper).

    Parameters
    ----------
    mu : float
        Coefficient of friction, >= 0.

    Raises
    ------
    ValueError
        If `mu` is negative or not finite.

    Examples
    --------
    >>> from model import coulomb
    >>> coulomb(0.3).bound.ctypes(10.0, 0.0, 0.0)
    3.0
    """
    _checked(mu=mu)
    return FrictionLaw(_coulomb_bound(float(mu)), f"Coulomb(mu={mu:g})", float(mu))


@cache
def _coulomb_bound(mu: float) -> Any:
    """Compile mu times the pressure, once for each mu."""

    @cfunc(SIGNATURE, cache=True)
    def bound(pressure, slip, state):
        return mu * pressure

    return bound


def static_kinetic(mu_static: float, mu_kinetic: float) -> FrictionLaw:
    """Different coefficients at rest and in motion: |tau| <= mu_s p at rest, mu_k p in slip.

    A node that slipped in the last step needs only mu_k p to go on (Amontons-Coulomb with a static
    coefficient; Rabinowicz, Friction and Wear of Materials, 1965).

    Parameters
    ----------
    mu_static, mu_kinetic : float
        Coefficients, mu_static >= mu_kinetic >= 0.

    Raises
    ------
    ValueError
        If a coefficient is negative or not finite, or the kinetic one exceeds the static one.

    Examples
    --------
    >>> from model import static_kinetic
    >>> law = static_kinetic(0.5, 0.3).bound.ctypes
    >>> law(10.0, 0.0, 0.0), law(10.0, 0.1, 0.0), law(10.0, 0.0, 1.0)  # at rest, in slip, and after it
    (5.0, 3.0, 3.0)
    """
    _checked(mu_static=mu_static, mu_kinetic=mu_kinetic)
    if mu_kinetic > mu_static:
        raise ValueError(f"mu_kinetic is {mu_kinetic}, but it must not exceed mu_static, {mu_static}.")
    mu_static, mu_kinetic = float(mu_static), float(mu_kinetic)

    @cfunc(SIGNATURE, cache=True)
    def bound(pressure, slip, state):
        return (mu_kinetic if slip > 0.0 or state > 0.0 else mu_static) * pressure

    return FrictionLaw(bound, f"static and kinetic(mu_s={mu_static:g}, mu_k={mu_kinetic:g})", mu_static)


def viscous(mu: float, viscosity: float) -> FrictionLaw:
    """Coulomb friction with a viscous part, |tau| <= mu p + c v.

    Olsson et al., European Journal of Control 4, 1998, eq. (4).

    Parameters
    ----------
    mu : float
        Coefficient of friction, >= 0; 0 leaves a purely viscous film.
    viscosity : float
        c, force of one node per unit of slip speed (of slip increment where slip_rate = 1), >= 0; it acts on
        nodes in contact only.

    Raises
    ------
    ValueError
        If a coefficient is negative or not finite.

    Examples
    --------
    >>> from model import viscous
    >>> viscous(0.2, viscosity=5.0).bound.ctypes(10.0, 0.1, 0.0)
    2.5
    """
    _checked(mu=mu, viscosity=viscosity)
    mu, viscosity = float(mu), float(viscosity)

    @cfunc(SIGNATURE, cache=True)
    def bound(pressure, slip, state):
        return mu * pressure + (viscosity * slip if pressure > 0.0 else 0.0)

    return FrictionLaw(bound, f"viscous(mu={mu:g}, c={viscosity:g})", mu)


def stribeck(mu_static: float, mu_kinetic: float, speed: float, viscosity: float = 0.0) -> FrictionLaw:
    """Stribeck friction: |tau| <= [mu_k + (mu_s - mu_k) exp(-(v/v_s)^2)] p + c v.

    Olsson et al., European Journal of Control 4, 1998, eq. (5), with exponent 2.

    Parameters
    ----------
    mu_static, mu_kinetic : float
        Coefficients, mu_static >= mu_kinetic >= 0.
    speed : float
        Stribeck speed v_s > 0 (or slip increment where slip_rate = 1).
    viscosity : float
        c, force of one node per unit of slip speed, >= 0.

    Raises
    ------
    ValueError
        If a coefficient is negative or not finite, `speed` is not positive, or mu_kinetic > mu_static.

    Examples
    --------
    >>> from model import stribeck
    >>> law = stribeck(0.5, 0.3, speed=0.1).bound.ctypes
    >>> law(10.0, 0.0, 0.0), round(law(10.0, 10.0, 0.0), 6)
    (5.0, 3.0)
    """
    _checked(mu_static=mu_static, mu_kinetic=mu_kinetic, viscosity=viscosity)
    if mu_kinetic > mu_static:
        raise ValueError(f"mu_kinetic is {mu_kinetic}, but it must not exceed mu_static, {mu_static}.")
    if not (isfinite(speed) and speed > 0.0):
        raise ValueError(f"speed is {speed}, but the Stribeck speed is a finite number > 0.")
    mu_static, mu_kinetic = float(mu_static), float(mu_kinetic)
    speed, viscosity = float(speed), float(viscosity)

    @cfunc(SIGNATURE, cache=True)
    def bound(pressure, slip, state):
        mu = mu_kinetic + (mu_static - mu_kinetic) * exp(-((slip / speed) ** 2))
        return mu * pressure + (viscosity * slip if pressure > 0.0 else 0.0)

    return FrictionLaw(
        bound, f"Stribeck(mu_s={mu_static:g}, mu_k={mu_kinetic:g}, v_s={speed:g}, c={viscosity:g})", mu_static
    )
