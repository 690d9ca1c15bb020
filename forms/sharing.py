"""Nodes of a system of which many ranks hold parts: their numbers and owners, and the rows of its matrices.

A rank owns nodes, whose rows it holds whole, and has copies of others (ghosts): those that its rows name, and
those of the cells it holds. Rows may come from others, where nodes of many ranks are tied into one.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import scipy.sparse as sparse

from forms.assembly import numbers_and_ranks
from geometry.body import narrow
from geometry.exchange import Exchange
from geometry.partition import Shared, shared_nodes


class Level:
    """The nodes of one mesh that a rank holds: its own, then its ghosts.

    Parameters
    ----------
    comm : MPI communicator
    ids, owner : (N,)
        Number and rank of the node that each node of the mesh has become; several may have become one.
    more_ids, more_owner : (m,)
        Of nodes that rows from other ranks name.

    Attributes
    ----------
    node_of : (N,)
        Node held here that each node of the mesh has become.
    chosen : (R,)
        A node of the mesh for each held here, or -1 where this rank has none.
    """

    def __init__(
        self, comm: Any, ids: np.ndarray, owner: np.ndarray, more_ids: np.ndarray, more_owner: np.ndarray
    ):
        self.comm = comm
        order = np.argsort(owner != comm.rank, kind="stable")
        every, ranks = np.concatenate([ids[order], more_ids]), np.concatenate([owner[order], more_owner])
        first = np.sort(np.unique(every, return_index=True)[1])
        self.ids, self.owner = every[first], ranks[first]
        self.chosen = np.where(first < len(ids), np.append(order, more_ids)[first], -1)
        self.node_of = self.places(ids)
        owned = int(np.sum(self.owner == comm.rank))
        self.exchange = Exchange(comm, shared_nodes(self.ids, self.owner, comm), owned)

    def places(self, ids: np.ndarray) -> np.ndarray:
        """Return where nodes of the given numbers are held here."""
        order = np.argsort(self.ids)
        return order[np.searchsorted(self.ids, ids, sorter=order)]

    def coarser(
        self, P: sparse.csr_array, ids: np.ndarray, owner: np.ndarray
    ) -> tuple[Level, sparse.csr_array]:
        """Return the nodes of the next coarser mesh and the weights between them and those held here.

        Parameters
        ----------
        P : (N, N_coarse)
            Between the nodes of the meshes.
        ids, owner : (N_coarse,)
            As for `Level`, of the coarser mesh.
        """
        known = np.flatnonzero(self.chosen >= 0)
        rows = P[self.chosen[known]]
        counts = np.zeros(len(self.ids), dtype=np.int64)
        counts[known] = np.diff(rows.indptr)
        here = (ids[rows.indices], owner[rows.indices], rows.data)
        missing = np.flatnonzero(self.chosen < 0)
        replies = self._ask(missing, counts, *here)
        for nodes, (count, *_) in replies:
            counts[nodes] = count
        who = np.concatenate([np.repeat(known, counts[known])] + [np.repeat(n, r[0]) for n, r in replies])
        columns, ranks, weights = (
            np.concatenate([mine, *(r[1 + k] for _, r in replies)]) for k, mine in enumerate(here)
        )
        none = np.zeros(0, dtype=np.int64)
        level = Level(self.comm, columns, ranks, none, none)
        level.chosen = _place_or_none(ids, level.ids)
        shape = (len(self.ids), len(level.ids))
        between = sparse.csr_array((weights, (who, level.node_of)), shape=shape)
        between.sum_duplicates()
        return level, narrow(between)

    def _ask(self, nodes: np.ndarray, counts: np.ndarray, *entries: np.ndarray) -> list[Any]:
        """Ask the owners of nodes (m,) for their rows, of which this rank has some of its own; collective."""
        comm = self.comm
        wanted = [nodes[self.owner[nodes] == rank] for rank in range(comm.size)]
        questions = comm.alltoall([self.ids[w] for w in wanted])
        start = np.concatenate([[0], np.cumsum(counts)])
        answers = []
        for question in questions:
            at = self.places(question) if len(question) else np.zeros(0, dtype=np.int64)
            take = np.concatenate([np.arange(start[k], start[k + 1]) for k in at] + [at[:0]])
            answers.append((counts[at], *(values[take] for values in entries)))
        return list(zip(wanted, comm.alltoall(answers)))


class Sharing(Level):
    """A system shared by ranks: its finest nodes, its matrices and loads.

    Parameters
    ----------
    comm : MPI communicator
    ids, owner : (C,)
        As for `Level`; after the N nodes of the space come those that only matrices name.
    own : (N,) of bool
        Nodes of the space whose rows count here: each is counted on one rank.
    cells : (n,)
        Cells that are counted here, likewise.
    matrices : sequence of sparse (N dim, C dim)
        Whose columns the rank must see.
    mesh_ids : (N,), optional
        Numbers of the space's nodes, where several have become one; default `ids`.
    """

    def __init__(
        self,
        comm: Any,
        ids: np.ndarray,
        owner: np.ndarray,
        own: np.ndarray,
        cells: np.ndarray,
        matrices: Sequence[sparse.bsr_array],
        mesh_ids: np.ndarray | None = None,
    ):
        self.own, self.cells = np.flatnonzero(own), cells
        self.mesh_ids = ids if mesh_ids is None else mesh_ids
        away = self.own[owner[self.own] != comm.rank]
        self.tied = comm.allreduce(float(away.size + self.own.size - np.unique(ids[self.own]).size)) > 0
        more = np.zeros((0, 2), dtype=np.int64)
        if self.tied:
            seen: list[Any] = [more] * comm.size
            for A in matrices:
                rows, columns, _ = _entries(A, away)
                for rank in np.unique(owner[away]):
                    there = columns[owner[rows] == rank]
                    pairs = np.unique(np.stack([ids[there], owner[there]], axis=1), axis=0)
                    seen[rank] = np.concatenate([seen[rank], pairs])
            more = np.concatenate(comm.alltoall(seen))
        super().__init__(comm, ids, owner, *more.T)
        self.away, self.away_rank = away, owner[away]

    def matrix(self, A: sparse.bsr_array) -> sparse.bsr_array:
        """Return the matrix (R dim, R dim) of the nodes held here, from its rows (N dim, C dim); collective.

        Rows of ghosts are empty.
        """
        R, dim = len(self.ids), A.blocksize[0]
        rows, columns, data = _entries(A, self.own)
        rows, columns = self.node_of[rows], self.node_of[columns]
        if self.tied:
            far = rows >= self.exchange.owned
            entries = (self.ids[rows[far]], self.ids[columns[far]], data[far])
            to = self.owner[rows[far]]
            sent = [tuple(x[to == rank] for x in entries) for rank in range(self.comm.size)]
            got = [np.concatenate(x) for x in zip(*self.comm.alltoall(sent))]
            rows = np.concatenate([rows[~far], self.places(got[0])])
            columns = np.concatenate([columns[~far], self.places(got[1])])
            data = np.concatenate([data[~far], got[2]])
        key = rows.astype(np.int64) * R + columns
        order = np.argsort(key, kind="stable")
        key = key[order]
        data = data[order]
        if self.tied:
            start = np.flatnonzero(np.concatenate([[True], key[1:] != key[:-1]])[: len(key)])
            data, key = np.add.reduceat(data, start, axis=0) if len(start) else data, key[start]
        rows, columns = np.divmod(key, R)
        indptr = np.concatenate([[0], np.cumsum(np.bincount(rows, minlength=R))])
        columns, indptr = columns.astype(np.int32), indptr.astype(np.int32)
        return sparse.bsr_array((data, columns, indptr), shape=(R * dim, R * dim))

    def reduce(self, values: np.ndarray) -> np.ndarray:
        """Return the sums (R, k) of values (N, k) over the nodes of the space, right where owned."""
        summed = np.zeros((len(self.ids), *values.shape[1:]))
        np.add.at(summed, self.node_of[self.own], values[self.own])
        if self.tied:
            self.exchange.add(summed)
        return summed

    def spread(self, values: np.ndarray) -> np.ndarray:
        """Return values (R, ...) with those of ghosts like their owners'; collective."""
        self.exchange.update(values)
        return values


def block_rows(A: sparse.bsr_array, nodes: np.ndarray) -> sparse.bsr_array:
    """Return the rows (k dim, C dim) of some nodes (k,) of a matrix (N dim, C dim)."""
    dim = A.blocksize[0]
    shape = (A.shape[0] // dim, A.shape[1] // dim)
    places = sparse.csr_array((np.arange(A.indices.size), A.indices, A.indptr), shape=shape)[nodes]
    shape = (len(nodes) * dim, A.shape[1])
    return sparse.bsr_array((A.data[places.data], places.indices, places.indptr), shape=shape)


def _entries(A: sparse.bsr_array, nodes: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Block rows, columns and blocks of the rows of some nodes."""
    rows = block_rows(A, nodes)
    return np.repeat(nodes, np.diff(rows.indptr)), rows.indices, rows.data


def _place_or_none(ids: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Return a place of each wanted number among `ids`, or -1."""
    order = np.argsort(ids, kind="stable")
    at = np.searchsorted(ids, wanted, sorter=order)
    found = order[np.minimum(at, len(ids) - 1)]
    return np.where(ids[found] == wanted, found, -1)


def share(
    shared: Shared, matrices: Sequence[sparse.bsr_array], platens: Sequence[np.ndarray] = ()
) -> tuple[Sharing, list[tuple[sparse.csr_array, np.ndarray, np.ndarray]]]:
    """Share out the system of a body that ranks share; collective.

    Parameters
    ----------
    shared : geometry.partition.Shared
    matrices : sequence of sparse (N dim, N dim)
        Of the cells held here, so that the rows of owned nodes are whole.
    platens : sequence of arrays
        Nodes that are tied into one each.

    Returns
    -------
    sharing : Sharing
    levels : list of (P, ids, owner)
        What `Level.coarser` takes, for one coarser mesh after the other.
    """
    comm, own = shared.comm, shared.owner[0] == shared.comm.rank
    ids, owner = list(shared.ids), list(shared.owner)
    for nodes in platens:
        members = np.concatenate(comm.allgather(shared.ids[0][nodes[own[nodes]]]))
        if members.size == 0:
            continue
        whole = members.min()
        rank = comm.allreduce(comm.rank if whole in shared.ids[0][own] else 0)
        for level, numbers in enumerate(shared.ids):
            tied = np.isin(numbers, members)
            ids[level], owner[level] = np.where(tied, whole, ids[level]), np.where(tied, rank, owner[level])
    sharing = Sharing(comm, ids[0], owner[0], own, shared.cells, matrices, shared.ids[0])
    return sharing, list(zip(shared.prolongations, ids[1:], owner[1:]))


def take_levels(system: Any, levels: Sequence[tuple[sparse.csr_array, np.ndarray, np.ndarray]]) -> None:
    """Give a shared system its prolongations, and the exchange and numbers of nodes on each mesh."""
    level: Level = system.sharing
    found = [level]
    for of_mesh in levels:
        level, P = level.coarser(*of_mesh)
        found.append(level)
        system.prolongations.append(P)
    system.exchanges, system.ids = [one.exchange for one in found], [one.ids for one in found]


def agreed(values: np.ndarray, sharing: Sharing) -> np.ndarray:
    """Return prescribed values (R, dim), NaN where free, that some rank knows of each node; collective.

    A rank may not see the boundary that a ghost lies on; of tied nodes it may hold others than those that
    something is prescribed for.
    """
    if sharing.tied:
        known = ~np.isnan(values)
        count, total = known.astype(np.float64), np.where(known, values, 0.0)
        sharing.exchange.add(count)
        sharing.exchange.add(total)
        told = np.isnan(values) & (count > 0.0)
        values = np.where(told, total / np.maximum(count, 1.0), values)
    return sharing.spread(values)


def share_space(
    V: Any, rows: Sequence[tuple[sparse.bsr_array, np.ndarray, np.ndarray]]
) -> tuple[Sharing, list[sparse.bsr_array]]:
    """Share out the system of a space on a mesh that dolfinx has distributed; collective.

    Parameters
    ----------
    V : dolfinx function space
    rows : sequence of (matrix, number of each column, rank of each column)
        As `forms.assembly.rows_and_columns` gives them.

    Returns
    -------
    sharing : Sharing
    matrices : list of sparse (n dim, C dim)
        Of the n nodes that this rank owns.
    """
    mesh, nodes = V.mesh, V.dofmap.index_map
    numbers, ranks = numbers_and_ranks(nodes, mesh.comm)
    every = np.concatenate([numbers, *(ids for _, ids, _ in rows)])
    owners = np.concatenate([ranks, *(owner for _, _, owner in rows)])
    first = np.sort(np.unique(every, return_index=True)[1])
    ids, owner = every[first], owners[first]
    order, dim, matrices = np.argsort(ids), V.dofmap.index_map_bs, []
    for A, columns, _ in rows:
        place = order[np.searchsorted(ids, columns, sorter=order)]
        shape = (A.shape[0], len(ids) * dim)
        matrices.append(sparse.bsr_array((A.data, place[A.indices], A.indptr), shape=shape))
    cells = np.arange(mesh.topology.index_map(mesh.topology.dim).size_local)
    own = np.arange(len(numbers)) < nodes.size_local
    return Sharing(mesh.comm, ids, owner, own, cells, matrices, numbers), matrices


def of_system(values: np.ndarray, sharing: Sharing | None) -> np.ndarray:
    """Return values (R, dim) at the nodes of the system, of values (N, dim) at those of the space.

    Of a rank that does not see the boundary on which a ghost lies, those of its owner.
    """
    if sharing is None:
        return values
    found = np.zeros((len(sharing.ids), *values.shape[1:]), dtype=values.dtype)
    found[sharing.node_of[: len(values)]] = values
    return sharing.spread(found)
