"""Friction laws: how large the tangential force on a contact node can be.

A law is one small compiled function

    bound(pressure, slip, node) -> largest tangential force,

with `pressure` the nodal contact force (>= 0), `slip` the length of the node's slip in the step, times the
`slip_rate` of the solve (1 for increments; 1/dt turns it into a speed), and `node` what the law is told of
the node: first its state, 1.0 where it was slipping at the end of the last step, else 0.0, then the law's
parameters there. A node sticks while its tangential force stays below bound(p, 0, node); otherwise it slips,
and the force equals bound(p, slip, node) and opposes the slip. The loop calls laws through their address:
one compiled loop serves them all, and a frictionless scene compiles none of it.

A parameter is a number; an array (n,), one value a candidate; or a function of places (n, d) that returns
that: of the points of the road at which nodes stick as a step begins, for a road that moves as they lie at
time 0. Where a body meets a road, it may also be {boundary: value}, a node of several boundaries having the
first of them, or for `SeveralRoads` a list, one value a road; see `model.problem.varying_friction`.
"""

from collections.abc import Callable
from ctypes import POINTER, c_double
from functools import cache
from inspect import signature
from math import exp
from typing import Any

import numpy as np
from llvmlite import ir
from numba import carray, cfunc, njit, types
from numba.extending import intrinsic
from numba.np.unsafe.ndarray import to_fixed_tuple

import checks

SIGNATURE = "float64(float64, float64, CPointer(float64))"


class FrictionLaw:
    """A friction law for the contact loop.

    Parameters
    ----------
    bound : callable
        The compiled function `bound(pressure, slip, node)`, as made by `friction_law`.
    name : str
        How reports call it.
    **parameters : float, array (n,), or callable of places
        First the coefficient at rest, tau / p, which decides whether friction can hold a body.

    Examples
    --------
    >>> from model import coulomb
    >>> law = coulomb(0.5)
    >>> law, law(10.0)  # of 10 N of pressure
    (Coulomb(mu=0.5), 5.0)
    """

    def __init__(self, bound: Any, name: str, **parameters: Any):
        self.bound, self.name = bound, name
        self.parameters = {key: _checked(key, value) for key, value in parameters.items()}

    @property
    def address(self) -> int:
        """Where the compiled function lies in memory.

        What the loop gets, since an integer costs nothing to pass.
        """
        return self.bound.address

    @property
    def coefficient(self) -> Any:
        """The coefficient at rest, as it was given: a number, an array (n,), or a function of places."""
        return next(iter(self.parameters.values()))

    @property
    def weakens(self) -> bool:
        """Whether the friction of a node that slips far is less than that of one at rest, if it is known."""
        known = all(isinstance(value, float) for value in self.parameters.values())
        return known and self(1.0, 1.0) < self(1.0)

    @property
    def by_place(self) -> bool:
        """Whether a parameter is a function of places."""
        return any(callable(value) for value in self.parameters.values())

    def with_each(self, change: Callable[[Any], Any]) -> "FrictionLaw":
        """Return the law with each parameter changed by a function."""
        return FrictionLaw(self.bound, self.name, **{k: change(v) for k, v in self.parameters.items()})

    def of(self, numbers: np.ndarray) -> "FrictionLaw":
        """Return the law of some of the candidates (k,)."""
        return self.with_each(lambda value: value[numbers] if isinstance(value, np.ndarray) else value)

    def nodes(self, slipped: np.ndarray, places: np.ndarray | None = None) -> np.ndarray:
        """Return what the law is told of the candidates, (n, 1 + parameters).

        Parameters
        ----------
        slipped : (n,)
            1 where a node slipped at the end of the last step.
        places : (n, d), optional
            Where nodes stick; needed where a parameter is a function of that.

        Raises
        ------
        ValueError
            If a parameter has another number of values, or one that is negative or not finite, or if the law
            gives a force that is so.
        """
        rows = np.empty((len(slipped), 1 + len(self.parameters)))
        rows[:, 0] = slipped
        for column, (name, value) in enumerate(self.parameters.items(), start=1):
            if callable(value):
                value = _checked(name, np.asarray(value(places), dtype=np.float64))
            elif isinstance(value, dict | list):
                raise ValueError(
                    f"{name} is {value!r}, by boundaries or by roads, which BodyOnRoad knows; give a number, "
                    "an array with one value a candidate, or a function of places."
                )
            if np.ndim(value) and np.shape(value) != (len(slipped),):
                raise ValueError(
                    f"{name} has the shape {np.shape(value)}, but {len(slipped)} nodes may touch; "
                    "give one value for each, or one for all."
                )
            rows[:, column] = value
        self._try_out(rows)
        return rows

    def _try_out(self, rows: np.ndarray) -> None:
        """Refuse a law that gives no friction force to the first node under a unit of pressure."""
        for slip in (0.0, 1.0) if len(rows) else ():
            force = self.bound.ctypes(1.0, slip, rows.ctypes.data_as(POINTER(c_double)))
            if not (np.isfinite(force) and force >= 0.0):
                raise ValueError(
                    f"The friction law {self.name} gives {force:g} for a pressure of 1 and a slip of "
                    f"{slip:g}; the largest friction force is a finite number >= 0."
                )

    def __call__(self, pressure: float, slip: float = 0.0, slipped: float = 0.0) -> float:
        """Return the largest tangential force on one node; `slipped` is 1 where it did in the last step."""
        node = self.nodes(np.array([slipped]))
        return self.bound.ctypes(pressure, slip, node.ctypes.data_as(POINTER(c_double)))

    def __repr__(self) -> str:
        """Return the law's name with its parameters."""
        return f"{self.name}({', '.join(f'{k}={_short(v)}' for k, v in self.parameters.items())})"


def as_law(friction: Any) -> FrictionLaw | None:
    """Return a law as it is, None and a coefficient of 0 as none, and all else as Coulomb's coefficient."""
    if friction is None or (np.isscalar(friction) and friction == 0.0):
        return None
    return friction if isinstance(friction, FrictionLaw) else coulomb(friction)


@intrinsic
def allowed(typing: Any, address: Any, pressure: Any, slip: Any, node: Any) -> Any:
    """Call, from compiled code, the law at an address for a row of `FrictionLaw.nodes`."""
    if not isinstance(address, types.Integer):
        return None
    call = types.float64(address, types.float64, types.float64, node)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        number = ir.DoubleType()
        kind = ir.FunctionType(number, [number, number, number.as_pointer()])
        law = builder.inttoptr(arguments[0], kind.as_pointer())
        row = context.make_array(node)(context, builder, arguments[3])
        return builder.call(law, [*arguments[1:3], row.data])

    return call, generate


def friction_law(function: Any, coefficient: Any = 0.0, *parameters: Any) -> FrictionLaw:
    """Turn a user's own function `bound(pressure, slip, state)` into a law.

    Parameters
    ----------
    function : callable
        Plain Python arithmetic on floats; numba compiles it. Its value must be finite and >= 0, and must not
        exceed what it is at zero slip by more than the elastic body can follow. A function of more than three
        arguments gets the coefficient as the fourth, and the parameters after it, each that of the node.
    coefficient : float, array (n,), or callable of places
        Coefficient of friction at rest, by which it is judged whether the road can hold the body.
    *parameters : likewise
        More parameters of the function.

    Returns
    -------
    FrictionLaw

    Raises
    ------
    ValueError
        If there are more or fewer parameters than the function has after its coefficient.

    Examples
    --------
    >>> from model import friction_law
    >>> def limited(pressure, slip, state):
    ...     return min(0.5 * pressure, 2.0)  # no more than the material bears
    >>> friction_law(limited, coefficient=0.5)(10.0)
    2.0
    >>> def wet(pressure, slip, state, mu, film):  # a film bears a part of the pressure
    ...     return mu * max(pressure - film, 0.0)
    >>> law = friction_law(wet, 0.5, lambda x: 2.0 * (x[:, 0] > 1.0))
    >>> law.nodes(np.zeros(2), np.array([[0.0, 0.0], [3.0, 0.0]])).tolist()
    [[0.0, 0.5, 0.0], [0.0, 0.5, 2.0]]
    """
    checks.function(function=function)
    more = list(signature(function).parameters)[3:]
    wanted = max(len(more) - 1, 0)
    if len(parameters) != wanted:
        raise ValueError(
            f"The function has {wanted} parameters after its coefficient, but {len(parameters)} are given."
        )
    values = dict(zip(more or ["coefficient"], (coefficient, *parameters)))
    count, law = len(more), njit(function, error_model="numpy")

    @cfunc(SIGNATURE)
    def bound(pressure, slip, node):
        row = carray(node, 1 + count)
        return law(pressure, slip, row[0], *to_fixed_tuple(row[1:], count))

    return FrictionLaw(bound, getattr(function, "__name__", "friction law"), **values)


def _checked(name: str, values: Any) -> Any:
    """Return a parameter as float, array, or what is found out later, or refuse it."""
    if callable(values):
        return values
    if isinstance(values, dict):
        return {key: _checked(name, value) for key, value in values.items()}
    if isinstance(values, list | tuple):
        return [_checked(name, value) for value in values]
    found = checks.numbers(name, values)
    wrong = ~(np.isfinite(found) & (found >= 0.0))
    if wrong.any():
        raise ValueError(
            f"{name} is {found[wrong].ravel()[0]}, but a friction coefficient is a finite number >= 0."
        )
    return found if found.ndim else float(found)


def _require_order(mu_static: Any, mu_kinetic: Any) -> None:
    mu_static, mu_kinetic = _checked("mu_static", mu_static), _checked("mu_kinetic", mu_kinetic)
    known = all(isinstance(mu, int | float | np.ndarray) for mu in (mu_static, mu_kinetic))
    if known and np.any(np.asarray(mu_kinetic) > mu_static):
        raise ValueError(f"mu_kinetic is {mu_kinetic}, but it must not exceed mu_static, {mu_static}.")


@cache
def _compiled(bound: Callable[..., Any]) -> Any:
    """Compile a law when it is first asked for."""
    return cfunc(SIGNATURE, cache=True)(bound)


def _short(value: Any) -> str:
    if isinstance(value, np.ndarray):
        return f"{value.min():g} to {value.max():g}"
    return f"{value:g}" if isinstance(value, float) else getattr(value, "__name__", str(value))


def coulomb(mu: Any) -> FrictionLaw:
    """Coulomb's law, |tau| <= mu p (eq. (7) of the paper).

    Parameters
    ----------
    mu : float, array (n,), callable of places, {boundary: float}, or list of a float a road
        Coefficient of friction, >= 0.

    Raises
    ------
    ValueError
        If a coefficient is negative or not finite.

    Examples
    --------
    >>> from model import coulomb
    >>> coulomb(0.3)(10.0), coulomb(np.array([0.1, 0.4]))
    (3.0, Coulomb(mu=0.1 to 0.4))
    """
    return FrictionLaw(_compiled(_coulomb), "Coulomb", mu=mu)


def _coulomb(pressure: Any, slip: Any, node: Any) -> Any:
    return node[1] * pressure


def static_kinetic(mu_static: Any, mu_kinetic: Any) -> FrictionLaw:
    """Different coefficients at rest and in motion: |tau| <= mu_s p at rest, mu_k p in slip.

    A node that slipped in the last step needs only mu_k p to go on (Amontons-Coulomb with a static
    coefficient; Rabinowicz, Friction and Wear of Materials, 1965).

    Parameters
    ----------
    mu_static, mu_kinetic : float, or as for `coulomb`
        Coefficients, mu_static >= mu_kinetic >= 0.

    Raises
    ------
    ValueError
        If a coefficient is negative or not finite, or the kinetic one exceeds the static one.

    Examples
    --------
    >>> from model import static_kinetic
    >>> law = static_kinetic(0.5, 0.3)
    >>> law(10.0), law(10.0, 0.1), law(10.0, 0.0, 1.0)  # at rest, in slip, and after it
    (5.0, 3.0, 3.0)
    """
    _require_order(mu_static, mu_kinetic)
    return FrictionLaw(
        _compiled(_static_kinetic), "static and kinetic", mu_static=mu_static, mu_kinetic=mu_kinetic
    )


def _static_kinetic(pressure: Any, slip: Any, node: Any) -> Any:
    return (node[2] if slip > 0.0 or node[0] > 0.0 else node[1]) * pressure


def viscous(mu: Any, viscosity: Any) -> FrictionLaw:
    """Coulomb friction with a viscous part, |tau| <= mu p + c v.

    Olsson et al., European Journal of Control 4, 1998, eq. (4).

    Parameters
    ----------
    mu : float, or as for `coulomb`
        Coefficient of friction, >= 0; 0 leaves a purely viscous film.
    viscosity : float
        c, force of one node per unit of slip speed (of slip increment where slip_rate = 1), >= 0; it acts on
        nodes in contact only. A node that it would lift off the road has as much of it as leaves p = 0.

    Raises
    ------
    ValueError
        If a coefficient is negative or not finite.

    Examples
    --------
    >>> from model import viscous
    >>> viscous(0.2, viscosity=5.0)(10.0, 0.1)
    2.5
    """
    return FrictionLaw(_compiled(_viscous), "viscous", mu=mu, viscosity=viscosity)


def _viscous(pressure: Any, slip: Any, node: Any) -> Any:
    return node[1] * pressure + (node[2] * slip if pressure > 0.0 else 0.0)


def stribeck(mu_static: Any, mu_kinetic: Any, speed: Any, viscosity: Any = 0.0) -> FrictionLaw:
    """Stribeck friction: |tau| <= [mu_k + (mu_s - mu_k) exp(-(v/v_s)^2)] p + c v.

    Olsson et al., European Journal of Control 4, 1998, eq. (5), with exponent 2.

    Parameters
    ----------
    mu_static, mu_kinetic : float, or as for `coulomb`
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
    >>> law = stribeck(0.5, 0.3, speed=0.1)
    >>> law(10.0), round(law(10.0, 10.0), 6)
    (5.0, 3.0)
    """
    _require_order(mu_static, mu_kinetic)
    if not callable(speed) and not np.all(checks.numbers("speed", speed) > 0.0):
        raise ValueError(f"speed is {speed}, but the Stribeck speed is a finite number > 0.")
    return FrictionLaw(
        _compiled(_stribeck),
        "Stribeck",
        mu_static=mu_static,
        mu_kinetic=mu_kinetic,
        speed=speed,
        viscosity=viscosity,
    )


def _stribeck(pressure: Any, slip: Any, node: Any) -> Any:
    mu = node[2] + (node[1] - node[2]) * exp(-((slip / node[3]) ** 2))
    return mu * pressure + (node[4] * slip if pressure > 0.0 else 0.0)
