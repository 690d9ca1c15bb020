"""Partition of a mesh over the ranks of a communicator, and its uniform refinement within the parts.

Each rank holds its own cells and all cells that share a node with them, so that the rows of the nodes it owns
can be assembled without asking anybody. A node belongs to the lowest rank that owns a cell around it; as
children stay with their parents' rank, a node keeps its owner on all finer meshes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sparse

from geometry.grid import Grid, number_rows


class Shared(NamedTuple):
    """Which nodes of nested meshes, finest first, many ranks have in common.

    `ids` and `owner` (N,) of each mesh: number and rank of the nodes this rank holds; `cells` (n,) of the
    finest that are its own; `prolongations` between them.
    """

    comm: Any
    ids: list[np.ndarray]
    owner: list[np.ndarray]
    cells: np.ndarray
    prolongations: list[sparse.csr_array]


@dataclass
class Part:
    """What one rank holds of a mesh.

    Attributes
    ----------
    comm : MPI communicator
    grid : Grid
        Its own cells and those that share a node with them.
    cell_owner : (n,)
        Rank of each cell.
    ids : (N,)
        Number of each point, the same on every rank; a point keeps it on finer meshes.
    owner : (N,)
        Rank of each point.
    count : int
        Points of the whole mesh.
    """

    comm: Any
    grid: Grid
    cell_owner: np.ndarray
    ids: np.ndarray
    owner: np.ndarray
    count: int

    def refine(self) -> tuple[Part, sparse.csr_array]:
        """Halve every edge; collective.

        Returns
        -------
        finer : Part
        transfer : (N_fine, N)
            Weights, as those of `Grid.refine`, between the points this rank holds.
        """
        return self._of_children(*self.grid.refine())

    def crossed(self) -> tuple[Part, sparse.csr_array]:
        """Cut each quadrilateral in four triangles, as `Grid.crossed` does; collective."""
        return self._of_children(*self.grid.crossed())

    def _of_children(self, finer: Grid, transfer: sparse.csr_array) -> tuple[Part, sparse.csr_array]:
        """Share out what the cells held here have been cut into."""
        cell_owner = np.repeat(self.cell_owner, len(finer.cells) // max(len(self.grid.cells), 1))
        points, cells, mine = neighbourhood(finer.cells, cell_owner, self.comm.rank, len(finer.points))
        finer, transfer = restricted(finer, points, cells), sparse.csr_array(transfer[points])
        cell_owner = cell_owner[cells]
        old = points < len(self.ids)
        ids, owner = np.full(len(points), -1), np.full(len(points), -1)
        ids[old], owner[old] = self.ids[points[old]], self.owner[points[old]]
        lowest = np.full(len(points), self.comm.size)
        np.minimum.at(lowest, finer.cells, cell_owner[:, None])
        owner = np.where(mine & ~old, lowest, owner)
        keys = self._parents(transfer)
        owned = np.flatnonzero(~old & (owner == self.comm.rank))
        counts = self.comm.allgather(owned.size)
        ids[owned] = self.count + sum(counts[: self.comm.rank]) + np.arange(owned.size)
        # Around its own cells a rank knows a point's owner, not its number; a cell's owner knows both.
        shared = np.flatnonzero(mine & ~old & (owner != self.comm.rank))
        ids[shared] = self._ask(owner[shared], keys[shared], keys[owned], ids[owned, None])[:, 0]
        beyond = np.flatnonzero(~mine & ~old)
        anybody = np.empty(len(points), dtype=np.int64)
        anybody[finer.cells] = cell_owner[:, None]
        known = np.flatnonzero(mine & ~old)
        answers = np.stack([ids[known], owner[known]], axis=1)
        ids[beyond], owner[beyond] = self._ask(anybody[beyond], keys[beyond], keys[known], answers).T
        return Part(self.comm, finer, cell_owner, ids, owner, self.count + sum(counts)), transfer

    def _parents(self, transfer: sparse.csr_array) -> np.ndarray:
        """Sorted numbers of the points whose mean each point is, (N, 2^dim), filled up with -1."""
        width = 2**self.grid.dim
        keys = np.full((transfer.shape[0], width), -1)
        counts = np.diff(transfer.indptr)
        rows = np.repeat(np.arange(len(counts)), counts)
        keys[rows, np.arange(rows.size) - np.repeat(transfer.indptr[:-1], counts)] = self.ids[
            transfer.indices
        ]
        return np.sort(keys, axis=1)

    def _ask(self, whom: np.ndarray, asked: np.ndarray, keys: np.ndarray, answers: np.ndarray) -> np.ndarray:
        """Ask rank `whom` (m,) for its answers (., k) to the keys `asked` (m, w); collective."""
        comm = self.comm
        wanted = [np.flatnonzero(whom == rank) for rank in range(comm.size)]
        questions = comm.alltoall([asked[w] for w in wanted])
        replies = comm.alltoall([answers[matching(keys, question)] for question in questions])
        found = np.empty((whom.size, answers.shape[1]), dtype=np.int64)
        for w, reply in zip(wanted, replies):
            found[w] = reply
        return found


def partition(grid: Grid, comm: Any) -> Part:
    """Share a mesh, the same on every rank, out among the ranks; collective.

    Parameters
    ----------
    grid : Grid
    comm : MPI communicator

    Returns
    -------
    Part

    Examples
    --------
    >>> from mpi4py import MPI
    >>> from geometry import rectangle
    >>> part = partition(rectangle(2.0, 1.0, 4, 2), MPI.COMM_SELF)
    >>> part.count, bool((part.owner == 0).all())
    (15, True)
    """
    centres = grid.points[grid.cells].mean(axis=1)
    cell_owner = bisected(centres, comm.size)
    points, cells, _ = neighbourhood(grid.cells, cell_owner, comm.rank, len(grid.points))
    owner = np.full(len(grid.points), comm.size)
    np.minimum.at(owner, grid.cells, cell_owner[:, None])
    part = restricted(grid, points, cells)
    return Part(comm, part, cell_owner[cells], points, owner[points], len(grid.points))


def bisected(points: np.ndarray, parts: int) -> np.ndarray:
    """Number (n,) of the part of each point (n, dim), by recursive bisection across the longest extent."""
    number = np.zeros(len(points), dtype=np.int64)
    if parts == 1 or len(points) == 0:
        return number
    along = points[:, np.argmax(np.ptp(points, axis=0))]
    order = np.argsort(along, kind="stable")
    low = parts // 2
    cut = round(len(points) * low / parts)
    first, second = np.sort(order[:cut]), np.sort(order[cut:])
    number[first] = bisected(points[first], low)
    number[second] = low + bisected(points[second], parts - low)
    return number


def neighbourhood(
    cells: np.ndarray, cell_owner: np.ndarray, rank: int, count: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points and cells, sorted, around the rank's own cells, and which of the points own cells have."""
    mine = np.zeros(count, dtype=bool)
    mine[cells[cell_owner == rank]] = True
    kept = np.flatnonzero(mine[cells].any(axis=1))
    points = np.unique(cells[kept])
    return points, kept, mine[points]


def restricted(grid: Grid, points: np.ndarray, cells: np.ndarray) -> Grid:
    """Return the grid of some of the cells, which have the given points and no others (sorted both)."""
    number = np.full(len(grid.points), -1)
    number[points] = np.arange(len(points))
    place = np.full(len(grid.cells), -1)
    place[cells] = np.arange(len(cells))
    facets = {name: number[rows] for name, rows in grid.facets.items()}
    regions = {name: place[np.asarray(members)] for name, members in grid.regions.items()}
    kept = replace(
        grid,
        points=grid.points[points],
        cells=number[grid.cells[cells]],
        facets={name: rows[(rows >= 0).all(axis=1)] for name, rows in facets.items()},
        regions={name: members[members >= 0] for name, members in regions.items()},
    )
    return kept


def matching(keys: np.ndarray, asked: np.ndarray) -> np.ndarray:
    """Return the row of `keys` (n, w) that equals each row of `asked` (m, w)."""
    number = number_rows(np.concatenate([keys, asked]) + 1)[1]
    row = np.full(number.max(initial=-1) + 1, -1)
    row[number[: len(keys)]] = np.arange(len(keys))
    return row[number[len(keys) :]]


def shared_nodes(
    ids: np.ndarray, owner: np.ndarray, comm: Any
) -> Sequence[tuple[int, np.ndarray, np.ndarray]]:
    """Which nodes this rank shares with which neighbour; collective.

    Parameters
    ----------
    ids, owner : (N,)
        Number and rank of the nodes this rank holds.
    comm : MPI communicator

    Returns
    -------
    list of (rank, send (k,), receive (m,))
        For each neighbour the nodes owned here that it holds too, and those held here that it owns.
    """
    held = [np.flatnonzero((owner == rank) & (rank != comm.rank)) for rank in range(comm.size)]
    wanted = comm.alltoall([ids[h] for h in held])
    order = np.argsort(ids, kind="stable")
    sends = [order[np.searchsorted(ids, w, sorter=order)] for w in wanted]
    return [
        (rank, send, receive)
        for rank, (send, receive) in enumerate(zip(sends, held))
        if send.size + receive.size
    ]


_SHARED: dict[int, tuple[Any, Shared]] = {}


def share_mesh(mesh: Any, shared: Shared) -> None:
    """Remember that a mesh is what one rank holds of a shared one, for forms written on it."""
    _SHARED[id(mesh._cpp_object)] = mesh._cpp_object, shared


def shared_of(mesh: Any) -> Shared | None:
    """Return what `share_mesh` was told of a mesh, if anything."""
    return _SHARED.get(id(mesh._cpp_object), (None, None))[1]
