"""How far a body has turned at each of its nodes: the rotation R of F = R U, F the mean around the node."""

from typing import Any

import numpy as np

ITERATIONS = 30  # of Newton's method for the polar decomposition; where strain is moderate it takes four
STILL = 1e-8  # change of R that ends it: what is left is its square


class LocalRotations:
    """Rotations of a body at its nodes.

    Parameters
    ----------
    body : FiniteBody
        Nodes that are held in some directions and free in others do not turn, since axes that turned would
        mix the two.
    """

    def __init__(self, body: Any):
        self.forces = body.forces
        held = body.prescribed
        self._still = np.flatnonzero(held.any(axis=1) & ~held.all(axis=1))

    def __call__(self, u: np.ndarray) -> np.ndarray:
        """Return the rotations (N, d, d) at displacement u (N, d)."""
        R = polar(self.forces.stretches(u))
        R[self._still] = np.eye(u.shape[1])
        return R


def polar(F: np.ndarray) -> np.ndarray:
    """Return the rotations (N, d, d) nearest to matrices F (N, d, d) of positive determinant.

    Source: N. J. Higham, SIAM J. Sci. Stat. Comput. 7 (1986) 1160, Newton's method for R = (R + R^-T) / 2.

    Examples
    --------
    >>> import numpy as np
    >>> turn = np.array([[0.0, -1.0], [1.0, 0.0]])
    >>> polar(turn @ np.diag([2.0, 0.5])[None]).round(12)
    array([[[ 0., -1.],
            [ 1.,  0.]]])
    """
    if F.shape[-1] == 2:
        c, s = F[:, 0, 0] + F[:, 1, 1], F[:, 1, 0] - F[:, 0, 1]
        size = np.hypot(c, s)
        c, s = c / size, s / size
        return np.stack([c, -s, s, c], axis=-1).reshape(-1, 2, 2)
    R = F
    for _ in range(ITERATIONS):
        before, R = R, 0.5 * (R + np.linalg.inv(R).swapaxes(1, 2))
        if np.abs(R - before).max() < STILL:
            break
    return R
