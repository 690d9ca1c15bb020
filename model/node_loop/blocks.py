"""Node-blocked sparse matrices: the compiled kernels that the contact loop and the corrections share.

A matrix is held as in `scipy.sparse.bsr_array`, one block row a node. Each kernel is compiled once per block
size; unsigned indices spare the test for negative ones.
"""

from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numba import njit
from scipy.sparse import bsr_array

from model.node_loop.block_arithmetic import put, relax, row_defect, subtract_transposed
from model.node_loop.prefetch import AHEAD

# Multiply and add in one, no more: where sums may be reordered the compiler gathers, four times slower.
FUSED = {"contract"}
SINGULAR = 1e-13  # of the largest pivot: what rounding leaves of a block that resists in fewer directions


class BlockMatrix(NamedTuple):
    """A block-sparse matrix as compiled code takes it.

    `indptr` (n + 1,), `indices` (m,), `data` (m, rows, columns).
    """

    indptr: np.ndarray
    indices: np.ndarray
    data: np.ndarray


def block_matrix(A: bsr_array) -> BlockMatrix:
    """Hand a `bsr_array` to compiled code; what has the right type, contiguous, is shared, not copied."""
    return BlockMatrix(
        A.indptr.astype(np.uint64),
        np.asarray(A.indices, dtype=np.int32).view(np.uint32),
        np.ascontiguousarray(A.data, dtype=np.float64),
    )


def node_order(order: Any, nodes: int) -> np.ndarray:
    """The order in which nodes are visited, as compiled code takes it; None is 0, 1, 2, ..."""
    return np.arange(nodes, dtype=np.uint32) if order is None else np.asarray(order, dtype=np.uint32)


@njit(inline="always")
def flat(x):
    """All entries of x in one row: only then does the compiler know their distances in memory."""
    return x.reshape(x.size)


@njit(inline="always")
def column_defect(A, begin, end, x, r, ahead):
    """Do r_j(k) -= A_k^T x over the blocks begin <= k < end, all flat."""
    for k in range(begin, end):
        subtract_transposed(A.data, k, x, r, A.indices[k], ahead)


@lru_cache
def backward_sweep(size: int, with_defect: bool) -> Any:
    """Compile a Gauss-Seidel sweep over the block rows from the last to the first, with the defect it leaves.

    u_i += D_i^-1 (load - A u)_i, `inverse` (n, size, size) holding D_i^-1. Rows of blocks of three are read
    from their ends as well: so much memory arrives in time only if it is read one way throughout. Those of
    blocks of two are not: what the row before has just changed is then met late, and awaited less.

    For the price of one product the defect is written into `rest` (n, size), which else is None. A must then
    be symmetric, as for `sweep_from_zero`: what a later row adds to u changes the defects of rows that have
    had their turn, and its transpose, met in the same row, tells.
    """

    @njit(cache=True, error_model="numpy", fastmath=FUSED)
    def sweep(A, middle, inverse, load, u, rest):
        for i in range(A.indptr.size - 2, -1, -1):
            r = row_defect(A, A.indptr[i], A.indptr[i + 1], load, u, i, -AHEAD, size > 2, size)
            x = relax(inverse, i, r, u)
            if with_defect:
                put(rest, i, r)
                column_defect(A, middle[i], A.indptr[i + 1], x, rest, -AHEAD)

    return sweep


@lru_cache
def sweep_from_zero(size: int) -> Any:
    """Compile a forward sweep for A z = r from z = 0, with its defect, which reads half the matrix.

    A must be symmetric, its rows sorted, with diagonal blocks at the positions `middle` (n,). Going up, only
    what lies left of the diagonal counts; its transpose, met in the same rows, gives the defect.
    """

    @njit(cache=True, error_model="numpy", fastmath=FUSED)
    def sweep(A, middle, inverse, r, z, rest):
        nodes = A.indptr.size - 1
        lead = max(1, 2 * AHEAD * nodes // max(1, A.data.nbytes))  # rows, of which half is read
        z[:] = 0.0
        for i in range(nodes):
            begin, after = A.indptr[i], middle[i] + np.uint64(1)
            ahead = np.int64(A.indptr[min(i + lead, nodes)] - begin) * (8 * size * size)
            x = row_defect(A, begin, middle[i], r, z, i, ahead, False, size)
            put(rest, i, x)
            column_defect(A, begin, after, relax(inverse, i, x, z), rest, ahead)

    return sweep


@njit(cache=True, error_model="numpy")
def diagonal_positions(A):
    """Position (n,) of each row's diagonal block in `A.data`."""
    middle = np.empty(A.indptr.size - 1, dtype=np.uint64)
    for i in range(middle.size):
        for k in range(A.indptr[i], A.indptr[i + 1]):
            if A.indices[k] == i:
                middle[i] = k
    return middle


@lru_cache
def defect(size: int) -> Any:
    """Compile r = load - A u, with r, load and u of shape (n, size)."""

    @njit(cache=True, error_model="numpy", fastmath=FUSED)
    def compute(A, load, u, r):
        for i in range(len(r)):
            put(r, i, row_defect(A, A.indptr[i], A.indptr[i + 1], load, u, i, AHEAD, False, size))

    return compute


@njit(cache=True, error_model="numpy")
def diagonal_blocks(A, rows, diagonal):
    """Copy the diagonal blocks of the given rows into `diagonal` (n, d, d)."""
    for i in rows:
        for k in range(A.indptr[i], A.indptr[i + 1]):
            if A.indices[k] == i:
                for a in range(A.data.shape[1]):
                    for b in range(A.data.shape[2]):
                        diagonal[i, a, b] = A.data[k, a, b]
                break


def generalised_inverses(blocks: np.ndarray, rows: np.ndarray, inverses: np.ndarray) -> None:
    """Write G with B G B = B for the positive semi-definite `blocks` (n, d, d) of the given rows.

    Gauss-Jordan with diagonal pivots, largest first; a pivot below 1e-13 of the largest is a direction in
    which nothing resists, and gets a zero row and column.
    """
    gauss_jordan(blocks.shape[1])(blocks, rows, inverses)


@lru_cache
def gauss_jordan(d: int) -> Any:
    """Compile `generalised_inverses` for blocks of size d."""

    @njit(cache=True, error_model="numpy")
    def invert(blocks, rows, inverses):
        done, G = np.empty(d, dtype=np.bool_), np.empty((d, d))
        for i in rows:
            largest = 0.0
            for a in range(d):
                done[a] = False
                for b in range(d):
                    G[a, b] = blocks[i, a, b]
                largest = max(largest, G[a, a])
            for _ in range(d):
                pivot = -1
                for a in range(d):
                    above = pivot < 0 or G[a, a] > G[pivot, pivot]
                    if not done[a] and G[a, a] > SINGULAR * largest and above:
                        pivot = a
                if pivot < 0:
                    break
                done[pivot] = True
                scale = 1.0 / G[pivot, pivot]
                for a in range(d):
                    if a != pivot:
                        factor = G[a, pivot] * scale
                        for b in range(d):
                            if b != pivot:
                                G[a, b] -= factor * G[pivot, b]
                        G[a, pivot] = -factor
                for b in range(d):
                    G[pivot, b] *= scale
                G[pivot, pivot] = scale
            # directions without a pivot take no part
            for a in range(d):
                for b in range(d):
                    inverses[i, a, b] = G[a, b] if done[a] and done[b] else 0.0

    return invert
