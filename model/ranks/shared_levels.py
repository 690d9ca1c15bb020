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
from scipy.sparse import bsr_array, csr_array

from model.node_loop.blocks import (
    BlockMatrix,
    backward_sweep,
    block_matrix,
    generalised_inverses,
    sweep_from_zero,
)
from model.solvers.galerkin_coarsening import galerkin_pattern, nodal_prolongation, transfers, transposed
from model.solvers.truncated_multigrid import dense_inverse, projected_inverses


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
        self.rows = np.repeat(np.arange(exchange.owned), np.diff(A.indptr).astype(np.int64))
        self.middle = np.flatnonzero(self.rows == A.indices).astype(np.uint64)
        self.ghost = np.flatnonzero(A.indices >= exchange.owned)
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
        """Invert the diagonal blocks of owned rows (k,), default all, with half their ghost entries' weight.

        That makes Gauss-Seidel within the ranks converge whatever their number: with M what a sweep inverts,
        M + M^T - A stays positive (Baker, Falgout, Kolev and Yang, SIAM J. Sci. Comput. 33 (2011) 2864). A
        block E weighs (E E^T)^(1/2), the least that will do; the sizes of its entries, as there, weigh more.
        """
        rows = np.arange(self.exchange.owned) if rows is None else rows
        chosen = np.zeros(self.exchange.owned, dtype=bool)
        chosen[rows] = True
        ghost = self.ghost[chosen[self.rows[self.ghost]]]
        E = self.A.data[ghost]
        squares, turns = np.linalg.eigh(E @ E.transpose(0, 2, 1))
        weights = (turns * np.sqrt(np.maximum(squares, 0.0))[:, None, :]) @ turns.transpose(0, 2, 1)
        self.weight[rows] = 0.0
        np.add.at(self.weight, self.rows[ghost], 0.5 * weights)
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
        A = self._gathered.matrix(self.d)
        self.coarser = SharedLevel(A, exchange, weights.shape[1])
        self.recompute()
        return self.coarser

    def recompute(self, fine: np.ndarray | None = None) -> np.ndarray:
        """Compute the coarse matrix anew where owned rows (k,), default all, have part in it; collective.

        Return the owned coarse rows (m,) that have changed.
        """
        touched = np.zeros(self.children.indptr.size - 1)
        if fine is None:
            touched[:] = 1.0
        else:
            here = np.zeros(self.exchange.owned, dtype=bool)
            here[fine] = True
            owned = self.P.indptr[: self.exchange.owned + 1].astype(np.int64)
            touched[self.P.indices[: owned[-1]][np.repeat(here, np.diff(owned))]] = 1.0
        rows = np.flatnonzero(touched)
        self.transfers.galerkin_rows(self.A, self.P, self.children, rows, self.product)
        self._gathered.sum(self.product.data, self.coarser.A.data)
        self.coarser.exchange.add(touched)
        changed = np.flatnonzero(touched[: self.coarser.exchange.owned])
        self.coarser.invert(changed)
        return changed

    def around(self, nodes: np.ndarray) -> np.ndarray:
        """Return the owned rows (k,) of which some entry belongs to one of some nodes (m,), ghosts too."""
        marked = np.zeros(self.nodes, dtype=bool)
        marked[nodes] = True
        return np.unique(self.rows[marked[self.A.indices]])

    def sweep_from_zero(self, r: np.ndarray) -> None:
        """Sweep over the owned rows for A z = r from z = 0, and find the defect `rest`; collective."""
        sweep_from_zero(self.d)(self.A, self.middle, self.inverse, r, self.z, self.rest)
        self.exchange.update(self.z)
        subtract_ghosts(self.A, self.rows[self.ghost], self.ghost, self.z, self.rest)

    def backward_sweep(self, r: np.ndarray) -> None:
        """Sweep backwards over the owned rows for A z = r; collective."""
        self.exchange.update(self.z)
        backward_sweep(self.d)(self.A, self.inverse, r, self.z)
        self.exchange.update(self.z)


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
        self.comm = comm
        self.sent: list[tuple[int, np.ndarray]] = []
        asked: list[Any] = [np.zeros((0, 2), dtype=np.int64) for _ in range(comm.size)]
        for rank, _, receive in exchange.shared:
            entries = np.flatnonzero(np.isin(rows, receive))
            self.sent.append((rank, entries))
            asked[rank] = ids[np.stack([rows[entries], columns[entries]], axis=1)]
        order = np.argsort(ids)
        received = {
            rank: order[np.searchsorted(ids, pairs, sorter=order)]
            for rank, pairs in enumerate(comm.alltoall(asked))
        }
        self.own = np.flatnonzero(rows < owned)
        pairs = [np.stack([rows[self.own], columns[self.own]], axis=1), *received.values()]
        keys = np.concatenate([p[:, 0] * len(ids) + p[:, 1] for p in pairs])
        distinct, place = np.unique(keys, return_inverse=True)
        self.rows, self.columns = np.divmod(distinct, len(ids))
        places = np.split(place, np.cumsum([len(p) for p in pairs])[:-1])
        self.own_place, self.owned = places[0], owned
        self.received = {rank: where for rank, where in zip(received, places[1:]) if where.size}

    def matrix(self, d: int) -> BlockMatrix:
        """Return the matrix of the owned rows, zero as yet."""
        indptr = np.concatenate([[0], np.cumsum(np.bincount(self.rows, minlength=self.owned))])
        data = np.zeros((self.rows.size, d, d))
        return BlockMatrix(indptr.astype(np.uint64), self.columns.astype(np.uint32), data)

    def sum(self, contributions: np.ndarray, data: np.ndarray) -> None:
        """Write the sum of all ranks' contributions (m, d, d) into `data`; collective."""
        data[:] = 0.0
        data[self.own_place] = contributions[self.own]
        shape = contributions.shape[1:]
        buffers = {rank: np.empty((where.size, *shape)) for rank, where in self.received.items()}
        requests = [self.comm.Irecv(values, rank) for rank, values in buffers.items()]
        requests += [
            self.comm.Isend(contributions[entries], rank) for rank, entries in self.sent if entries.size
        ]
        for request in requests:
            request.Wait()
        for rank, where in self.received.items():
            data[where] += buffers[rank]


class CoarsestMesh:
    """The coarsest mesh, gathered on every rank and solved there.

    Attributes
    ----------
    number : (nodes,)
        Number of each node held here in the gathered mesh.

    Parameters
    ----------
    level : SharedLevel
    """

    def __init__(self, level: SharedLevel):
        comm, exchange = level.exchange.comm, level.exchange
        counts = comm.allgather(exchange.owned)
        self.level, self.counts = level, counts
        self.first = sum(counts[: comm.rank])
        number = np.zeros((level.nodes, 1), dtype=np.int64)
        number[: exchange.owned, 0] = self.first + np.arange(exchange.owned)
        exchange.update(number)
        self.number = number[:, 0]
        self.inverse: np.ndarray | None = None

    def solve(self, r: np.ndarray, z: np.ndarray) -> None:
        """Solve A z = r for the owned nodes and the ghosts; collective."""
        level = self.level
        d = level.d
        if self.inverse is None:
            A = block_matrix(self.matrix())
            self.inverse = dense_inverse(A, None, np.zeros((d * sum(self.counts), 0)))
        whole = self.gather(r)
        z[:] = (self.inverse @ whole.ravel()).reshape(-1, d)[self.number]

    def matrix(self) -> bsr_array:
        """Return the whole matrix; collective."""
        level, nodes = self.level, sum(self.counts)
        own = [self.first + level.rows, self.number[level.A.indices], level.A.data]
        rows, columns, data = (np.concatenate(x) for x in zip(*level.exchange.comm.allgather(own)))
        order = np.lexsort((columns, rows))
        indptr = np.concatenate([[0], np.cumsum(np.bincount(rows, minlength=nodes))])
        size = nodes * level.d
        return bsr_array((data[order], columns[order], indptr), shape=(size, size))

    def gather(self, values: np.ndarray) -> np.ndarray:
        """Return the values of all owned nodes in the order of the gathered mesh; collective."""
        return np.concatenate(self.level.exchange.comm.allgather(values[: self.level.exchange.owned]))


class SharedCycle:
    """V-cycles over meshes that many ranks share.

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
        levels = [finest]
        for weights, exchange, numbers in zip(prolongations, exchanges, ids, strict=True):
            levels.append(levels[-1].coarsen(weights, exchange, numbers))
        self._take(levels)

    def below(self, A: BlockMatrix) -> "SharedCycle":
        """Return cycles that begin on the next coarser mesh, with its matrix kept in A."""
        other = object.__new__(SharedCycle)
        levels = [level.copied() for level in self.levels[1:]]
        levels[0].A = A
        for fine, coarse in pairwise(levels):
            fine.coarser = coarse
        other._take(levels)
        return other

    def _take(self, levels: list[SharedLevel]) -> None:
        finest, self.levels = levels[0], levels
        self.held = np.tile(np.eye(finest.d), (finest.nodes, 1, 1))
        self.diagonal = finest.A.data[finest.middle].copy()
        self.coarsest = CoarsestMesh(self.levels[-1])

    def truncate(self, nodes: np.ndarray, projectors: np.ndarray) -> None:
        """Hold nodes (k,), ghosts too, to the ranges of their projectors (k, d, d), all others to nothing.

        Only what sees nodes that are held in another way than before, or whose diagonal block has changed, is
        computed anew; collective.
        """
        finest = self.levels[0]
        owned, d = finest.exchange.owned, finest.d
        held, diagonal = np.tile(np.eye(d), (finest.nodes, 1, 1)), finest.A.data[finest.middle]
        held[nodes] = projectors
        changed = np.any(held != self.held, axis=(1, 2))
        changed[:owned] |= np.any(diagonal != self.diagonal, axis=(1, 2))
        self.held, self.diagonal = held, diagonal
        here = np.flatnonzero(changed)
        own = here[here < owned]
        finest.hold(own, held[own])
        self.coarsest.inverse = None
        if len(self.levels) == 1:
            return
        rows = np.flatnonzero(np.repeat(changed, np.diff(finest.P.indptr).astype(np.int64)))
        of = np.repeat(np.arange(finest.nodes), np.diff(finest.P.indptr).astype(np.int64))[rows]
        finest.P.data[rows] = held[of] @ finest.full[rows]
        changed_rows = finest.around(here)
        for fine, _ in pairwise(self.levels):
            changed_rows = fine.recompute(changed_rows)

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
