"""Coarse matrices for multigrid.

Block prolongations, Galerkin products, and their repair when a few nodes change.

A prolongation is a `BlockMatrix` with blocks (d, c) that give the unknowns of a fine node from those of a
coarse one; the coarse matrix is P^T A P. Where contact or a support holds unknowns, the rows of the finest P
are truncated there (Kornhuber 1994; Graeser and Kornhuber 2009), and only the rows of the coarse matrices
that see a changed node are computed anew.
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
    diagonal_blocks,
    diagonal_positions,
    generalised_inverses,
)


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

    Its matrix, inverses and positions of the diagonal blocks, and the way to the next coarser mesh.
    """

    A: BlockMatrix
    inverse: np.ndarray
    middle: np.ndarray
    P: Any = None
    children: Any = None
    transfers: Any = None


def nodal_prolongation(P: Any, d: int) -> BlockMatrix:
    """Turn scalar weights (N, N_coarse) into blocks: each component is interpolated alike."""
    P = csr_array(P)
    P.sort_indices()
    data = P.data[:, None, None] * np.eye(d)
    return BlockMatrix(P.indptr.astype(np.uint64), P.indices.astype(np.uint32), data)


def transposed(P: BlockMatrix, coarse: int) -> Children:
    """Sort the entries of P by column."""
    rows = np.repeat(np.arange(P.indptr.size - 1), np.diff(P.indptr).astype(np.int64))
    entry = np.argsort(P.indices, kind="stable")
    counts = np.bincount(P.indices, minlength=coarse)
    indptr = np.concatenate([[0], np.cumsum(counts)])
    return Children(indptr.astype(np.uint64), rows[entry].astype(np.uint32), entry.astype(np.uint64))


@njit(cache=True, error_model="numpy")
def galerkin_pattern(A, P, children):
    """Row pointers and sorted columns of P^T A P."""
    coarse = children.indptr.size - 1
    indptr = np.zeros(coarse + 1, dtype=np.uint64)
    seen = np.full(coarse, -1, dtype=np.int64)
    for count in range(2):
        if count == 1:
            for I in range(coarse):
                indptr[I + 1] += indptr[I]
            indices = np.empty(indptr[coarse], dtype=np.uint32)
            seen[:] = -1
        for I in range(coarse):
            found = 0
            for q in range(children.indptr[I], children.indptr[I + 1]):
                i = children.row[q]
                for k in range(A.indptr[i], A.indptr[i + 1]):
                    j = A.indices[k]
                    for m in range(P.indptr[j], P.indptr[j + 1]):
                        J = P.indices[m]
                        if seen[J] != I:
                            seen[J] = I
                            if count == 1:
                                indices[indptr[I] + np.uint64(found)] = J
                            found += 1
            if count == 0:
                indptr[I + 1] = found
            else:
                indices[indptr[I] : indptr[I + 1]].sort()
    return indptr, indices


class Transfers(NamedTuple):
    """Compiled for blocks (d, c): Galerkin products row by row, r_coarse = P^T r, and u += P u_coarse."""

    galerkin_rows: Any
    restrict: Any
    prolong: Any


@lru_cache
def transfers(d: int, c: int) -> Transfers:
    """Compile the transfers between blocks of size d on the fine and c on the coarse mesh."""

    @njit(cache=True, error_model="numpy", fastmath=FUSED)
    def galerkin_rows(A, P, children, rows, coarse):
        place = np.zeros(children.indptr.size - 1, dtype=np.uint64)
        X = np.empty((c, d))
        for I in rows:
            for k in range(coarse.indptr[I], coarse.indptr[I + 1]):
                place[coarse.indices[k]] = k
                for a in range(c):
                    for b in range(c):
                        coarse.data[k, a, b] = 0.0
            for q in range(children.indptr[I], children.indptr[I + 1]):
                i = children.row[q]
                e = children.entry[q]
                for k in range(A.indptr[i], A.indptr[i + 1]):
                    for a in range(c):
                        for b in range(d):
                            s = 0.0
                            for t in range(d):
                                s += P.data[e, t, a] * A.data[k, t, b]
                            X[a, b] = s
                    j = A.indices[k]
                    for m in range(P.indptr[j], P.indptr[j + 1]):
                        K = place[P.indices[m]]
                        for a in range(c):
                            for b in range(c):
                                s = 0.0
                                for t in range(d):
                                    s += X[a, t] * P.data[m, t, b]
                                coarse.data[K, a, b] += s

    @njit(cache=True, error_model="numpy", fastmath=FUSED)
    def restrict(P, children, r, coarse_r):
        row = np.empty(c)
        for I in range(coarse_r.shape[0]):
            for a in range(c):
                row[a] = 0.0
            for q in range(children.indptr[I], children.indptr[I + 1]):
                i = children.row[q]
                e = children.entry[q]
                for a in range(c):
                    s = 0.0
                    for t in range(d):
                        s += P.data[e, t, a] * r[i, t]
                    row[a] += s
            for a in range(c):
                coarse_r[I, a] = row[a]

    @njit(cache=True, error_model="numpy", fastmath=FUSED)
    def prolong(P, coarse_u, u):
        row = np.empty(d)
        for i in range(u.shape[0]):
            for t in range(d):
                row[t] = u[i, t]
            for m in range(P.indptr[i], P.indptr[i + 1]):
                I = P.indices[m]
                for t in range(d):
                    s = 0.0
                    for a in range(c):
                        s += P.data[m, t, a] * coarse_u[I, a]
                    row[t] += s
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
    level.transfers = transfers(*P.data.shape[1:])
    c = P.data.shape[2]
    indptr, indices = galerkin_pattern(level.A, P, level.children)
    A = BlockMatrix(indptr, indices, np.zeros((indices.size, c, c)))
    coarse = Level(A, np.zeros((coarse_nodes, c, c)), diagonal_positions(A))
    recompute(level, coarse, np.arange(coarse_nodes))
    return coarse


def recompute(fine: Level, coarse: Level, rows: np.ndarray) -> None:
    """Compute the given block rows of the coarse matrix from the fine level, and invert their diagonals."""
    fine.transfers.galerkin_rows(fine.A, fine.P, fine.children, rows, coarse.A)
    diagonal_blocks(coarse.A, rows, coarse.inverse)
    generalised_inverses(coarse.inverse, rows, coarse.inverse)
