"""Steady tractive rolling of a cylinder: F. W. Carter, Proc. R. Soc. A 112 (1926) 151.

Source: Johnson, Contact Mechanics (1985), section 8.3. Like Mindlin's, it takes normal and tangential
tractions as uncoupled; the stick zone keeps its width but touches the leading edge, here at x = +a.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from .checks import positive, tangential_load
from .hertz import HertzCylinder, ellipse


@dataclass(frozen=True)
class Carter:
    """A cylinder that rolls steadily towards +x under P and transmits Q.

    Parameters
    ----------
    normal : HertzCylinder
        The normal contact.
    Q : float
        Tangential force per unit length (N/mm), 0 <= Q <= mu P.
    mu : float
        Coefficient of friction.

    Raises
    ------
    ValueError
        If mu is not positive or Q is out of range.
    """

    normal: HertzCylinder
    Q: float
    mu: float

    def __post_init__(self) -> None:
        """Check the numbers once."""
        positive(mu=self.mu)
        tangential_load(self.Q, self.mu * self.normal.P)

    @property
    def c(self) -> float:
        """Half width of the stick zone, a sqrt(1 - Q / (mu P)) (mm)."""
        return self.normal.a * float(np.sqrt(1 - self.Q / (self.mu * self.normal.P)))

    @property
    def stick_zone(self) -> tuple[float, float]:
        """Where it sticks, from a - 2 c to the leading edge a (mm)."""
        return self.normal.a - 2 * self.c, self.normal.a

    @property
    def creepage(self) -> float:
        """Magnitude of the creepage, (mu a / R) (1 - sqrt(1 - Q / (mu P))), dimensionless."""
        a = self.normal.a
        return self.mu * a / self.normal.R * (1 - self.c / a)

    def traction(self, x: ArrayLike) -> np.ndarray:
        """Magnitude of the traction at x: mu p, less a similar ellipse about a - c where it sticks (MPa)."""
        p0, a = self.normal.p0, self.normal.a
        x = np.asarray(x, dtype=float)
        return self.mu * p0 * (ellipse(x, a) - self.c / a * ellipse(x - (a - self.c), self.c))
