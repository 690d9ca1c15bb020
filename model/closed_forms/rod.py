"""A rod against a wall: the closed form of an impact.

A rod of length, density and modulus 1 is fixed at x = 1 and may touch a wall with its end x = 0: u(1, t) = 0
and u(0, t) >= 0. It starts at rest, evenly compressed, away from the wall: u(x, 0) = (1 - x) / 2. It relaxes
for one unit of time, lies against the wall for one and springs back for one; the motion has period 3.
For a rod of length L, modulus E and density rho multiply lengths by L, times by L sqrt(rho / E), stress by E.

Source: a benchmark of F. Dabaghi, A. Petrov, J. Pousin and Y. Renard, Appl. Numer. Math. 103 (2016) 48; the
formulas are d'Alembert's, piecewise linear. Positions and times broadcast against each other.
"""

import numpy as np
from numpy.typing import ArrayLike

PERIOD = 3.0
ENERGY = 1 / 8  # strain energy at the start, 1/2 (1/2)^2; it never changes


def displacement(x: ArrayLike, t: ArrayLike) -> np.ndarray:
    """u(x, t), positive away from the wall.

    Parameters
    ----------
    x : array_like
        Positions, 0 (at the wall) to 1 (fixed).
    t : array_like
        Times, 0 or later.

    Returns
    -------
    numpy.ndarray
        min(1 - x, 1 - t) / 2 while it approaches, t <= 1; -min(x, 1 - x, s, 1 - s) / 2 with s = t - 1
        while it touches; the approach backwards in time, u(x, 3 - t), afterwards.

    Raises
    ------
    ValueError
        If a position lies outside the rod or a time before the start.
    """
    x, t = _checked(x, t)
    apart = np.minimum(t, PERIOD - t)
    touching = np.minimum(np.minimum(x, 1 - x), np.minimum(t - 1, 2 - t))
    return np.where((t > 1) & (t < 2), -touching / 2, np.minimum(1 - x, 1 - apart) / 2)


def velocity(x: ArrayLike, t: ArrayLike) -> np.ndarray:
    """du/dt at the same x and t as `displacement`; where it jumps, the value just after."""
    x, t = _checked(x, t)
    approaching = np.where(x < t, -0.5, 0)
    s = t - 1
    moving = np.minimum(x, 1 - x) > np.minimum(s, 1 - s)
    touching = np.where(moving, np.where(s < 0.5, -0.5, 0.5), 0)
    leaving = np.where(x <= PERIOD - t, 0.5, 0)
    return np.select([t < 1, t < 2], [approaching, touching], leaving)


def stress(x: ArrayLike, t: ArrayLike) -> np.ndarray:
    """du/dx, the axial stress, at the same x and t as `displacement`; where it jumps, that towards x = 1."""
    x, t = _checked(x, t)
    apart = np.where(x >= np.minimum(t, PERIOD - t), -0.5, 0)
    reached = np.minimum(t - 1, 2 - t)
    touching = np.select([x < reached, x >= 1 - reached], [-0.5, 0.5], 0)
    return np.where((t >= 1) & (t < 2), touching, apart)


def contact_pressure(t: ArrayLike) -> np.ndarray:
    """Pressure of the wall on the rod: 1/2 for 1 < t < 2 in every period, else 0."""
    t = _checked(0, t)[1]
    return np.where((t > 1) & (t < 2), 0.5, 0)


def _checked(x: ArrayLike, t: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    """Positions inside the rod and times within the first period."""
    x, t = np.asarray(x, dtype=float), np.asarray(t, dtype=float)
    for name, values, right in [("x", x, (x >= 0) & (x <= 1)), ("t", t, (t >= 0) & np.isfinite(t))]:
        if not np.all(right):
            remedy = "between 0 and 1, the ends of the rod" if name == "x" else "0 or later"
            raise ValueError(f"{name} must be {remedy}, not {values[~right].flat[0]}.")
    return x, t % PERIOD
