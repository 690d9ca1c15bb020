"""Coarse matrices for multigrid.

Prolongations, Galerkin products, and their repair when a few nodes change.

A prolongation gives the unknowns of a fine node from those of coarse ones: by scalar weights (m,) where each
component is interpolated alike, else by blocks (m, d, c); the coarse matrix is P^T A P. Where contact or a
support holds a node, T P takes the place of its rows P, T the projector onto what is free (Kornhuber 1994;
Graeser and Kornhuber 2009), and only the rows of the coarse matrices that see a changed node are computed
anew.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numba import njit
from scipy.sparse import csr_array

from model.node_loop.block_arithmetic import add_scaled
from model.node_loop.blocks import (
    FUSED,
    BlockMatrix,
    diagonal_positions,
    flat,
    generalised_inverses,
)
from model.node_loop.prefetch import prefetch


class Children(NamedTuple):
    """The transpose of a prolongation.

    Fine rows `row` and positions `entry` in P.data, by coarse node through `indptr`.
    """

    indptr: np.ndarray
    row: np.ndarray
    entry: np.ndarray


@dataclass
class Level:
    """One mesh of the hierarchy.

    Its matrix, inverses and positions of the diagonal blocks, and the way to the next coarser mesh. Nodes
    that are `held` (N,) move within the ranges of their projectors T (N, d, d), and what is missing there
    counts as their tests L (N, d, d) take it; of others neither is read.
    """

    A: BlockMatrix
    inverse: np.ndarray
    middle: np.ndarray
    P: Any = None
    children: Any = None
    transfers: Any = None
    held: Any = None
    T: Any = None
    L: Any = None

    def __post_init__(self) -> None:
        """Hold nothing, unless told."""
        if self.held is None:
            self.held = np.zeros(len(self.inverse), dtype=bool)
            self.T, self.L = np.zeros(self.inverse.shape), np.zeros(self.inverse.shape)

    def hold(self, nodes: np.ndarray, projectors: np.ndarray, tests: np.ndarray | None = None) -> None:
        """Hold nodes (k,) to the ranges of projectors (k, d, d), which are their tests too unless told."""
        self.held[nodes], self.T[nodes] = True, projectors
        self.L[nodes] = projectors if tests is None else tests


def nodal_prolongation(P: Any) -> BlockMatrix:
    """Take scalar weights (N, N_coarse): each component is interpolated alike."""
    P = csr_array(P)
    P.sort_indices()
    return BlockMatrix(P.indptr.astype(np.uint64), P.indices.astype(np.uint32), P.data.astype(np.float64))


@njit(cache=True, error_model="numpy")
def transposed(P, coarse):
    """Sort the entries of P by column, of which there are `coarse`."""
    indptr = np.zeros(coarse + 1, dtype=np.uint64)
    for J in P.indices:
        indptr[J + 1] += np.uint64(1)
    for J in range(coarse):
        indptr[J + 1] += indptr[J]
    row, entry, free = np.empty_like(P.indices), np.empty_like(P.indices), indptr[:-1].copy()
    for i in range(P.indptr.size - 1):
        for e in range(P.indptr[i], P.indptr[i + 1]):
            J = P.indices[e]
            row[free[J]], entry[free[J]] = i, e
            free[J] += np.uint64(1)
    return Children(indptr, row, entry)


class Transfers(NamedTuple):
    """Compiled for blocks (d, c): Galerkin products row by row, r_coarse = P^T r, and u += P u_coarse."""

    galerkin_rows: Any
    restrict: Any
    prolong: Any


@lru_cache
def transfers(d: int, c: int, scalar: bool) -> Transfers:
    """Compile the transfers between blocks of size d on the fine and c on the coarse mesh.

    By scalar weights or by blocks.
    """
    zero, one, eight = np.uint64(0), np.uint64(1), np.uint64(8)
    of_fine, of_coarse = d * d, c * c  # entries of blocks
    fine, mixed, small = np.uint64(of_fine), np.uint64(c * d), np.uint64(of_coarse)

    @njit(cache=True, error_model="numpy", fastmath=FUSED)
    def galerkin_rows(A, P, children, rows, coarse, held, L, T, fresh):
        """Row I of P^T A first, by columns of A; then times P, each of them once."""
        indices, values, weights, product = coarse.indices, flat(A.data), flat(P.data), flat(coarse.data)
        most, widest = 0, 0
        for I in rows:
            length = 0
            for q in range(children.indptr[I], children.indptr[I + 1]):
                i = children.row[q]
                length += np.int64(A.indptr[i + 1] - A.indptr[i])
            most = max(most, length)
        for j in range(P.indptr.size - 1):
            widest = max(widest, np.int64(P.indptr[j + 1] - P.indptr[j]))
        coarse_nodes = children.indptr.size - 1
        # by numbers from 1 on, in the order of their first use: columns of P^T A, and of P^T A P
        place, column = np.zeros(held.size, dtype=np.uint32), np.zeros(most + 1, dtype=np.uint32)
        X, Y = np.zeros((most + 1) * c * d), np.zeros((min(most * widest, coarse_nodes) + 1) * c * c)
        coarse_place, name = np.zeros(coarse_nodes, np.uint32), np.zeros(coarse_nodes + 1, np.uint32)
        block, turned = np.empty(d * d), np.empty(c * d)
        for I in rows:
            found = zero
            for q in range(children.indptr[I], children.indptr[I + 1]):
                i, e = children.row[q], np.uint64(children.entry[q])
                following = children.row[min(q + one, children.indptr[I + 1] - one)]
                ahead = np.int64((A.indptr[following] - A.indptr[i]) * fine * eight)
                for k in range(A.indptr[i], A.indptr[i + 1]):
                    v = k * fine
                    prefetch(values, v, ahead)
                    j = A.indices[k]
                    new = place[j] == 0
                    found += np.uint64(new)
                    number = found if new else np.uint64(place[j])
                    place[j], column[number] = number, j
                    x = number * mixed
                    if scalar and not held[i]:
                        add_scaled(X, x, weights[e], values, v, of_fine)
                        continue
                    for a in range(d):
                        for b in range(d):
                            s = values[v + np.uint64(a * d + b)]
                            if held[i]:
                                s = 0.0
                                for t in range(d):
                                    s += L[i, a, t] * values[v + np.uint64(t * d + b)]
                            block[a * d + b] = s
                    for a in range(c):
                        for b in range(d):
                            at = x + np.uint64(a * d + b)
                            if scalar:
                                X[at] += weights[e] * block[a * d + b]
                            else:
                                for t in range(d):
                                    X[at] += weights[e * mixed + np.uint64(t * c + a)] * block[t * d + b]
            columns, found = found, zero
            for n in range(one, columns + one):
                j, x = column[n], n * mixed
                place[j] = 0
                if held[j]:
                    for a in range(c):
                        for b in range(d):
                            turned[a * d + b] = 0.0
                            for t in range(d):
                                turned[a * d + b] += X[x + np.uint64(a * d + t)] * T[j, t, b]
                    for t in range(mixed):
                        X[x + t] = turned[t]
                for m in range(P.indptr[j], P.indptr[j + 1]):
                    J = P.indices[m]
                    new = coarse_place[J] == 0
                    found += np.uint64(new)
                    number = found if new else np.uint64(coarse_place[J])
                    coarse_place[J], name[number] = number, J
                    y = number * small
                    if scalar:
                        add_scaled(Y, y, weights[m], X, x, of_coarse)
                        continue
                    for a in range(c):
                        for b in range(c):
                            for t in range(d):
                                Y[y + np.uint64(a * c + b)] += (
                                    X[x + np.uint64(a * d + t)] * weights[m * mixed + np.uint64(t * c + b)]
                                )
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
                    product[z + t] = Y[y + t]
                    Y[y + t] = 0.0
            for n in range(one, found + one):
                coarse_place[name[n]] = 0
        return indices, product

    # sums stay in registers, not in arrays
    @njit(cache=True, error_model="numpy", fastmath=FUSED)
    def restrict(P, children, r, coarse_r):
        weights, r, coarse_r = flat(P.data), flat(r), flat(coarse_r)
        for I in range(children.indptr.size - 1):
            begin, end = children.indptr[I], children.indptr[I + 1]
            if scalar and d == 3:
                x, y, z = 0.0, 0.0, 0.0
                for q in range(begin, end):
                    i, w = np.uint64(children.row[q]) * np.uint64(d), weights[children.entry[q]]
                    x += w * r[i]
                    y += w * r[i + one]
                    z += w * r[i + one + one]
                coarse_r[3 * I], coarse_r[3 * I + 1], coarse_r[3 * I + 2] = x, y, z
                continue
            for a in range(c):
                s = 0.0
                for q in range(begin, end):
                    i, e = np.uint64(children.row[q]) * np.uint64(d), np.uint64(children.entry[q])
                    if scalar:
                        s += weights[e] * r[i + np.uint64(a)]
                    else:
                        for t in range(d):
                            s += weights[e * mixed + np.uint64(t * c + a)] * r[i + np.uint64(t)]
                coarse_r[I * c + a] = s

    @njit(cache=True, error_model="numpy", fastmath=FUSED)
    def prolong(P, coarse_u, u):
        weights, coarse_u = flat(P.data), flat(coarse_u)
        for i in range(u.shape[0]):
            for t in range(d):
                s = u[i, t]
                for m in range(P.indptr[i], P.indptr[i + 1]):
                    I = np.uint64(P.indices[m]) * np.uint64(c)
                    if scalar:
                        s += weights[m] * coarse_u[I + np.uint64(t)]
                    else:
                        for a in range(c):
                            s += weights[m * mixed + np.uint64(t * c + a)] * coarse_u[I + np.uint64(a)]
                u[i, t] = s

    return Transfers(galerkin_rows, restrict, prolong)


@njit(cache=True, error_model="numpy")
def columns_of(M, rows, columns):
    """The distinct columns of the given rows of M, which has that many `columns`."""
    seen = np.zeros(columns, dtype=np.bool_)
    for i in rows:
        for k in range(M.indptr[i], M.indptr[i + 1]):
            seen[M.indices[k]] = True
    return np.flatnonzero(seen)


def galerkin_product(kernels: Transfers, A: BlockMatrix, P: BlockMatrix, children: Any, *held: Any) -> Any:
    """Return P^T A P, as `BlockMatrix`, with the tests and projectors of nodes that are `held`."""
    N, c = children.indptr.size - 1, P.data.shape[2] if P.data.ndim == 3 else A.data.shape[1]
    room = max(A.indices.size // 2, 1)  # nested meshes need less
    indptr = np.zeros(N + 1, dtype=np.uint64)
    rows = BlockMatrix(indptr, np.empty(room, dtype=np.uint32), np.empty((room, c, c)))
    indices, data = kernels.galerkin_rows(A, P, children, np.arange(N), rows, *held, True)
    count = int(indptr[-1])
    return BlockMatrix(indptr, indices[:count], data.reshape(-1, c, c)[:count])


def coarsen(level: Level, P: BlockMatrix, coarse_nodes: int) -> Level:
    """Set the way from `level` to the next coarser one, and return that, with the matrix P^T A P."""
    level.P, level.children = P, transposed(P, coarse_nodes)
    d, scalar = level.inverse.shape[1], P.data.ndim == 1
    c = d if scalar else P.data.shape[2]
    level.transfers = transfers(d, c, scalar)
    A = galerkin_product(level.transfers, level.A, P, level.children, level.held, level.L, level.T)
    coarse = Level(A, np.zeros((coarse_nodes, c, c)), diagonal_positions(A))
    invert_diagonal(coarse, np.arange(coarse_nodes))
    return coarse


def recompute(fine: Level, coarse: Level, rows: np.ndarray) -> None:
    """Compute the given block rows of the coarse matrix from the fine level, and invert their diagonals."""
    held = fine.held, fine.L, fine.T
    fine.transfers.galerkin_rows(fine.A, fine.P, fine.children, rows, coarse.A, *held, False)
    invert_diagonal(coarse, rows)


def invert_diagonal(level: Level, rows: np.ndarray) -> None:
    """Invert the diagonal blocks of the given rows."""
    level.inverse[rows] = level.A.data[level.middle[rows]]
    generalised_inverses(level.inverse, rows, level.inverse)
