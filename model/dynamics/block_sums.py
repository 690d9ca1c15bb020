"""Sums of large block-sparse matrices, without the copies that scipy makes on the way."""

import numpy as np
from scipy.sparse import bsr_array

PIECE = 1 << 16  # blocks at a time


def weighted_sum(*terms: tuple[float, bsr_array]) -> bsr_array:
    """Return the sum of factor x matrix; None among the matrices is left out.

    Matrices of one body have one pattern, in which the values are added. (scipy's sum keeps twice the
    memory of its result.)

    Examples
    --------
    >>> A = bsr_array(np.diag([1.0, 2.0]), blocksize=(1, 1))
    >>> weighted_sum((2.0, A), (0.5, A), (1.0, None)).toarray().tolist()
    [[2.5, 0.0], [0.0, 5.0]]
    """
    (factor, first), *others = [(factor, A) for factor, A in terms if A is not None]
    total = bsr_array((factor * first.data, first.indices, first.indptr), shape=first.shape)
    for factor, A in others:
        if not (np.array_equal(A.indptr, first.indptr) and np.array_equal(A.indices, first.indices)):
            return bsr_array(sum(factor * A for factor, A in terms if A is not None))
        for begin in range(0, len(A.data), PIECE):
            total.data[begin : begin + PIECE] += factor * A.data[begin : begin + PIECE]
    return total


def scaled_by_nodes(A: bsr_array, s: np.ndarray) -> bsr_array:
    """Return S A S with S diagonal, s (N,) of it for each node."""
    rows = np.repeat(np.arange(s.size), np.diff(A.indptr))
    return bsr_array(((s[rows] * s[A.indices])[:, None, None] * A.data, A.indices, A.indptr), shape=A.shape)
