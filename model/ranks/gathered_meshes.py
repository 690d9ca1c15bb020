"""Coarse meshes too small to be shared: gathered on every rank, which all run the serial code there."""

from collections.abc import Sequence
from copy import copy
from typing import Any

import numpy as np
from scipy.sparse import bsr_array, csr_array

from model.node_loop.blocks import BlockMatrix, diagonal_positions
from model.solvers.galerkin_coarsening import Level, hierarchy, invert_diagonal
from model.solvers.truncated_multigrid import Cycle

SMALL = 3_000  # unknowns: a sweep over them takes no longer than what ranks would tell each other meanwhile


def first_small(d: int, exchanges: Sequence[Any]) -> int:
    """Return which is the first mesh of not more than `SMALL` unknowns, or else the last; collective."""
    sizes = [d * exchange.sum(exchange.owned) for exchange in exchanges]
    return next((k for k, size in enumerate(sizes) if size <= SMALL), len(sizes) - 1)


class WholeMesh:
    """A mesh of which each rank gathers the values of all.

    Parameters
    ----------
    exchange : geometry.exchange.Exchange
    nodes : int
        Nodes held here, ghosts counted.

    Attributes
    ----------
    number : (nodes,)
        Number of each node held here in the gathered mesh.
    size : int
        Its nodes.
    """

    def __init__(self, exchange: Any, nodes: int):
        self.exchange = exchange
        self.counts = exchange.stacked(np.array([exchange.owned]))
        self.first, self.size = exchange.before(exchange.owned), int(self.counts.sum())
        self.number = np.zeros(nodes, dtype=np.int64)
        self.number[: exchange.owned] = self.first + np.arange(exchange.owned)
        exchange.update(self.number)

    def gather(self, values: np.ndarray) -> np.ndarray:
        """Return the values of all owned nodes in the order of the gathered mesh; collective."""
        own = np.ascontiguousarray(values[: self.exchange.owned])
        whole = np.empty((self.size, *own.shape[1:]), own.dtype)
        self.exchange.comm.Allgatherv(own, [whole, self.counts * whole[0].size])
        return whole

    def matrix(self, A: BlockMatrix) -> bsr_array:
        """Return the whole of a matrix of which each rank has the rows of its own nodes; collective."""
        counts = self.exchange.stacked(np.diff(A.indptr).astype(np.int64))
        indices = self.exchange.stacked(self.number[A.indices])
        indptr, size = np.concatenate([[0], np.cumsum(counts)]), self.size * A.data.shape[1]
        return bsr_array((self.exchange.stacked(A.data), indices, indptr), shape=(size, size))

    def weights(self, P: csr_array, coarse: "WholeMesh") -> csr_array:
        """Return the whole of a prolongation from a coarser mesh; collective."""
        own, stacked = P[: self.exchange.owned], self.exchange.stacked
        indptr = np.concatenate([[0], np.cumsum(stacked(np.diff(own.indptr)))])
        entries = (stacked(own.data), stacked(coarse.number[own.indices]), indptr)
        return csr_array(entries, shape=(self.size, coarse.size))


class GatheredCycle:
    """Cycles on the coarsest meshes, which every rank gathers and does by itself.

    Parameters
    ----------
    level : SharedLevel
        The finest of them.
    mesh : WholeMesh
    prolongations : sequence of csr_array
        Between the gathered meshes, finest first.
    """

    def __init__(self, level: Any, mesh: WholeMesh, prolongations: Sequence[csr_array]):
        self.level, self.mesh, self.prolongations = level, mesh, prolongations
        self.stale = True  # where the level's matrix has changed
        A = mesh.matrix(level.A)
        self._rows = np.repeat(np.arange(mesh.size), np.diff(A.indptr))
        self._order = np.lexsort((A.indices, self._rows))
        self._pattern = A.indptr.astype(np.uint64), A.indices[self._order].astype(np.uint32)
        self._cycle: Cycle | None = None

    def of(self, level: Any) -> "GatheredCycle":
        """Return cycles of the same mesh with another matrix."""
        other = copy(self)
        other.level, other.stale, other._cycle = level, True, None
        return other

    def solve(self, r: np.ndarray, z: np.ndarray) -> None:
        """Set z to about what solves A z = r, (nodes held, d) both; collective."""
        if self.stale:
            self._take_matrix()
        assert self._cycle is not None
        z[:] = self._cycle(self.mesh.gather(r))[self.mesh.number]

    def _take_matrix(self) -> None:
        data = self.mesh.exchange.stacked(self.level.A.data)[self._order]
        self.stale = False
        if self._cycle is None:
            A = BlockMatrix(*self._pattern, data)
            finest = Level(A, np.zeros((self.mesh.size, *data.shape[1:])), diagonal_positions(A))
            changed = np.arange(self.mesh.size)
        else:
            finest = self._cycle.levels[0]
            changed = np.unique(self._rows[np.any(data != finest.A.data, axis=(1, 2))])
            finest.A.data[:] = data
        invert_diagonal(finest, changed)
        if self._cycle is None:
            self._cycle = Cycle(hierarchy(finest, self.prolongations))
        else:
            self._cycle.renew(changed)
