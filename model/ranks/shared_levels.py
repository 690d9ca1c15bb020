"""Meshes of a multigrid hierarchy whose rows are shared by many ranks.

On each mesh a rank holds the rows of the nodes it owns; columns and vectors go on with its ghosts. Galerkin
products are formed from the rows of the fine mesh, so that contributions to rows of others are sent to them.
"""

from collections.abc import Sequence
from copy import copy
from itertools import pairwise
from typing import Any

import numpy as np
from numba import njit
from scipy.sparse import csr_array

from model.node_loop.blocks import (
    BlockMatrix,
    backward_sweep,
    diagonal_positions,
    generalised_inverses,
    sweep_from_zero,
)
from model.ranks.gathered_meshes import GatheredCycle, WholeMesh, first_small
from model.solvers.galerkin_coarsening import (
    columns_of,
    galerkin_pattern,
    nodal_prolongation,
    transfers,
    transposed,
)
from model.solvers.truncated_multigrid import projected_inverses, truncate_rows

KEPT = 0.4  # of the diagonal blocks, below


class SharedLevel:
    """One mesh: the rows of the owned nodes, and the way to the next coarser mesh.

    Parameters
    ----------
    A : BlockMatrix
        Rows of the owned nodes, columns of all nodes held here.
    exchange : geometry.exchange.Exchange
    nodes : int
        Nodes held here, ghosts counted.
    """

    def __init__(self, A: BlockMatrix, exchange: Any, nodes: int):
        self.A, self.exchange, self.nodes, self.d = A, exchange, nodes, A.data.shape[1]
        self.inverse = np.zeros((exchange.owned, self.d, self.d))
        self.middle = diagonal_positions(A)
        self.ghost = np.flatnonzero(A.indices >= exchange.owned)
        self.ghost_rows = np.searchsorted(A.indptr, self.ghost.astype(np.uint64), side="right") - 1
        self.weight, self.diagonal = np.zeros_like(self.inverse), np.zeros_like(self.inverse)
        self.z, self.rest, self.load = (np.zeros((nodes, self.d)) for _ in range(3))
        self.invert()

    def copied(self) -> "SharedLevel":
        """Return a level of its own that begins as this one, the way to the coarser mesh not truncated."""
        other = copy(self)
        other.A = self.A._replace(data=self.A.data.copy())
        other.inverse, other.weight, other.diagonal = (
            x.copy() for x in (self.inverse, self.weight, self.diagonal)
        )
        other.z, other.rest, other.load = (np.zeros_like(x) for x in (self.z, self.rest, self.load))
        if hasattr(self, "P"):
            other.P = self.P._replace(data=self.full.copy())
            other.product = self.product._replace(data=self.product.data.copy())
        return other

    def invert(self, rows: np.ndarray | None = None) -> None:
        """Invert the diagonal blocks of owned rows (k,), default all, made heavier by their ghost entries.

        Gauss-Seidel within the ranks converges, whatever their number, where with M what a sweep inverts,
        M + M^T - A is positive. It is, with the diagonal blocks D, weights W added to them, and entries E
        between ranks, D + 2 W - E, which is no less than (1 - KEPT) D for

            2 W = (sum (E E^T)^(1/2) - KEPT D)_+,

        the positive part being taken in the inner product of D. Half the sum of the sizes of all E, with
        nothing kept, is W in A. H. Baker, R. D. Falgout, T. V. Kolev, U. M. Yang, SIAM J. Sci. Comput. 33
        (2011) 2864. On 2, 4 and 8 ranks balls and half cylinders of 2,571 to 132,387 unknowns take at most 16
        cycles with 0 for KEPT, 15 with 0.3 to 0.6, 19 with 0.9; alone 13.
        """
        rows = np.arange(self.exchange.owned) if rows is None else rows
        chosen = np.zeros(self.exchange.owned, dtype=bool)
        chosen[rows] = True
        here = chosen[self.ghost_rows]
        E = self.A.data[self.ghost[here]]
        squares, turns = np.linalg.eigh(E @ E.transpose(0, 2, 1))
        sizes = (turns * np.sqrt(np.maximum(squares, 0.0))[:, None, :]) @ turns.transpose(0, 2, 1)
        near, place = np.unique(self.ghost_rows[here], return_inverse=True)
        total = np.zeros((near.size, self.d, self.d))
        np.add.at(total, place, sizes)
        self.weight[rows] = 0.0
        self.weight[near] = 0.5 * excess(total, self.A.data[self.middle[near]])
        self.diagonal[rows] = self.A.data[self.middle[rows]] + self.weight[rows]
        generalised_inverses(self.diagonal, rows, self.inverse)

    def hold(self, nodes: np.ndarray, projectors: np.ndarray) -> None:
        """Let sweeps move owned nodes (k,) within the ranges of their projectors (k, d, d) only."""
        self.diagonal[nodes] = self.A.data[self.middle[nodes]] + self.weight[nodes]
        self.inverse[nodes] = projected_inverses(self.diagonal[nodes], projectors)

    def coarsen(self, weights: csr_array, exchange: Any, ids: np.ndarray) -> "SharedLevel":
        """Set the way to the next coarser mesh and return that.

        Parameters
        ----------
        weights : (nodes, coarse nodes)
        exchange : geometry.exchange.Exchange
            Of the coarse mesh.
        ids : (coarse nodes,)
            Numbers that all ranks agree on.
        """
        self.P = nodal_prolongation(weights, self.d)
        self.full = self.P.data.copy()
        self.transfers = transfers(self.d, self.d)
        owned = BlockMatrix(self.P.indptr[: self.exchange.owned + 1], self.P.indices, self.P.data)
        count = int(owned.indptr[-1])
        self.children = transposed(owned._replace(indices=owned.indices[:count]), weights.shape[1])
        indptr, indices = galerkin_pattern(self.A, self.P, self.children)
        self.product = BlockMatrix(indptr, indices, np.zeros((indices.size, self.d, self.d)))
        rows = np.repeat(np.arange(weights.shape[1]), np.diff(indptr).astype(np.int64))
        self._gathered = Gathered(rows, indices.astype(np.int64), exchange, ids)
        self.coarser = SharedLevel(self._gathered.matrix(self.d), exchange, weights.shape[1])
        self.recompute()
        return self.coarser

    def recompute(self, fine: np.ndarray | None = None) -> np.ndarray:
        """Compute the coarse matrix anew where owned rows (k,), default all, have part in it; collective.

        Return the owned coarse rows (m,) that have changed.
        """
        coarser, exchange = self.coarser, self.coarser.exchange
        touched = np.zeros(coarser.nodes)
        touched[slice(None) if fine is None else columns_of(self.P, fine, coarser.nodes)] = 1.0
        rows = np.flatnonzero(touched)
        self.transfers.galerkin_rows(self.A, self.P, self.children, rows, self.product)
        exchange.add(touched)
        exchange.update(touched)
        self._gathered.sum(self.product, touched > 0.0, coarser.A)
        changed = np.flatnonzero(touched[: exchange.owned])
        coarser.invert(changed)
        return changed

    def around(self, nodes: np.ndarray) -> np.ndarray:
        """Return the owned rows (k,) of which some entry belongs to one of some nodes (m,), ghosts too."""
        owned, marked = self.exchange.owned, np.zeros(self.nodes, dtype=bool)
        marked[nodes] = True
        rows = columns_of(self.A, nodes[nodes < owned], self.nodes)
        of_ghosts = self.ghost_rows[marked[self.A.indices[self.ghost]]]
        return np.union1d(rows[rows < owned], of_ghosts)

    def sweep_from_zero(self, r: np.ndarray) -> None:
        """Sweep over the owned rows for A z = r from z = 0, and find the defect `rest`; collective."""
        sweep_from_zero(self.d)(self.A, self.middle, self.inverse, r, self.z, self.rest)
        self.exchange.update(self.z)
        subtract_ghosts(self.A, self.ghost_rows, self.ghost, self.z, self.rest)

    def backward_sweep(self, r: np.ndarray) -> None:
        """Sweep backwards over the owned rows for A z = r, from z of which ghosts are known; collective."""
        backward_sweep(self.d)(self.A, self.inverse, r, self.z)
        self.exchange.update(self.z)


def excess(sizes: np.ndarray, D: np.ndarray) -> np.ndarray:
    """Positive parts (k, d, d) of sizes - KEPT D, symmetric, in the inner products of the blocks D."""
    values, turns = np.linalg.eigh(D)
    root = np.sqrt(np.maximum(values, 0.0))
    some = root > 1e-6 * root.max(axis=1, keepdims=True, initial=0.0)  # beside that the rest is rounding
    inverse = np.where(some, 1.0 / np.where(some, root, 1.0), 0.0)
    to, back = turns * root[:, None, :], turns * inverse[:, None, :]
    shares, directions = np.linalg.eigh(back.transpose(0, 2, 1) @ sizes @ back)
    to = to @ directions
    return np.asarray((to * np.maximum(shares - KEPT, 0.0)[:, None, :]) @ to.transpose(0, 2, 1))


@njit(cache=True, error_model="numpy")
def subtract_ghosts(A, rows, entries, z, r):
    """Do r -= A z for the given entries of A, of the given rows."""
    d = z.shape[1]
    for m in range(rows.size):
        k = entries[m]
        for a in range(d):
            for b in range(d):
                r[rows[m], a] -= A.data[k, a, b] * z[A.indices[k], b]


class Gathered:
    """The sum, by rows, of what ranks contribute to each other's matrices.

    Parameters
    ----------
    rows, columns : (m,)
        Nodes of the entries that this rank computes, ghost rows too.
    exchange : geometry.exchange.Exchange
    ids : (nodes,)
        Numbers that all ranks agree on.
    """

    def __init__(self, rows: np.ndarray, columns: np.ndarray, exchange: Any, ids: np.ndarray):
        comm, owned = exchange.comm, exchange.owned
        self.comm, self.owned = comm, owned
        self.sent: list[tuple[int, np.ndarray, np.ndarray]] = []
        asked: list[Any] = [np.zeros((0, 2), dtype=np.int64) for _ in range(comm.size)]
        for rank, _, receive in exchange.shared:
            entries = np.flatnonzero(np.isin(rows, receive))
            self.sent.append((rank, entries, rows[entries]))
            asked[rank] = ids[np.stack([rows[entries], columns[entries]], axis=1)]
        order = np.argsort(ids)
        received = [
            order[np.searchsorted(ids, pairs, sorter=order)] for pairs in comm.alltoall(asked)
        ]  # of each rank, nodes held here
        own = np.flatnonzero(rows < owned)
        pairs = [np.stack([rows[own], columns[own]], axis=1), *received]
        keys = np.concatenate([p[:, 0] * len(ids) + p[:, 1] for p in pairs])
        distinct, place = np.unique(keys, return_inverse=True)
        self.rows, self.columns = np.divmod(distinct, len(ids))
        places = np.split(place, np.cumsum([len(p) for p in pairs])[:-1])
        self.place = np.zeros(rows.size, dtype=np.int64)
        self.place[own] = places[0]
        self.received = [
            (rank, where, self.rows[where]) for rank, where in enumerate(places[1:]) if where.size
        ]

    def matrix(self, d: int) -> BlockMatrix:
        """Return the matrix of the owned rows, zero as yet."""
        indptr = np.concatenate([[0], np.cumsum(np.bincount(self.rows, minlength=self.owned))])
        data = np.zeros((self.rows.size, d, d))
        return BlockMatrix(indptr.astype(np.uint64), self.columns.astype(np.uint32), data)

    def sum(self, product: BlockMatrix, touched: np.ndarray, A: BlockMatrix) -> None:
        """Write all ranks' contributions to the rows that are touched (nodes,) into A; collective."""
        put_rows(np.flatnonzero(touched[: self.owned]), product, self.place, A)
        arriving, requests = [], []
        for rank, where, rows in self.received:
            where = where[touched[rows]]
            if where.size:
                values = np.empty((where.size, *A.data.shape[1:]))
                requests.append(self.comm.Irecv(values, rank))
                arriving.append((where, values))
        for rank, entries, rows in self.sent:
            entries = entries[touched[rows]]
            if entries.size:
                requests.append(self.comm.Isend(product.data[entries], rank))
        for request in requests:
            request.Wait()
        for where, values in arriving:
            A.data[where] += values


@njit(cache=True, error_model="numpy")
def put_rows(rows, product, place, A):
    """Write rows of a product into those of A, which has entries besides: entry k goes to place[k]."""
    d = A.data.shape[1]
    for i in rows:
        for k in range(A.indptr[i], A.indptr[i + 1]):
            for a in range(d):
                for b in range(d):
                    A.data[k, a, b] = 0.0
        for k in range(product.indptr[i], product.indptr[i + 1]):
            for a in range(d):
                for b in range(d):
                    A.data[place[k], a, b] = product.data[k, a, b]


class SharedCycle:
    """V-cycles over meshes that many ranks share, the coarsest of them gathered.

    Parameters
    ----------
    finest : SharedLevel
    prolongations : sequence of csr_array
        Between the nodes held here, finest first.
    exchanges : sequence of geometry.exchange.Exchange
        Of the coarser meshes.
    ids : sequence of (nodes,)
        Numbers of the coarser meshes' nodes that all ranks agree on.
    """

    def __init__(
        self,
        finest: SharedLevel,
        prolongations: Sequence[csr_array],
        exchanges: Sequence[Any],
        ids: Sequence[np.ndarray],
    ):
        self.levels, shared = [finest], 1 + first_small(finest.d, exchanges)
        for weights, exchange, numbers in zip(prolongations[:shared], exchanges, ids):
            self.levels.append(self.levels[-1].coarsen(weights, exchange, numbers))
        meshes = [
            WholeMesh(exchange, weights.shape[1]) for weights, exchange in zip(prolongations, exchanges)
        ]
        meshes = meshes[shared - 1 :]
        between = [f.weights(P, c) for (f, c), P in zip(pairwise(meshes), prolongations[shared:])]
        self.coarsest = GatheredCycle(self.levels[-1], meshes[0], between)

    def below(self, A: BlockMatrix) -> "SharedCycle":
        """Return cycles that begin on the next coarser mesh, with its matrix kept in A."""
        other = object.__new__(SharedCycle)
        levels = other.levels = [level.copied() for level in self.levels[1:]]
        levels[0].A = A
        for fine, coarse in pairwise(levels):
            fine.coarser = coarse
        other.coarsest = self.coarsest.of(levels[-1])
        return other

    def truncate(self, nodes: np.ndarray, projectors: np.ndarray) -> None:
        """Hold nodes (k,), ghosts too, to the ranges of their projectors (k, d, d).

        Only the rows of the coarse matrices that see these nodes are computed anew; collective.
        """
        finest = self.levels[0]
        own = nodes < finest.exchange.owned
        finest.hold(nodes[own], projectors[own])
        truncate_rows(finest.P, finest.full, nodes, projectors)
        changed = finest.around(nodes)
        for fine, _ in pairwise(self.levels):
            changed = fine.recompute(changed)
        self.coarsest.stale = True

    def __call__(self, r: np.ndarray, number: int = 0) -> np.ndarray:
        """One V(1,1)-cycle for A z = r from z = 0, on level `number`; overwritten by the next call."""
        level = self.levels[number]
        if number == len(self.levels) - 1:
            self.coarsest.solve(r, level.z)
            return level.z
        coarser = self.levels[number + 1]
        level.sweep_from_zero(r)
        level.transfers.restrict(level.P, level.children, level.rest, coarser.load)
        coarser.exchange.add(coarser.load)
        level.transfers.prolong(level.P, self(coarser.load, number + 1), level.z)
        level.backward_sweep(r)
        return level.z
