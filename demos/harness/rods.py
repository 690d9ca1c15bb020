"""Rods: one that hangs above a road, in closed form, and one that lies on a road and may slide along it."""

from typing import Any, NamedTuple

import numpy as np
from scipy import sparse

from model import ContactProblem


class Rod(NamedTuple):
    """A rod of n nodes that nothing but friction holds.

    Attributes
    ----------
    K : (n, n)
        Stiffness along the rod (N/m).
    x, share : (n,)
        Places (m), and the length that belongs to each node (m).
    """

    K: np.ndarray
    x: np.ndarray
    share: np.ndarray


def rod(n: int, stiffness: float = 1.0, L: float = 1.0) -> Rod:
    """Set up a rod of n nodes and a stiffness EA (N), L long (m).

    >>> rod(3).K.tolist(), rod(3).share.tolist()
    ([[2.0, -2.0, 0.0], [-2.0, 4.0, -2.0], [0.0, -2.0, 2.0]], [0.25, 0.5, 0.25])
    """
    h, ends = L / (n - 1), np.r_[0.5, np.ones(n - 2), 0.5]
    K = (stiffness / h) * (np.diag(2 * ends) - np.eye(n, k=1) - np.eye(n, k=-1))
    return Rod(K, np.linspace(0, L, n), h * ends)


def rod_problem(rod: Rod, w: float, Q: float, mu: float) -> ContactProblem:
    """Press a rod on the road by w (N/m), and pull its last node by Q (N).

    Across it is as stiff as along, which does not matter: it lies flat, so that each node bears its share of w.

    >>> from model import solve
    >>> float(solve(rod_problem(rod(11), 1.0, 0.2, 0.5)).displacement[-1, 0].round(12))
    0.04
    """
    across, along = np.array([0.0, 1.0]), np.array([1.0, 0.0])
    A: Any = sparse.csr_array(np.kron(rod.K, np.eye(2)))
    places, normal = np.outer(rod.x, along), np.tile(across, (len(rod.x), 1))
    gap = 0 * rod.x
    return ContactProblem(A, rod_load(rod, w, Q), places, np.arange(len(rod.x)), normal, gap, mu)


def rod_load(rod: Rod, w: float, Q: float) -> np.ndarray:
    """Forces (n, 2) of a weight w (N/m) and a pull Q (N) at the last node."""
    load = np.outer(rod.share, [0.0, -w])
    load[-1, 0] = Q
    return load


def hanging_rod(y: Any, L: float, E: float, weight: float, gap: float) -> tuple[Any, Any, float]:
    """Displacement (m) and stress (Pa) at heights y of a rod that hangs a gap above a road, and the road's pressure.

    >>> hanging_rod(0.0, 1.0, 1e6, 1e4, 2e-3)
    (-0.002, -3000.0, 3000.0)
    """
    p = max(weight * L / 2 - E * gap / L, 0.0)
    return (p * (L - y) - weight / 2 * (L**2 - y**2)) / E, weight * y - p, p
