"""Closed form of the impact of a rod against a wall.

Source: a benchmark of F. Dabaghi, A. Petrov, J. Pousin and Y. Renard, Appl. Numer. Math. 103 (2016) 48; the
formulas are d'Alembert's, piecewise linear.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from checks import numbers, positive


@dataclass(frozen=True)
class RodImpact:
    """A rod fixed at x = L that may touch a wall with its end x = 0: u(L, t) = 0 and u(0, t) >= 0.

    It starts at rest, evenly compressed, away from the wall: u(x, 0) = (L - x) / 2. It relaxes for a third of
    the period, lies against the wall for a third and springs back for a third. Positions and times broadcast
    against each other; x from 0 (at the wall) to L, t >= 0.

    Parameters
    ----------
    L : float
        Length (m).
    E : float
        Modulus (Pa; in plane strain E (1 - nu) / ((1 + nu) (1 - 2 nu)), or nu = 0).
    rho : float
        Density (kg/m^3).

    Raises
    ------
    ValueError
        If a parameter is not positive, a position lies outside the rod or a time before the start.

    Examples
    --------
    >>> rod = RodImpact(L=2.0, E=9e4, rho=1e3)
    >>> float(rod.period), float(rod.energy)
    (0.6324555320336759, 22500.0)
    >>> [float(p) for p in rod.contact_pressure([0.1, 0.3, 0.5])]
    [0.0, 45000.0, 0.0]
    """

    L: float = 1.0
    E: float = 1.0
    rho: float = 1.0

    def __post_init__(self) -> None:
        """Check the numbers once."""
        positive(L=self.L, E=self.E, rho=self.rho)

    @property
    def period(self) -> float:
        """Period of the motion, 3 L sqrt(rho / E) (s)."""
        return 3.0 * self.L / self._speed

    @property
    def energy(self) -> float:
        """Energy per cross-section, E L / 8 (J/m^2): the strain energy at the start; it never changes."""
        return self.E * self.L / 8.0

    @property
    def _speed(self) -> float:
        """Speed of waves (m/s)."""
        return float(np.sqrt(self.E / self.rho))

    def displacement(self, x: ArrayLike, t: ArrayLike) -> np.ndarray:
        """u(x, t), positive away from the wall (m).

        With L = E = rho = 1: min(1 - x, 1 - t) / 2 while it approaches, t <= 1; -min(x, 1 - x, s, 1 - s) / 2
        with s = t - 1 while it touches; the approach backwards in time, u(x, 3 - t), afterwards.
        """
        x, t = self._checked(x, t)
        apart = np.minimum(t, 3.0 - t)
        inside = np.minimum(np.minimum(x, 1 - x), np.minimum(t - 1, 2 - t))
        return self.L * np.where((t > 1) & (t < 2), -inside / 2, np.minimum(1 - x, 1 - apart) / 2)

    def velocity(self, x: ArrayLike, t: ArrayLike) -> np.ndarray:
        """du/dt (m/s); where it jumps, the value just after."""
        x, t = self._checked(x, t)
        approaching = np.where(x < t, -0.5, 0)
        s = t - 1
        moving = np.minimum(x, 1 - x) > np.minimum(s, 1 - s)
        in_contact = np.where(moving, np.where(s < 0.5, -0.5, 0.5), 0)
        leaving = np.where(x <= 3.0 - t, 0.5, 0)
        return self._speed * np.select([t < 1, t < 2], [approaching, in_contact], leaving)

    def stress(self, x: ArrayLike, t: ArrayLike) -> np.ndarray:
        """E du/dx, the axial stress (Pa); where it jumps, that towards x = L."""
        x, t = self._checked(x, t)
        apart = np.where(x >= np.minimum(t, 3.0 - t), -0.5, 0)
        reached = np.minimum(t - 1, 2 - t)
        in_contact = np.select([x < reached, x >= 1 - reached], [-0.5, 0.5], 0)
        return self.E * np.where((t >= 1) & (t < 2), in_contact, apart)

    def contact_pressure(self, t: ArrayLike) -> np.ndarray:
        """Pressure of the wall on the rod: E/2 in the middle third of every period, else 0 (Pa)."""
        t = self._checked(0, t)[1]
        return self.E * np.where((t > 1) & (t < 2), 0.5, 0)

    def _checked(self, x: ArrayLike, t: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
        """Positions over L, and times over L / speed within the first period."""
        x, t = numbers("x", x), numbers("t", t)
        slack = 4 * np.finfo(float).eps * self.L  # nodes of a mesh are where rounding has put them
        inside = (x >= -slack) & (x <= self.L + slack)
        for name, values, right in [("x", x, inside), ("t", t, (t >= 0) & np.isfinite(t))]:
            if not np.all(right):
                remedy = f"between 0 and {self.L:g}, the ends of the rod" if name == "x" else "0 or later"
                raise ValueError(f"{name} must be {remedy}, not {values[~right].flat[0]}.")
        return np.clip(x / self.L, 0.0, 1.0), (t * (self._speed / self.L)) % 3.0
