"""A string under tension above a road: its matrix, its load, and the closed form."""

from typing import NamedTuple

import numpy as np


class String(NamedTuple):
    """A string of n nodes, held at both ends.

    Attributes
    ----------
    K : (n, n)
        Stiffness (N/m).
    b, lower : (n,)
        Load (N), and displacement on the road (m).
    x, exact : (n,)
        Places along the string, and the displacement in closed form (m).
    """

    K: np.ndarray
    b: np.ndarray
    lower: np.ndarray
    x: np.ndarray
    exact: np.ndarray


def string(n: int, T: float = 1.0, q: float = 2.0, d: float = 0.2, L: float = 2.0) -> String:
    """Set up a string of n nodes under tension T (N) and load q (N/m), d above a road, L long (m).

    A string that is not pressed is a parabola, which comes down on the road without a kink.

    >>> string(3).K[0].tolist()
    [4.0, -2.0, 0.0]
    """
    h = L / (n + 1)
    x = h * np.arange(1, n + 1)
    K = (T / h) * (2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))
    down = np.maximum(np.sqrt(2 * T * d / q) - np.minimum(x, L - x), 0.0)
    return String(K, np.full(n, -q * h), np.full(n, -d), x, -d + q / (2 * T) * down**2)
