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
    that are `held` (N,) move within the ranges of their projectors T (N, d, d), of which others are not read.
    """

    A: BlockMatrix
    inverse: np.ndarray
    middle: np.ndarray
    P: Any = None
    children: Any = None
    transfers: Any = None
    held: Any = None
    T: Any = None

    def __post_init__(self) -> None:
        """Hold nothing, unless told."""
        if self.held is None:
            self.held, self.T = np.zeros(len(self.inverse), dtype=bool), np.zeros(self.inverse.shape)

    def hold(self, nodes: np.ndarray, projectors: np.ndarray) -> None:
        """Hold nodes (k,) to the ranges of projectors (k, d, d)."""
        self.held[nodes], self.T[nodes] = True, projectors

    def project(self, x: np.ndarray, nodes: np.ndarray) -> None:
        """Leave of x (N, d), in place, what some held nodes (k,) are free to do."""
        x[nodes] = np.einsum("kab,kb->ka", self.T[nodes], x[nodes])


def nodal_prolongation(P: Any) -> BlockMatrix:
    """Take scalar weights (N, N_coarse): each component is interpolated alike."""
    P = csr_array(P)
    P.sort_indices()
    return BlockMatrix(P.indptr.astype(np.uint64), P.indices.astype(np.uint32), P.data.astype(np.float64))


def transposed(P: BlockMatrix, coarse: int) -> Children:
    """Sort the entries of P by column."""
    entries = np.arange(P.indices.size)
    M = csr_array(
        (entries, P.indices.astype(np.int64), P.indptr.astype(np.int64)), shape=(P.indptr.size - 1, coarse)
    )
    M = M.tocsc()
    return Children(M.indptr.astype(np.uint64), M.indices.astype(np.uint32), M.data.astype(np.uint64))


@njit(cache=True, error_model="numpy")
def galerkin_pattern(A, P, children):
    """Row pointers and sorted columns of P^T A P."""
    coarse = children.indptr.size - 1
    indptr, indices = np.zeros(coarse + 1, dtype=np.uint64), np.empty(A.indices.size, dtype=np.uint32)
    fine_seen, seen = np.zeros(P.indptr.size - 1, dtype=np.int64), np.zeros(coarse, dtype=np.int64)
    end = 0
    for I in range(coarse):
        for q in range(children.indptr[I], children.indptr[I + 1]):
            i = children.row[q]
            for k in range(A.indptr[i], A.indptr[i + 1]):
                j = A.indices[k]
                if fine_seen[j] == I + 1:
                    continue
                fine_seen[j] = I + 1
                for m in range(P.indptr[j], P.indptr[j + 1]):
                    J = P.indices[m]
                    if seen[J] <= I:
                        seen[J] = I + 1
                        if end == indices.size:
                            indices = np.concatenate((indices, np.empty_like(indices)))
                        indices[end] = J
                        end += 1
        indptr[I + 1] = end
        indices[indptr[I] : indptr[I + 1]].sort()
    return indptr, indices[:end].copy()


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

    @njit(cache=True, error_model="numpy", fastmath=FUSED)
    def galerkin_rows(A, P, children, rows, coarse, held, T):
        """Row I of P^T A first, by columns of A; then times P, each of them once."""
        values, weights, product = flat(A.data), flat(P.data), flat(coarse.data)
        most = 0
        for I in rows:
            length = 0
            for q in range(children.indptr[I], children.indptr[I + 1]):
                i = children.row[q]
                length += np.int64(A.indptr[i + 1] - A.indptr[i])
            most = max(most, length)
        X, columns = np.empty(most * c * d), np.empty(most, dtype=np.uint32)
        place = np.zeros(held.size, dtype=np.int32)  # of a column in X, and 1
        entry = np.zeros(children.indptr.size - 1, dtype=np.int64)
        block, turned = np.empty(d * d), np.empty(c * d)
        for I in rows:
            for k in range(np.int64(coarse.indptr[I]), np.int64(coarse.indptr[I + 1])):
                entry[coarse.indices[k]] = k * c * c
                for t in range(c * c):
                    product[k * c * c + t] = 0.0
            found = 0
            for q in range(children.indptr[I], children.indptr[I + 1]):
                i, e = children.row[q], np.int64(children.entry[q])
                following = children.row[min(q + np.uint64(1), children.indptr[I + 1] - np.uint64(1))]
                ahead = (np.int64(A.indptr[following]) - np.int64(A.indptr[i])) * (8 * d * d)
                for k in range(np.int64(A.indptr[i]), np.int64(A.indptr[i + 1])):
                    prefetch(values, np.uint64(k * d * d), ahead)
                    j = A.indices[k]
                    if place[j] == 0:
                        columns[found] = j
                        for t in range(c * d):
                            X[found * c * d + t] = 0.0
                        found += 1
                        place[j] = found
                    x = (np.int64(place[j]) - 1) * c * d
                    if scalar and not held[i]:
                        for t in range(d * d):
                            X[x + t] += weights[e] * values[k * d * d + t]
                        continue
                    for a in range(d):
                        for b in range(d):
                            s = values[(k * d + a) * d + b]
                            if held[i]:
                                s = 0.0
                                for t in range(d):
                                    s += T[i, a, t] * values[(k * d + t) * d + b]
                            block[a * d + b] = s
                    for a in range(c):
                        for b in range(d):
                            if scalar:
                                X[x + a * d + b] += weights[e] * block[a * d + b]
                            else:
                                for t in range(d):
                                    X[x + a * d + b] += weights[(e * d + t) * c + a] * block[t * d + b]
            for n in range(found):
                j, x = columns[n], n * c * d
                place[j] = 0
                if held[j]:
                    for a in range(c):
                        for b in range(d):
                            turned[a * d + b] = 0.0
                            for t in range(d):
                                turned[a * d + b] += X[x + a * d + t] * T[j, t, b]
                    X[x : x + c * d] = turned
                for m in range(np.int64(P.indptr[j]), np.int64(P.indptr[j + 1])):
                    K = entry[P.indices[m]]
                    if scalar:
                        for t in range(d * d):
                            product[K + t] += X[x + t] * weights[m]
                        continue
                    for a in range(c):
                        for b in range(c):
                            for t in range(d):
                                product[K + a * c + b] += X[x + a * d + t] * weights[(m * d + t) * c + b]

    @njit(cache=True, error_model="numpy", fastmath=FUSED)
    def restrict(P, children, r, coarse_r):
        weights, row = flat(P.data), np.empty(c)
        for I in range(coarse_r.shape[0]):
            for a in range(c):
                row[a] = 0.0
            for q in range(children.indptr[I], children.indptr[I + 1]):
                i, e = children.row[q], np.int64(children.entry[q])
                for a in range(c):
                    if scalar:
                        row[a] += weights[e] * r[i, a]
                    else:
                        for t in range(d):
                            row[a] += weights[(e * d + t) * c + a] * r[i, t]
            for a in range(c):
                coarse_r[I, a] = row[a]

    @njit(cache=True, error_model="numpy", fastmath=FUSED)
    def prolong(P, coarse_u, u):
        weights, row = flat(P.data), np.empty(d)
        for i in range(u.shape[0]):
            for t in range(d):
                row[t] = u[i, t]
            for m in range(np.int64(P.indptr[i]), np.int64(P.indptr[i + 1])):
                I = P.indices[m]
                for t in range(d):
                    if scalar:
                        row[t] += weights[m] * coarse_u[I, t]
                    else:
                        for a in range(c):
                            row[t] += weights[(m * d + t) * c + a] * coarse_u[I, a]
            for t in range(d):
                u[i, t] = row[t]

    return Transfers(galerkin_rows, restrict, prolong)


@njit(cache=True, error_model="numpy")
def columns_of(M, rows, columns):
    """The distinct columns of the given rows of M, which has that many `columns`."""
    seen = np.zeros(columns, dtype=np.bool_)
    for i in rows:
        for k in range(M.indptr[i], M.indptr[i + 1]):
            seen[M.indices[k]] = True
    return np.flatnonzero(seen)


def coarsen(level: Level, P: BlockMatrix, coarse_nodes: int) -> Level:
    """Set the way from `level` to the next coarser one, and return that, with the matrix P^T A P."""
    level.P, level.children = P, transposed(P, coarse_nodes)
    d, scalar = level.inverse.shape[1], P.data.ndim == 1
    c = d if scalar else P.data.shape[2]
    level.transfers = transfers(d, c, scalar)
    indptr, indices = galerkin_pattern(level.A, P, level.children)
    A = BlockMatrix(indptr, indices, np.empty((indices.size, c, c)))
    coarse = Level(A, np.zeros((coarse_nodes, c, c)), diagonal_positions(A))
    recompute(level, coarse, np.arange(coarse_nodes))
    return coarse


def recompute(fine: Level, coarse: Level, rows: np.ndarray) -> None:
    """Compute the given block rows of the coarse matrix from the fine level, and invert their diagonals."""
    fine.transfers.galerkin_rows(fine.A, fine.P, fine.children, rows, coarse.A, fine.held, fine.T)
    coarse.inverse[rows] = coarse.A.data[coarse.middle[rows]]
    generalised_inverses(coarse.inverse, rows, coarse.inverse)
