"""Coarse matrices for multigrid.

Prolongations, Galerkin products, and their repair when a few nodes change.

A prolongation P gives the unknowns of a fine node from those of coarse ones: by scalar weights (m,) where
each component is interpolated alike, else by blocks (m, d, c); the coarse matrix is P^T A P. Where contact or
a support holds a node, T P takes the place of its rows P, T the projector onto what is free (Kornhuber 1994;
Graeser and Kornhuber 2009), and only the rows of the coarse matrices that see a changed node are computed
anew.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numba import njit
from scipy.sparse import csr_array

from model.node_loop.block_arithmetic import add_scaled
from model.node_loop.blocks import (
    FUSED,
    BlockMatrix,
    backward_sweep,
    defect,
    diagonal_positions,
    flat,
    generalised_inverses,
    sweep_from_zero,
)
from model.node_loop.prefetch import prefetch
from model.one_rank import ONE_RANK


@dataclass
class Level:
    """One mesh of the hierarchy.

    Its matrix, inverses and positions of the diagonal blocks, and the way to the next coarser mesh, P, and
    back, R = P^T. Nodes that are `held` (N,) move within the ranges of their projectors T (N, d, d), and what
    is missing there counts as their tests L (N, d, d) take it; of others neither is read.
    """

    A: BlockMatrix
    inverse: np.ndarray
    middle: np.ndarray
    P: Any = None
    R: Any = None
    held: Any = None
    T: Any = None
    L: Any = None
    ranks: Any = ONE_RANK

    def __post_init__(self) -> None:
        """Hold nothing, unless told."""
        if self.held is None:
            self.held = np.zeros(len(self.inverse), dtype=bool)
            self.T, self.L = np.zeros(self.inverse.shape), np.zeros(self.inverse.shape)

    def hold(self, nodes: np.ndarray, projectors: np.ndarray, tests: np.ndarray | None = None) -> None:
        """Hold nodes (k,) to the ranges of projectors (k, d, d), which are their tests too unless told."""
        self.held[nodes], self.T[nodes] = True, projectors
        self.L[nodes] = projectors if tests is None else tests

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape (N, d) of fields on this mesh."""
        return self.inverse.shape[:2]

    def sweep_from_zero(self, r: np.ndarray, z: np.ndarray, rest: np.ndarray) -> None:
        """Sweep forwards for A z = r from z = 0, and write what that leaves into `rest`, all (N, d)."""
        sweep_from_zero(r.shape[1])(self.A, self.middle, self.inverse, r, z, rest)

    def sweep_back(self, r: np.ndarray, z: np.ndarray, rest: np.ndarray | None = None) -> None:
        """Sweep backwards for A z = r, and write what that leaves into `rest`, if it is asked for."""
        backward_sweep(r.shape[1], rest is not None)(self.A, self.middle, self.inverse, r, z, rest)

    def missing(self, r: np.ndarray, z: np.ndarray, rest: np.ndarray) -> None:
        """Write r - A z into `rest`."""
        defect(r.shape[1])(self.A, r, z, rest[: len(self.inverse)])


def prolongation(P: Any) -> BlockMatrix:
    """Hand a prolongation to compiled code: scalar weights (N, N_coarse), or a `bsr_array` of blocks."""
    P.sort_indices()
    data = np.ascontiguousarray(P.data, dtype=np.float64)
    return BlockMatrix(P.indptr.astype(np.uint64), P.indices.astype(np.uint32), data)


def transposed(P: BlockMatrix, coarse: int) -> BlockMatrix:
    """The transpose of a prolongation from so many coarse nodes."""
    shape, numbers = (P.indptr.size - 1, coarse), np.arange(P.indices.size)
    entries = csr_array((numbers, P.indices.astype(int), P.indptr.astype(int)), shape=shape).tocsc()
    data = P.data[entries.data]
    data = data if data.ndim == 1 else np.ascontiguousarray(data.swapaxes(1, 2))
    return BlockMatrix(entries.indptr.astype(np.uint64), entries.indices.astype(np.uint32), data)


def interpolate(W: BlockMatrix, x: np.ndarray, y: np.ndarray) -> None:
    """Do y += W x, for a prolongation W or its transpose."""
    interpolation(y.shape[1], x.shape[1], W.data.ndim == 1)(W, x, y)


@lru_cache
def interpolation(d: int, c: int, scalar: bool) -> Any:
    """Compile `interpolate` for blocks (d, c) or scalar weights; sums stay in registers, not in arrays."""

    @njit(cache=True, error_model="numpy", fastmath=FUSED)
    def add(W, x, y):
        weights, x = flat(W.data), flat(x)
        for i in range(W.indptr.size - 1):
            for a in range(d):
                s = y[i, a]
                for k in range(W.indptr[i], W.indptr[i + 1]):
                    j = np.uint64(W.indices[k]) * np.uint64(c)
                    if scalar:
                        s += weights[k] * x[j + np.uint64(a)]
                    else:
                        for b in range(c):
                            s += (
                                weights[(k * np.uint64(d) + np.uint64(a)) * np.uint64(c) + np.uint64(b)]
                                * x[j + np.uint64(b)]
                            )
                y[i, a] = s

    return add


@njit(inline="always")
def add_product(X, x, Y, y, Z, z, rows, inner, columns):
    """Do X_x += Y_y Z_z, for blocks (rows, inner) and (inner, columns) that begin at these entries."""
    for a in range(np.uint64(rows)):
        for t in range(np.uint64(inner)):
            factor = Y[y + a * np.uint64(inner) + t]
            add_scaled(X, x + a * np.uint64(columns), factor, Z, z + t * np.uint64(columns), columns)


@njit(inline="always")
def numbered(place, name, j, found):
    """Return the number of j, from 1 on in the order of first use, and how many have been found."""
    new = place[j] == 0
    found += np.uint64(new)
    number = found if new else np.uint64(place[j])
    place[j], name[number] = number, j
    return number, found


@lru_cache
def galerkin_rows(d: int, c: int, scalar: bool) -> Any:
    """Compile rows of P^T A P, for blocks of size d on the fine and c on the coarse mesh.

    By scalar weights or by blocks. Of a new matrix (`fresh`) columns are found as well; its arrays grow.
    """
    zero, one, eight = np.uint64(0), np.uint64(1), np.uint64(8)
    of_fine, of_coarse = d * d, c * c  # entries of blocks
    fine, mixed, small = np.uint64(of_fine), np.uint64(c * d), np.uint64(of_coarse)

    @njit(cache=True, error_model="numpy", fastmath=FUSED)
    def compute(A, P, R, rows, coarse, held, L, T, fresh):
        """Row I of P^T A first, by columns of A; then times P, each of them once."""
        indices, product, values = coarse.indices, flat(coarse.data), flat(A.data)
        weights, back, L, T = flat(P.data), flat(R.data), flat(L), flat(T)
        most, widest = 0, 0
        for I in rows:
            length = 0
            for q in range(R.indptr[I], R.indptr[I + 1]):
                length += np.int64(A.indptr[R.indices[q] + 1] - A.indptr[R.indices[q]])
            most = max(most, length)
        for j in range(P.indptr.size - 1):
            widest = max(widest, np.int64(P.indptr[j + 1] - P.indptr[j]))
        coarse_nodes = R.indptr.size - 1
        # by numbers from 1 on, in the order of their first use: columns of P^T A, and of P^T A P
        place, column = np.zeros(held.size, dtype=np.uint32), np.zeros(most + 1, dtype=np.uint32)
        X, Y = np.zeros((most + 1) * c * d), np.zeros((min(most * widest, coarse_nodes) + 1) * c * c)
        coarse_place, name = np.zeros(coarse_nodes, np.uint32), np.zeros(coarse_nodes + 1, np.uint32)
        block = np.empty(c * d)
        for I in rows:
            columns, found = zero, zero
            for q in range(R.indptr[I], R.indptr[I + 1]):
                i = np.uint64(R.indices[q])
                following = R.indices[min(q + one, R.indptr[I + 1] - one)]
                ahead = np.int64((A.indptr[following] - A.indptr[i]) * fine * eight)
                if held[i]:
                    block[:] = 0.0
                    if scalar:
                        add_scaled(block, zero, back[q], L, i * fine, of_fine)
                    else:
                        add_product(block, zero, back, q * mixed, L, i * fine, c, d, d)
                for k in range(A.indptr[i], A.indptr[i + 1]):
                    prefetch(values, k * fine, ahead)
                    number, columns = numbered(place, column, A.indices[k], columns)
                    if held[i]:
                        add_product(X, number * mixed, block, zero, values, k * fine, c, d, d)
                    elif scalar:
                        add_scaled(X, number * mixed, back[q], values, k * fine, of_fine)
                    else:
                        add_product(X, number * mixed, back, q * mixed, values, k * fine, c, d, d)
            for n in range(one, columns + one):
                j, x = np.uint64(column[n]), n * mixed
                place[j] = 0
                if held[j]:
                    block[:] = 0.0
                    add_product(block, zero, X, x, T, j * fine, c, d, d)
                    X[x : x + mixed] = block
                for m in range(P.indptr[j], P.indptr[j + one]):
                    number, found = numbered(coarse_place, name, P.indices[m], found)
                    if scalar:
                        add_scaled(Y, number * small, weights[m], X, x, of_coarse)
                    else:
                        add_product(Y, number * small, X, x, weights, m * mixed, c, d, c)
                for t in range(mixed):
                    X[x + t] = 0.0
            begin = coarse.indptr[I]
            if fresh:
                end = coarse.indptr[I + 1] = begin + found
                while end > indices.size:
                    indices = np.concatenate((indices, np.empty_like(indices)))
                    product = np.concatenate((product, np.empty_like(product)))
                for n in range(found):  # insertion sort
                    J, k = name[one + n], begin + n
                    while k > begin and indices[k - one] > J:
                        indices[k] = indices[k - one]
                        k -= one
                    indices[k] = J
            for k in range(begin, coarse.indptr[I + 1]):
                y, z = np.uint64(coarse_place[indices[k]]) * small, k * small
                for t in range(small):
                    product[z + t], Y[y + t] = Y[y + t], 0.0
            for n in range(one, found + one):
                coarse_place[name[n]] = 0
        return indices, product

    return compute


@njit(cache=True, error_model="numpy")
def columns_of(M, rows, columns):
    """The distinct columns of the given rows of M, which has that many `columns`."""
    seen = np.zeros(columns, dtype=np.bool_)
    for i in rows:
        for k in range(M.indptr[i], M.indptr[i + 1]):
            seen[M.indices[k]] = True
    return np.flatnonzero(seen)


def galerkin_product(A: BlockMatrix, P: BlockMatrix, R: BlockMatrix, *held: Any) -> BlockMatrix:
    """Return P^T A P, with nodes that are `held`, their tests and projectors."""
    N, d, scalar = R.indptr.size - 1, A.data.shape[1], P.data.ndim == 1
    c = d if scalar else P.data.shape[2]
    room = max(A.indices.size // 2, 1)  # nested meshes need less
    indptr = np.zeros(N + 1, dtype=np.uint64)
    rows = BlockMatrix(indptr, np.empty(room, dtype=np.uint32), np.empty((room, c, c)))
    indices, data = galerkin_rows(d, c, scalar)(A, P, R, np.arange(N), rows, *held, True)
    count = int(indptr[-1])
    return BlockMatrix(indptr, indices[:count], data.reshape(-1, c, c)[:count])


def coarsen(level: Level, P: BlockMatrix, coarse_nodes: int) -> Level:
    """Set the way from `level` to the next coarser one, and return that, with the matrix P^T A P."""
    level.P, level.R = P, transposed(P, coarse_nodes)
    A = galerkin_product(level.A, P, level.R, level.held, level.L, level.T)
    coarse = Level(A, np.zeros((coarse_nodes, *A.data.shape[1:])), diagonal_positions(A))
    invert_diagonal(coarse, np.arange(coarse_nodes))
    return coarse


def hierarchy(finest: Level, prolongations: Sequence[Any]) -> list[Level]:
    """The finest mesh and all coarser ones, by prolongations (N, N_coarse), or `bsr_array`s of blocks."""
    levels = [finest]
    for P in prolongations:
        columns = getattr(P, "blocksize", (1, 1))[1]
        levels.append(coarsen(levels[-1], prolongation(P), P.shape[1] // columns))
    return levels


def multiply(fine: Any, product: BlockMatrix, rows: np.ndarray, tests: np.ndarray) -> None:
    """Compute the given block rows of P^T A P anew, P^T A P having the entries that it had."""
    kernel = galerkin_rows(fine.A.data.shape[1], product.data.shape[1], fine.P.data.ndim == 1)
    kernel(fine.A, fine.P, fine.R, rows, product, fine.held, tests, fine.T, False)


def recompute(fine: Level, coarse: Level, rows: np.ndarray) -> None:
    """Compute the given block rows of the coarse matrix from the fine level, and invert their diagonals."""
    multiply(fine, coarse.A, rows, fine.L)
    invert_diagonal(coarse, rows)


def invert_diagonal(level: Level, rows: np.ndarray) -> None:
    """Invert the diagonal blocks of the given rows."""
    level.inverse[rows] = level.A.data[level.middle[rows]]
    generalised_inverses(level.inverse, rows, level.inverse)
