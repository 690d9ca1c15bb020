"""Krylov methods whose inner products are the caller's, for vectors that many ranks share."""

from collections.abc import Callable

import numpy as np
from scipy.linalg import eigh_tridiagonal

Operator = Callable[[np.ndarray], np.ndarray]
Product = Callable[[np.ndarray, np.ndarray], float]
Products = Callable[[list[np.ndarray], np.ndarray], np.ndarray]


def conjugate_gradients(
    A: Operator, precondition: Operator, r: np.ndarray, wanted: float, limit: int, dot: Product
) -> tuple[np.ndarray, int]:
    """Solve A x = r, with A and its preconditioner symmetric.

    Parameters
    ----------
    A, precondition : functions of a vector; what they return may be overwritten by their next call
    r : array
        Right-hand side; becomes the defect.
    wanted : float
        Norm of the defect at which to stop.
    limit : int
        Iterations at most.
    dot : function of two vectors

    Returns
    -------
    x : array
    count : int

    Examples
    --------
    >>> x, count = conjugate_gradients(lambda v: 2 * v, lambda v: v, np.ones(3), 1e-12, 5, np.dot)
    >>> x, count
    (array([0.5, 0.5, 0.5]), 1)
    """
    x, direction, before, count = np.zeros_like(r), np.zeros_like(r), 1.0, 0
    while count < limit:
        z = precondition(r)
        count += 1
        power = dot(r, z)
        if power <= 0.0:  # nothing is missing
            break
        direction *= power / before
        direction += z
        before = power
        product = A(direction)
        alpha = power / dot(direction, product)
        x += alpha * direction
        r -= alpha * product
        if np.sqrt(dot(r, r)) <= wanted:
            break
    return x, count


def flexible_gmres(
    A: Operator, precondition: Operator, r: np.ndarray, wanted: float, limit: int, dots: Products
) -> tuple[np.ndarray, int]:
    """Solve A x = r; arguments and result as of `conjugate_gradients` (Saad 1993).

    By classical Gram-Schmidt, two sums over ranks a step: the bases are too short to lose much by it.

    Parameters
    ----------
    dots : function of a list of vectors and another vector, that returns their inner products

    Examples
    --------
    >>> turn, dots = np.array([[1.0, -1.0], [1.0, 1.0]]), lambda V, w: np.array(V) @ w
    >>> x, count = flexible_gmres(lambda v: turn @ v, lambda v: v, np.array([2.0, 0.0]), 1e-12, 5, dots)
    >>> x.round(12), count
    (array([ 1., -1.]), 2)
    """
    size = np.sqrt(dots([r], r)[0])
    if size == 0.0:
        return np.zeros_like(r), 0
    basis, directions = [r / size], []
    H = np.zeros((limit + 1, limit))
    for count in range(1, limit + 1):
        directions.append(precondition(basis[-1]).copy())
        w = A(directions[-1]).copy()
        H[:count, count - 1] = dots(basis, w)
        for h, v in zip(H[:count, count - 1], basis):
            w -= h * v
        H[count, count - 1] = np.sqrt(dots([w], w)[0])
        goal = np.zeros(count + 1)
        goal[0] = size
        y = np.linalg.lstsq(H[: count + 1, :count], goal, rcond=None)[0]
        if np.linalg.norm(H[: count + 1, :count] @ y - goal) <= wanted or H[count, count - 1] == 0.0:
            break
        basis.append(w / H[count, count - 1])
    return np.asarray(sum(a * z for a, z in zip(y, directions))), count


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
