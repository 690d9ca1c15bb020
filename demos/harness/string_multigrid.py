"""Truncated multigrid for a string on a road, in the fewest lines that show how it goes."""

from collections.abc import Callable

import numpy as np
from numba import njit

from harness.strings import string


@njit
def relax(K: np.ndarray, b: np.ndarray, lower: np.ndarray, u: np.ndarray) -> None:
    """Sweep once over all nodes, each above its bound (the paper's eq. 9)."""
    for i in range(len(b)):
        u[i] = max(u[i] + (b[i] - K[i] @ u) / K[i, i], lower[i])


def interpolation(n: int) -> np.ndarray:
    """From (n - 1)/2 coarse nodes to n fine ones, linear."""
    P = np.zeros((n, n // 2))
    for j in range(n // 2):
        P[2 * j : 2 * j + 3, j] = 0.5, 1.0, 0.5
    return P


def coarse(K: np.ndarray, P: np.ndarray) -> np.ndarray:
    """Galerkin's product; a coarse node that only reaches nodes which touch gets a single diagonal entry."""
    product = P.T @ K @ P
    product[np.diag(product) == 0, np.diag(product) == 0] = 1.0
    return product


def correction(K: np.ndarray, r: np.ndarray) -> np.ndarray:
    """Approximate the solution of K c = r by a V(1,1) cycle without a road."""
    n, c, free = len(r), np.zeros(len(r)), np.full(len(r), -np.inf)
    if n <= 3:
        return np.linalg.solve(K, r)
    relax(K, r, free, c)
    P = interpolation(n)
    c += P @ correction(coarse(K, P), P.T @ (r - K @ c))
    relax(K, r, free, c)
    return c


def cycle(K: np.ndarray, b: np.ndarray, lower: np.ndarray, u: np.ndarray, truncate: bool = True) -> None:
    """One cycle of truncated multigrid: the loop decides contact, coarser strings take out what is smooth."""
    relax(K, b, lower, u)
    P, r, J = interpolation(len(u)), b - K @ u, lambda v: 0.5 * v @ (K @ v) - b @ v
    r[(u == lower) & (r < 0)] = 0  # what the road carries
    P[(u == lower) & truncate] = 0
    c, t, before = P @ correction(coarse(K, P), P.T @ r), 1.0, J(u)
    while J(np.maximum(u + t * c, lower)) > before + 1e-15 * abs(before):
        t /= 2
    u[:] = np.maximum(u + t * c, lower)
    relax(K, b, lower, u)


def steps(step: Callable, u: np.ndarray, tolerance: float = 1e-8) -> list[float]:
    """Take steps from u (n,), in place, until what no road carries is small; return it after each, in loads of a node.

    >>> len(steps(cycle, from_below(31)))
    6
    """
    (K, b, lower, *_), history = string(len(u)), []
    while not history or history[-1] > tolerance:
        step(K, b, lower, u)
        r = K @ u - b
        history.append(np.abs(np.where(u == lower, np.minimum(r, 0.0), r)).max() / np.abs(b).max())
    return history


def from_below(n: int) -> np.ndarray:
    """Return a start: what the next coarser string, solved likewise, says on this one (nested iteration)."""
    return np.asarray(np.maximum(interpolation(n) @ nested(n // 2), string(n).lower))


def nested(n: int, cycles: int | None = None, tolerance: float = 1e-8) -> np.ndarray:
    """Displacement (n,) by nested iteration from three nodes on, with so many cycles a string, or to a tolerance."""
    if n <= 3:
        return np.zeros(n)
    K, b, lower, *_ = string(n)
    u = np.maximum(interpolation(n) @ nested(n // 2, cycles, tolerance), lower)
    for _ in range(cycles or 0):
        cycle(K, b, lower, u)
    if cycles is None:
        steps(cycle, u, tolerance)
    return np.asarray(u)
