"""Springs that keep a body which nothing holds within reach of where it is.

On the planes of one iteration a body may have no equilibrium, or one far away, though the road would stop it
soon. As many springs as the body has free rigid modes then bound the step (a proximal term, K. Levenberg,
Quart. Appl. Math. 2 (1944) 164). At the solution they do nothing, for the body is where they are at rest.
"""

from typing import Any

import numpy as np

from model.problem.rigid_modes import RigidModes, determinate_unknowns

FIRST, MOST = 0.1, 1e6  # of the load by the size: the stiffness that is tried first, and last
TIMES = 10.0  # how much stiffer or softer they get


class ProximalSprings:
    """Springs on candidates, none at first.

    Parameters
    ----------
    rigid : RigidModes or None
        None: the body is held.
    unit : float
        Stiffness that the load has on a way of the body's size.
    shape : (n, d)
        Of the candidates' positions.
    """

    def __init__(self, rigid: RigidModes | None, unit: float, shape: Any):
        self.rigid, self.unit, self.shape, self.stiffness = rigid, unit, shape, 0.0
        self._patience, self._wait = 0, 0

    def springs(self) -> np.ndarray:
        """Stiffness (n, d, d)."""
        n, d = self.shape
        springs = np.zeros((n, d, d))
        if self.rigid is not None and self.stiffness > 0.0:
            free = determinate_unknowns(self.rigid.at(self.rigid.nodes).reshape(n * d, -1))
            c, a = np.divmod(free, d)
            springs[c, a, a] = self.stiffness * self.unit
        return springs

    def tighten(self) -> bool:
        """Make the springs stiffer; False where that is of no use."""
        if self.rigid is None or self.rigid.count == 0 or self.unit == 0.0 or self.stiffness >= MOST:
            return False
        self.stiffness = TIMES * self.stiffness or FIRST
        return True

    def needed(self) -> bool:
        """As `tighten`, for springs so soft that there was no solution: they stay longer each time."""
        self._patience = 2 * self._patience + 1
        self._wait = self._patience
        return self.tighten()

    def loosen(self) -> None:
        """Make the springs softer, and take away what is hardly left; unless they are to stay yet."""
        if self._wait:
            self._wait -= 1
            return
        self.stiffness = self.stiffness / TIMES if self.stiffness * MOST > 1.0 else 0.0
