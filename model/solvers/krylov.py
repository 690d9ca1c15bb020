"""Krylov methods for vectors that many ranks may share, each of which holds copies of others' nodes."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numba import njit
from scipy.linalg import eigh_tridiagonal

from model.node_loop.blocks import FUSED

Operator = Callable[[np.ndarray], np.ndarray]
Product = Callable[[np.ndarray, np.ndarray], float]


def conjugate_gradients(
    cycle: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]],
    r: np.ndarray,
    wanted: float,
    limit: int,
    ranks: Any,
) -> tuple[np.ndarray, int]:
    """Solve A x = r, with A and its preconditioner symmetric.

    Parameters
    ----------
    cycle : function of a vector r (N, d)
        Returns z, about A^-1 r, and what it leaves, r - A z, so that no other product with A is needed. Both
        may be overwritten by its next call.
    r : (N, d)
        Right-hand side, zero at copies of other ranks' nodes; becomes the defect.
    wanted : float
        Norm of the defect at which to stop.
    limit : int
        Iterations at most.
    ranks : OneRank or geometry.exchange.Exchange

    Returns
    -------
    x : (N, d)
    count : int

    Examples
    --------
    >>> from model.one_rank import ONE_RANK
    >>> x, count = conjugate_gradients(lambda r: (r, r - 2 * r), np.ones((3, 1)), 1e-12, 5, ONE_RANK)
    >>> x.ravel(), count
    (array([0.5, 0.5, 0.5]), 1)
    """
    x, direction, product = (np.zeros_like(r) for _ in range(3))
    before, count = 1.0, 0
    while count < limit:
        z, left = cycle(r)
        count += 1
        power = ranks.sum(np.vdot(r, z))
        if power <= 0.0:  # nothing is missing from what is linear
            break
        stiffness = ranks.sum(turn_direction(power / before, z, r, left, direction, product))
        before = power
        if stiffness <= 0.0:  # along a rigid motion, which nothing resists
            break
        if np.sqrt(ranks.sum(step_along(power / stiffness, direction, product, x, r))) <= wanted:
            break
    return x, count


@njit(cache=True, error_model="numpy", fastmath=FUSED)
def turn_direction(beta, z, r, left, direction, product):
    """Do direction = z + beta direction, and the same with `product`, -A direction, to which A z = r - left.

    Return direction . A direction.
    """
    s = 0.0
    for i in range(z.shape[0]):
        for a in range(z.shape[1]):
            direction[i, a] = z[i, a] + beta * direction[i, a]
            product[i, a] = left[i, a] - r[i, a] + beta * product[i, a]
            s -= direction[i, a] * product[i, a]
    return s


@njit(cache=True, error_model="numpy", fastmath=FUSED)
def step_along(alpha, direction, product, x, r):
    """Do x += alpha direction, r += alpha product, with product = -A direction; return r . r."""
    s = 0.0
    for i in range(x.shape[0]):
        for a in range(x.shape[1]):
            x[i, a] += alpha * direction[i, a]
            r[i, a] += alpha * product[i, a]
            s += r[i, a] * r[i, a]
    return s


def flexible_gmres(
    minus: Operator, precondition: Operator, r: np.ndarray, wanted: float, limit: int, ranks: Any
) -> tuple[np.ndarray, int]:
    """Solve A x = r, for any A, by functions of a vector: -A v, and about A^-1 v (Saad 1993).

    r is kept; other arguments and result as of `conjugate_gradients`. By classical Gram-Schmidt, two sums
    over ranks a step: the bases are too short to lose much by it.

    Examples
    --------
    >>> from model.one_rank import ONE_RANK
    >>> turn = np.array([[1.0, -1.0], [1.0, 1.0]])
    >>> r = np.array([[2.0], [0.0]])
    >>> x, count = flexible_gmres(lambda v: -turn @ v, lambda v: v, r, 1e-12, 5, ONE_RANK)
    >>> x.round(12).ravel(), count
    (array([ 1., -1.]), 2)
    """
    size = np.sqrt(ranks.sum(np.vdot(r, r)))
    if size == 0.0:
        return np.zeros_like(r), 0
    basis, directions = np.empty((limit + 1, *r.shape)), np.empty((limit, *r.shape))
    H, goal = np.zeros((limit + 1, limit)), np.eye(1, limit + 1).ravel() * size
    V = basis.reshape(limit + 1, r.size)  # of both only what is written takes memory
    np.divide(r, size, out=basis[0])
    for count in range(1, limit + 1):
        directions[count - 1] = precondition(basis[count - 1])
        w, column = V[count], H[:, count - 1]
        np.negative(minus(directions[count - 1]), out=basis[count])
        column[:count] = ranks.sum(V[:count] @ w)
        w -= column[:count] @ V[:count]
        column[count] = np.sqrt(ranks.sum(np.vdot(w, w)))
        rows = slice(count + 1)
        y = np.linalg.lstsq(H[rows, :count], goal[rows], rcond=None)[0]
        if np.linalg.norm(H[rows, :count] @ y - goal[rows]) <= wanted or column[count] == 0.0:
            break
        w /= column[count]
    return np.tensordot(y, directions[:count], axes=1), count


def largest_eigenvalue(A: Operator, start: np.ndarray, tolerance: float, dot: Product) -> float:
    """Return the largest eigenvalue of A, symmetric, to a relative tolerance (Lanczos 1950).

    The basis is not kept: what rounding does to it makes copies of eigenvalues that have been found, no
    others.

    Examples
    --------
    >>> v = np.array([1.0, 1.0, 1.0])
    >>> round(largest_eigenvalue(lambda x: np.array([1.0, 2.0, 5.0]) * x, v, 1e-9, np.dot), 9)
    5.0
    """
    v, before, beta = start / np.sqrt(dot(start, start)), np.zeros_like(start), 0.0
    diagonal: list[float] = []
    beside: list[float] = []
    while True:
        w = A(v) - beta * before
        diagonal.append(dot(w, v))
        w -= diagonal[-1] * v
        last = len(beside)
        values, vectors = eigh_tridiagonal(diagonal, beside, select="i", select_range=(last, last))
        beta = np.sqrt(dot(w, w))
        if beta * abs(vectors[-1, -1]) <= tolerance * abs(values[-1]):
            return float(values[-1])
        beside.append(beta)
        before, v = v, w / beta
