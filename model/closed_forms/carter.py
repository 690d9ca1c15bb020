"""Closed form of steady tractive rolling of a cylinder: F. W. Carter, Proc. R. Soc. A 112 (1926) 151.

Source: Johnson, Contact Mechanics (1985), section 8.3. Like Mindlin's, it takes normal and tangential
tractions as uncoupled; the stick zone keeps its width but touches the leading edge, here at x = +a.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from checks import numbers
from model.closed_forms.hertz import ellipse
from model.closed_forms.mindlin import MindlinCylinder


@dataclass(frozen=True)
class Carter(MindlinCylinder):
    """A cylinder that rolls steadily towards +x under P and transmits Q: Mindlin's, its stick zone moved.

    Examples
    --------
    >>> from model.closed_forms.hertz import HertzCylinder
    >>> round(Carter(HertzCylinder(P=1e4, R=10.0, E=210e3, nu=0.3), Q=3750.0, mu=0.5).creepage, 5)
    0.01857
    """

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
        x = numbers("x", x)
        return self.mu * p0 * (ellipse(x, a) - self.c / a * ellipse(x - (a - self.c), self.c))
