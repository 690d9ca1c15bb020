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

from model.node_loop.block_arithmetic import add_pair, products_2
from model.node_loop.prefetch import AHEAD, prefetch

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
def row_defect_2(A, begin, end, load, u, i, ahead):
    """Return load_i - sum_k A_k u_j(k), over the blocks begin <= k < end, for blocks of two.

    `load`, `u` and the data of A are flat; memory is asked for so many bytes ahead.
    """
    x, y = products_2(A.data, A.indices, begin, end, u, ahead)
    return load[2 * i] - x, load[2 * i + 1] - y


@njit(inline="always")
def row_defect_3(A, begin, end, load, u, i, ahead, backward=False):
    """As `row_defect_2`, for blocks of three; `backward` takes them from the last to the first."""
    r0, r1, r2 = load[3 * i], load[3 * i + 1], load[3 * i + 2]
    s0, s1, s2, t0, t1, t2 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for m in range(end - begin):
        k = end - np.uint64(1) - m if backward else begin + m
        j, a = np.uint64(3) * np.uint64(A.indices[k]), np.uint64(9) * k
        prefetch(A.data, a, ahead)
        x, y, z = u[j], u[j + np.uint64(1)], u[j + np.uint64(2)]
        r0 -= A.data[a] * x
        s0 -= A.data[a + np.uint64(1)] * y
        t0 -= A.data[a + np.uint64(2)] * z
        r1 -= A.data[a + np.uint64(3)] * x
        s1 -= A.data[a + np.uint64(4)] * y
        t1 -= A.data[a + np.uint64(5)] * z
        r2 -= A.data[a + np.uint64(6)] * x
        s2 -= A.data[a + np.uint64(7)] * y
        t2 -= A.data[a + np.uint64(8)] * z
    return r0 + (s0 + t0), r1 + (s1 + t1), r2 + (s2 + t2)


@njit(inline="always")
def row_defect_any(A, begin, end, load, u, i, r):
    """As `row_defect_2`, for blocks of any size; r has room for a row."""
    d = r.size
    for a in range(d):
        s = load[d * i + a]
        for k in range(np.int64(begin), np.int64(end)):
            j = d * np.int64(A.indices[k])
            for b in range(d):
                s -= A.data[(d * k + a) * d + b] * u[j + b]
        r[a] = s
    return r


@njit(inline="always")
def column_defect_2(A, begin, end, x, r):
    """Do r_j(k) -= A_k^T x over the blocks begin <= k < end; for blocks of two, all flat."""
    x0, x1 = x
    for k in range(begin, end):
        j, a = np.uint64(2) * np.uint64(A.indices[k]), np.uint64(4) * k
        r[j] -= A.data[a] * x0 + A.data[a + np.uint64(2)] * x1
        r[j + np.uint64(1)] -= A.data[a + np.uint64(1)] * x0 + A.data[a + np.uint64(3)] * x1


@njit(inline="always")
def column_defect_3(A, begin, end, x, r, ahead):
    """As `column_defect_2`, for blocks of three, more than a line of memory: their ends are asked for."""
    x0, x1, x2 = x
    for k in range(begin, end):
        j, a = np.uint64(3) * np.uint64(A.indices[k]), np.uint64(9) * k
        prefetch(A.data, a + np.uint64(8), ahead)
        r0, r1, r2 = r[j], r[j + np.uint64(1)], r[j + np.uint64(2)]
        r0 -= A.data[a] * x0
        r1 -= A.data[a + np.uint64(1)] * x0
        r2 -= A.data[a + np.uint64(2)] * x0
        r0 -= A.data[a + np.uint64(3)] * x1
        r1 -= A.data[a + np.uint64(4)] * x1
        r2 -= A.data[a + np.uint64(5)] * x1
        r[j] = r0 - A.data[a + np.uint64(6)] * x2
        r[j + np.uint64(1)] = r1 - A.data[a + np.uint64(7)] * x2
        r[j + np.uint64(2)] = r2 - A.data[a + np.uint64(8)] * x2


@njit(inline="always")
def column_defect_any(A, begin, end, x, r):
    """As `column_defect_2`, for blocks of any size."""
    d = x.size
    for k in range(np.int64(begin), np.int64(end)):
        j = d * np.int64(A.indices[k])
        for b in range(d):
            s = 0.0
            for a in range(d):
                s += A.data[(d * k + a) * d + b] * x[a]
            r[j + b] -= s


@njit(inline="always")
def relax(inverse, i, r, u):
    """Do u_i += D_i^-1 r, `inverse` holding all D_i^-1, flat as u."""
    d = len(r)
    for a in range(d):
        s = 0.0
        for b in range(d):
            s += inverse[(d * i + a) * d + b] * r[b]
        u[d * i + a] += s


@njit(inline="always")
def relax_2(inverse, i, r, u):
    """As `relax`, for blocks of two; return the step."""
    x, y = r
    k, at = np.uint64(4) * np.uint64(i), np.uint64(2) * np.uint64(i)
    step = (
        inverse[k] * x + inverse[k + np.uint64(1)] * y,
        inverse[k + np.uint64(2)] * x + inverse[k + np.uint64(3)] * y,
    )
    add_pair(u, at, step)
    return step


@lru_cache
def backward_sweep(size: int) -> Any:
    """Compile a Gauss-Seidel sweep over the block rows from the last to the first.

    u_i += D_i^-1 (load - A u)_i, `inverse` (n, size, size) holding D_i^-1. Rows of blocks of three are read
    from their ends as well: so much memory arrives in time only if it is read one way throughout. Those of
    blocks of two are not: what the row before has just changed is then met late, and awaited less.
    """

    @njit(cache=True, error_model="numpy", fastmath=FUSED)
    def sweep(A, inverse, load, u):
        row, nodes = np.empty(size), A.indptr.size - 1
        A = BlockMatrix(A.indptr, A.indices, flat(A.data))
        inverse, load, u = flat(inverse), flat(load), flat(u)
        for passed in range(nodes):
            i = nodes - 1 - passed
            if size == 2:
                relax_2(inverse, i, row_defect_2(A, A.indptr[i], A.indptr[i + 1], load, u, i, -AHEAD), u)
                continue
            elif size == 3:
                r = row_defect_3(A, A.indptr[i], A.indptr[i + 1], load, u, i, -AHEAD, True)
            else:
                r = row_defect_any(A, A.indptr[i], A.indptr[i + 1], load, u, i, row)
            relax(inverse, i, r, u)

    return sweep


@lru_cache
def backward_sweep_with_defect(size: int) -> Any:
    """Compile `backward_sweep` with the defect that it leaves, for the price of one product.

    A must be symmetric, as for `sweep_from_zero`. What a later row adds to u changes the defects of rows that
    have had their turn: its transpose, met in the same row, tells.
    """

    @njit(cache=True, error_model="numpy", fastmath=FUSED)
    def sweep(A, middle, inverse, load, u, rest):
        row, nodes = np.empty(size), A.indptr.size - 1
        A = BlockMatrix(A.indptr, A.indices, flat(A.data))
        inverse, load, u, rest = flat(inverse), flat(load), flat(u), flat(rest)
        for passed in range(nodes):
            i = nodes - 1 - passed
            begin, end, j = A.indptr[i], A.indptr[i + 1], size * i
            if size == 2:
                r = row_defect_2(A, begin, end, load, u, i, -AHEAD)
                rest[j], rest[j + 1] = r
                column_defect_2(A, middle[i], end, relax_2(inverse, i, r, u), rest)
            elif size == 3:
                x, y, z = u[j], u[j + 1], u[j + 2]
                r = row_defect_3(A, begin, end, load, u, i, -AHEAD, True)
                rest[j], rest[j + 1], rest[j + 2] = r
                relax(inverse, i, r, u)
                change = (u[j] - x, u[j + 1] - y, u[j + 2] - z)
                column_defect_3(A, middle[i], end, change, rest, -AHEAD)
            else:
                before = u[j : j + size].copy()
                r = row_defect_any(A, begin, end, load, u, i, row)
                rest[j : j + size] = r
                relax(inverse, i, r, u)
                column_defect_any(A, middle[i], end, u[j : j + size] - before, rest)

    return sweep


@lru_cache
def sweep_from_zero(size: int) -> Any:
    """Compile a forward sweep for A z = r from z = 0, with its defect, which reads half the matrix.

    A must be symmetric, its rows sorted, with diagonal blocks at the positions `middle` (n,). Going up, only
    what lies left of the diagonal counts; its transpose, met in the same rows, gives the defect.
    """

    @njit(cache=True, error_model="numpy", fastmath=FUSED)
    def sweep(A, middle, inverse, r, z, rest):
        row, nodes = np.empty(size), A.indptr.size - 1
        lead = max(1, 2 * AHEAD * nodes // max(1, A.data.nbytes))  # rows, of which half is read
        A = BlockMatrix(A.indptr, A.indices, flat(A.data))
        inverse, r, z, rest = flat(inverse), flat(r), flat(z), flat(rest)
        z[:] = 0.0
        for i in range(nodes):
            begin, after = A.indptr[i], middle[i] + np.uint64(1)
            ahead = np.int64(A.indptr[min(i + lead, nodes)] - begin) * (8 * size * size)
            if size == 2:
                x = row_defect_2(A, begin, middle[i], r, z, i, ahead)
                rest[2 * i], rest[2 * i + 1] = x
                column_defect_2(A, begin, after, relax_2(inverse, i, x, z), rest)
                continue
            elif size == 3:
                x = row_defect_3(A, begin, middle[i], r, z, i, ahead)
            else:
                x = row_defect_any(A, begin, middle[i], r, z, i, row)
            for a in range(size):
                rest[size * i + a] = x[a]
            relax(inverse, i, x, z)
            if size == 3:
                column_defect_3(A, begin, after, (z[3 * i], z[3 * i + 1], z[3 * i + 2]), rest, ahead)
            else:
                column_defect_any(A, begin, after, z[size * i : size * i + size], rest)

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
        A = BlockMatrix(A.indptr, A.indices, flat(A.data))
        load, u, r = flat(load), flat(u), flat(r)
        for i in range(r.size // size):
            if size == 2:
                x = row_defect_2(A, A.indptr[i], A.indptr[i + 1], load, u, i, AHEAD)
            elif size == 3:
                x = row_defect_3(A, A.indptr[i], A.indptr[i + 1], load, u, i, AHEAD)
            else:
                x = row_defect_any(A, A.indptr[i], A.indptr[i + 1], load, u, i, row)
            for a in range(size):
                r[size * i + a] = x[a]

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
