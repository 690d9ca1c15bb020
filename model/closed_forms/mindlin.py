"""Closed form of partial slip under a tangential force: Cattaneo (1938) and Mindlin (1949).

Source: equations (14) and (15) of the paper for the cylinder; Johnson, Contact Mechanics (1985), section 7.2.
Normal and tangential tractions are taken as uncoupled: equal bodies, or nu = 1/2 on a rigid plane.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from checks import instance, positive, tangential_load
from model.closed_forms.hertz import HertzCylinder, HertzSphere, ellipse


@dataclass(frozen=True)
class MindlinCylinder:
    """A cylinder pressed by P, then pushed by Q <= mu P; equations (14) and (15).

    Parameters
    ----------
    normal : HertzCylinder
        The normal contact.
    Q : float
        Tangential force per unit length (N/mm), 0 <= Q <= mu P; Q = mu P is full sliding.
    mu : float
        Coefficient of friction.

    Raises
    ------
    ValueError
        If mu is not positive or Q is out of range.

    Examples
    --------
    >>> pushed = MindlinCylinder(HertzCylinder(P=1e4, R=10.0, E=210e3, nu=0.3), Q=3750.0, mu=0.5)
    >>> round(pushed.c / pushed.normal.a, 3)
    0.5
    """

    normal: HertzCylinder
    Q: float
    mu: float

    def __post_init__(self) -> None:
        """Check the numbers once."""
        instance(HertzCylinder, normal=self.normal)
        positive(mu=self.mu)
        tangential_load(self.Q, self.mu * self.normal.P)

    @property
    def c(self) -> float:
        """Half width of the stick zone, c = a sqrt(1 - Q / (mu P)) (mm)."""
        return self.normal.a * float(np.sqrt(1 - self.Q / (self.mu * self.normal.P)))

    def traction(self, x: ArrayLike) -> np.ndarray:
        """Magnitude of the traction at x (MPa): mu p, less a similar ellipse where it sticks, |x| < c."""
        p0, a = self.normal.p0, self.normal.a
        return self.mu * p0 * (ellipse(x, a) - self.c / a * ellipse(x, self.c))

    def sliding_traction(self, x: ArrayLike) -> np.ndarray:
        """Traction of the same cylinder in full sliding, mu p (MPa)."""
        return self.mu * self.normal.pressure(x)


@dataclass(frozen=True)
class MindlinSphere:
    """A sphere pressed by F, then pushed by Q <= mu F; Johnson (7.36) to (7.42).

    Parameters
    ----------
    normal : HertzSphere
        The normal contact.
    Q : float
        Tangential force (N), 0 <= Q <= mu F; Q = mu F is full sliding.
    mu : float
        Coefficient of friction.

    Raises
    ------
    ValueError
        If mu is not positive or Q is out of range.

    Examples
    --------
    >>> pushed = MindlinSphere(HertzSphere(F=1e4, R=10.0, E=210e3, nu=0.3), Q=4375.0, mu=0.5)
    >>> round(pushed.c / pushed.normal.a, 3), round(pushed.shift, 4)
    (0.5, 0.0215)
    """

    normal: HertzSphere
    Q: float
    mu: float

    def __post_init__(self) -> None:
        """Check the numbers once."""
        instance(HertzSphere, normal=self.normal)
        positive(mu=self.mu)
        tangential_load(self.Q, self.mu * self.normal.F)

    @property
    def c(self) -> float:
        """Radius of the stick zone, c = a (1 - Q / (mu F))^(1/3) (mm)."""
        return self.normal.a * float(np.cbrt(1 - self.Q / (self.mu * self.normal.F)))

    @property
    def shift(self) -> float:
        """How far distant points move along the plane (mm).

        3 mu F (2 - nu) / (16 G a) (1 - (1 - Q / (mu F))^(2/3)), Johnson (7.42) with one body rigid;
        G = E / (2 (1 + nu)).
        """
        sphere = self.normal
        G = sphere.E / (2 * (1 + sphere.nu))
        full = 3 * self.mu * sphere.F * (2 - sphere.nu) / (16 * G * sphere.a)
        return full * (1 - (self.c / sphere.a) ** 2)

    def traction(self, r: ArrayLike) -> np.ndarray:
        """Magnitude of the traction at r, everywhere along Q (MPa): mu p, less an ellipsoid where r < c."""
        p0, a = self.normal.p0, self.normal.a
        return self.mu * p0 * (ellipse(r, a) - self.c / a * ellipse(r, self.c))
