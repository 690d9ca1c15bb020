"""Node-blocked sparse matrices: the compiled kernels that the contact loop and the corrections share.

A matrix is held as in `scipy.sparse.bsr_array`, one block row a node. Each kernel is compiled once per block
size, so that the innermost loops are unrolled; rows of two and three unknowns are written out, with sums
split (a Gauss-Seidel row is one long chain of additions) and unsigned indices (which spares the test for
negative ones).
"""

from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numba import njit
from scipy.sparse import bsr_array

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
    """Hand a `bsr_array` to compiled code; the values are shared, not copied, where they are C-contiguous."""
    return BlockMatrix(
        A.indptr.astype(np.uint64),
        A.indices.astype(np.uint32),
        np.ascontiguousarray(A.data, dtype=np.float64),
    )


def node_order(order: Any, nodes: int) -> np.ndarray:
    """The order in which nodes are visited, as compiled code takes it; None is 0, 1, 2, ..."""
    return np.arange(nodes, dtype=np.uint32) if order is None else np.asarray(order, dtype=np.uint32)


@njit(inline="always")
def row_defect_2(A, begin, end, load, u, i, r, backward=False):
    """Write load_i - sum_k A_k u_j(k), over the blocks begin <= k < end, into r; for blocks of two.

    `backward` takes the blocks from the last to the first.
    """
    r0, r1 = load[i, 0], load[i, 1]
    s0, s1 = 0.0, 0.0
    for m in range(end - begin):
        k = end - np.uint64(1) - m if backward else begin + m
        j = A.indices[k]
        x, y = u[j, 0], u[j, 1]
        r0 -= A.data[k, 0, 0] * x
        s0 -= A.data[k, 0, 1] * y
        r1 -= A.data[k, 1, 0] * x
        s1 -= A.data[k, 1, 1] * y
    r[0], r[1] = r0 + s0, r1 + s1


@njit(inline="always")
def row_defect_3(A, begin, end, load, u, i, r, backward=False):
    """As `row_defect_2`, for blocks of three."""
    r0, r1, r2 = load[i, 0], load[i, 1], load[i, 2]
    for m in range(end - begin):
        k = end - np.uint64(1) - m if backward else begin + m
        j = A.indices[k]
        x, y, z = u[j, 0], u[j, 1], u[j, 2]
        r0 -= A.data[k, 0, 0] * x + A.data[k, 0, 1] * y + A.data[k, 0, 2] * z
        r1 -= A.data[k, 1, 0] * x + A.data[k, 1, 1] * y + A.data[k, 1, 2] * z
        r2 -= A.data[k, 2, 0] * x + A.data[k, 2, 1] * y + A.data[k, 2, 2] * z
    r[0], r[1], r[2] = r0, r1, r2


@njit(inline="always")
def row_defect_any(A, begin, end, load, u, i, r):
    """As `row_defect_2`, for blocks of any size."""
    for a in range(r.size):
        s = load[i, a]
        for k in range(begin, end):
            j = A.indices[k]
            for b in range(r.size):
                s -= A.data[k, a, b] * u[j, b]
        r[a] = s


@njit(inline="always")
def column_defect_2(A, begin, end, z, i, r):
    """Do r_j(k) -= A_k^T z_i over the blocks begin <= k < end; for blocks of two."""
    x, y = z[i, 0], z[i, 1]
    for k in range(begin, end):
        j = A.indices[k]
        r[j, 0] -= A.data[k, 0, 0] * x + A.data[k, 1, 0] * y
        r[j, 1] -= A.data[k, 0, 1] * x + A.data[k, 1, 1] * y


@njit(inline="always")
def column_defect_3(A, begin, end, z, i, r):
    """As `column_defect_2`, for blocks of three."""
    x0, x1, x2 = z[i, 0], z[i, 1], z[i, 2]
    for k in range(begin, end):
        j = A.indices[k]
        r[j, 0] -= A.data[k, 0, 0] * x0 + A.data[k, 1, 0] * x1 + A.data[k, 2, 0] * x2
        r[j, 1] -= A.data[k, 0, 1] * x0 + A.data[k, 1, 1] * x1 + A.data[k, 2, 1] * x2
        r[j, 2] -= A.data[k, 0, 2] * x0 + A.data[k, 1, 2] * x1 + A.data[k, 2, 2] * x2


@njit(inline="always")
def column_defect_any(A, begin, end, z, i, r):
    """As `column_defect_2`, for blocks of any size."""
    for k in range(begin, end):
        for a in range(z.shape[1]):
            s = 0.0
            for b in range(z.shape[1]):
                s += A.data[k, b, a] * z[i, b]
            r[A.indices[k], a] -= s


@njit(inline="always")
def relax(inverse, i, r, u):
    """Do u_i += D_i^-1 r, `inverse` (n, d, d) holding D_i^-1."""
    for a in range(r.size):
        s = 0.0
        for b in range(r.size):
            s += inverse[i, a, b] * r[b]
        u[i, a] += s


@lru_cache
def backward_sweep(size: int) -> Any:
    """Compile a Gauss-Seidel sweep over the block rows from the last to the first.

    u_i += D_i^-1 (load - A u)_i, `inverse` (n, size, size) holding D_i^-1. Each row is read from its end as
    well: memory that is read one way throughout arrives in time.
    """

    @njit(cache=True, error_model="numpy", fastmath=FUSED)
    def sweep(A, inverse, load, u):
        r, nodes = np.empty(size), A.indptr.size - 1
        for passed in range(nodes):
            i = nodes - 1 - passed
            if size == 2:
                row_defect_2(A, A.indptr[i], A.indptr[i + 1], load, u, i, r, True)
            elif size == 3:
                row_defect_3(A, A.indptr[i], A.indptr[i + 1], load, u, i, r, True)
            else:
                row_defect_any(A, A.indptr[i], A.indptr[i + 1], load, u, i, r)
            relax(inverse, i, r, u)

    return sweep


@lru_cache
def sweep_from_zero(size: int) -> Any:
    """Compile a forward sweep for A z = r from z = 0, with its defect, for the price of one product.

    A must be symmetric, its rows sorted, with diagonal blocks at the positions `middle` (n,). Going up, only
    what lies left of the diagonal counts; its transpose, met in the same rows, gives the defect. Rows are
    read whole all the same: memory read in pieces comes five times slower than in one stream.
    """

    @njit(cache=True, error_model="numpy", fastmath=FUSED)
    def sweep(A, middle, inverse, r, z, rest):
        row = np.empty(size)
        z[:] = 0.0
        for i in range(A.indptr.size - 1):
            begin, after = A.indptr[i], middle[i] + np.uint64(1)
            if size == 2:
                row_defect_2(A, begin, A.indptr[i + 1], r, z, i, row)
            elif size == 3:
                row_defect_3(A, begin, A.indptr[i + 1], r, z, i, row)
            else:
                row_defect_any(A, begin, A.indptr[i + 1], r, z, i, row)
            for a in range(size):
                rest[i, a] = row[a]
            relax(inverse, i, row, z)
            if size == 2:
                column_defect_2(A, begin, after, z, i, rest)
            elif size == 3:
                column_defect_3(A, begin, after, z, i, rest)
            else:
                column_defect_any(A, begin, after, z, i, rest)

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
        row = np.empty(size)
        for i in range(r.shape[0]):
            if size == 2:
                row_defect_2(A, A.indptr[i], A.indptr[i + 1], load, u, i, row)
            elif size == 3:
                row_defect_3(A, A.indptr[i], A.indptr[i + 1], load, u, i, row)
            else:
                row_defect_any(A, A.indptr[i], A.indptr[i + 1], load, u, i, row)
            for a in range(size):
                r[i, a] = row[a]

    return compute


@njit(cache=True, error_model="numpy")
def diagonal_blocks(A, rows, diagonal):
    """Copy the diagonal blocks of the given rows into `diagonal` (n, d, d)."""
    for i in rows:
        for k in range(A.indptr[i], A.indptr[i + 1]):
            if A.indices[k] == i:
                diagonal[i] = A.data[k]


@njit(cache=True, error_model="numpy")
def generalised_inverses(blocks, rows, inverses):
    """Write G with B G B = B for the positive semi-definite `blocks` (n, d, d) of the given rows.

    Gauss-Jordan with diagonal pivots, largest first; a pivot below 1e-13 of the largest is a direction in
    which nothing resists, and gets a zero row and column.
    """
    d = blocks.shape[1]
    done = np.empty(d, dtype=np.bool_)
    for i in rows:
        G = inverses[i]
        G[:] = blocks[i]
        largest = 0.0
        for a in range(d):
            done[a] = False
            largest = max(largest, G[a, a])
        for _ in range(d):
            pivot = -1
            for a in range(d):
                if not done[a] and G[a, a] > SINGULAR * largest and (pivot < 0 or G[a, a] > G[pivot, pivot]):
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
                if not (done[a] and done[b]):
                    G[a, b] = 0.0
