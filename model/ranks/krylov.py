"""Krylov methods for vectors that many ranks share, whose inner products the caller sums over them."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy import vdot as inner
from scipy.linalg import eigh_tridiagonal

from model.solvers.truncated_multigrid import step_along

Operator = Callable[[np.ndarray], np.ndarray]
Product = Callable[[np.ndarray, np.ndarray], float]
Sum = Callable[[Any], Any]


def conjugate_gradients(
    minus: Operator, precondition: Operator, r: np.ndarray, wanted: float, limit: int, total: Sum
) -> tuple[np.ndarray, int]:
    """Solve A x = r, with A and its preconditioner symmetric.

    Parameters
    ----------
    minus, precondition : functions of a vector
        The former returns -A v; what they return may be overwritten by their next call.
    r : (N, d)
        Right-hand side, zero at copies of other ranks' nodes; becomes the defect.
    wanted : float
        Norm of the defect at which to stop.
    limit : int
        Iterations at most.
    total : function of a number or array
        Its sum over ranks.

    Returns
    -------
    x : (N, d)
    count : int

    Examples
    --------
    >>> x, count = conjugate_gradients(lambda v: -2 * v, lambda v: v, np.ones((3, 1)), 1e-12, 5, float)
    >>> x.ravel(), count
    (array([0.5, 0.5, 0.5]), 1)
    """
    x, direction, before, count = np.zeros_like(r), np.zeros_like(r), 1.0, 0
    while count < limit:
        z = precondition(r)
        count += 1
        power = total(inner(r, z))
        if power <= 0.0:  # nothing is missing
            break
        direction *= power / before
        direction += z
        before = power
        product = minus(direction)
        missing = step_along(-power / total(inner(direction, product)), direction, product, x, r)
        if np.sqrt(total(missing**2)) <= wanted:
            break
    return x, count


def flexible_gmres(
    minus: Operator, precondition: Operator, r: np.ndarray, wanted: float, limit: int, total: Sum
) -> tuple[np.ndarray, int]:
    """Solve A x = r; arguments and result as of `conjugate_gradients`, r is kept (Saad 1993).

    By classical Gram-Schmidt, two sums over ranks a step: the bases are too short to lose much by it.

    Examples
    --------
    >>> turn = np.array([[1.0, -1.0], [1.0, 1.0]])
    >>> r = np.array([[2.0], [0.0]])
    >>> x, count = flexible_gmres(lambda v: -turn @ v, lambda v: v, r, 1e-12, 5, np.asarray)
    >>> x.round(12).ravel(), count
    (array([ 1., -1.]), 2)
    """
    size = np.sqrt(total(inner(r, r)))
    if size == 0.0:
        return np.zeros_like(r), 0
    basis, directions, H = (
        np.empty((limit + 1, *r.shape)),
        np.empty((limit, *r.shape)),
        np.zeros((limit + 1, limit)),
    )
    V = basis.reshape(limit + 1, r.size)  # of both only what is written takes memory
    np.divide(r, size, out=basis[0])
    for count in range(1, limit + 1):
        directions[count - 1] = precondition(basis[count - 1])
        w, column = V[count], H[:, count - 1]
        np.negative(minus(directions[count - 1]), out=basis[count])
        column[:count] = total(V[:count] @ w)
        w -= column[:count] @ V[:count]
        column[count] = np.sqrt(total(w @ w))
        goal = np.zeros(count + 1)
        goal[0] = size
        y = np.linalg.lstsq(H[: count + 1, :count], goal, rcond=None)[0]
        if np.linalg.norm(H[: count + 1, :count] @ y - goal) <= wanted or column[count] == 0.0:
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
        values, vectors = eigh_tridiagonal(diagonal, beside)
        beta = np.sqrt(dot(w, w))
        if beta * abs(vectors[-1, -1]) <= tolerance * abs(values[-1]):
            return float(values[-1])
        beside.append(beta)
        before, v = v, w / beta
