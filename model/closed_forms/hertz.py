"""Closed form of frictionless contact of a cylinder or sphere on a rigid plane (Hertz).

Source: equations (12) and (13) of the paper for the cylinder; K. L. Johnson, Contact Mechanics (1985),
section 4.2. Any consistent units will do; those in brackets are the demos'.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from checks import numbers, poisson_ratio, positive


def effective_modulus(E: float, nu: float) -> float:
    """E* = E / (1 - nu^2), of an elastic body on a rigid one, equation (13).

    Parameters
    ----------
    E : float
        Young's modulus (MPa).
    nu : float
        Poisson's ratio, -1 < nu <= 1/2.

    Raises
    ------
    ValueError
        If E is not positive or nu is out of range.

    Examples
    --------
    >>> effective_modulus(E=9.1, nu=0.3)
    10.0
    """
    positive(E=E)
    poisson_ratio(nu)
    return E / (1 - nu**2)


def ellipse(x: ArrayLike, half_width: float) -> np.ndarray:
    """sqrt(1 - x^2 / half_width^2) where |x| < half_width, 0 elsewhere; all 0 for a half width of 0."""
    x = numbers("x", x)
    if half_width <= 0:
        return np.zeros_like(x)
    return np.sqrt(np.clip(1 - (x / half_width) ** 2, 0, None))


@dataclass(frozen=True)
class HertzCylinder:
    """An elastic cylinder pressed on a rigid plane, equations (12) and (13).

    Parameters
    ----------
    P : float
        Normal load per unit length (N/mm).
    R : float
        Radius (mm).
    E : float
        Young's modulus (MPa).
    nu : float
        Poisson's ratio.

    Raises
    ------
    ValueError
        If P, R or E is not positive or nu is out of range.

    Examples
    --------
    >>> hertz = HertzCylinder(P=1e4, R=10.0, E=210e3, nu=0.3)
    >>> round(hertz.p0, 2), round(hertz.a, 5)
    (8570.66, 0.74279)
    """

    P: float
    R: float
    E: float
    nu: float

    def __post_init__(self) -> None:
        """Check the numbers once."""
        positive(P=self.P, R=self.R)
        effective_modulus(self.E, self.nu)

    @property
    def p0(self) -> float:
        """Greatest pressure, sqrt(P E* / (pi R)) (MPa)."""
        return float(np.sqrt(self.P * effective_modulus(self.E, self.nu) / (np.pi * self.R)))

    @property
    def a(self) -> float:
        """Half width of the patch, sqrt(4 P R / (pi E*)) (mm)."""
        return float(np.sqrt(4 * self.P * self.R / (np.pi * effective_modulus(self.E, self.nu))))

    def pressure(self, x: ArrayLike) -> np.ndarray:
        """p(x) = p0 sqrt(1 - x^2 / a^2) in the patch, 0 outside (MPa), at x from the middle (mm)."""
        return self.p0 * ellipse(x, self.a)


@dataclass(frozen=True)
class HertzSphere:
    """An elastic sphere pressed on a rigid plane, Johnson (4.22) to (4.24).

    Parameters
    ----------
    F : float
        Normal load (N).
    R : float
        Radius (mm).
    E : float
        Young's modulus (MPa).
    nu : float
        Poisson's ratio.

    Raises
    ------
    ValueError
        If F, R or E is not positive or nu is out of range.

    Examples
    --------
    >>> ball = HertzSphere(F=1e4, R=10.0, E=210e3, nu=0.3)
    >>> round(ball.p0, 1), round(ball.a, 4), round(ball.approach, 4)
    (10100.7, 0.6875, 0.0473)
    """

    F: float
    R: float
    E: float
    nu: float

    def __post_init__(self) -> None:
        """Check the numbers once."""
        positive(F=self.F, R=self.R)
        effective_modulus(self.E, self.nu)

    @property
    def a(self) -> float:
        """Radius of the patch, a^3 = 3 F R / (4 E*) (mm)."""
        return float(np.cbrt(3 * self.F * self.R / (4 * effective_modulus(self.E, self.nu))))

    @property
    def p0(self) -> float:
        """Greatest pressure, 3 F / (2 pi a^2) (MPa)."""
        return 3 * self.F / (2 * np.pi * self.a**2)

    @property
    def approach(self) -> float:
        """How far distant points of the sphere come nearer to the plane, a^2 / R (mm)."""
        return self.a**2 / self.R

    def pressure(self, r: ArrayLike) -> np.ndarray:
        """p(r) = p0 sqrt(1 - r^2 / a^2) in the patch, 0 outside (MPa), at the radii r (mm)."""
        return self.p0 * ellipse(r, self.a)
