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
    diagonal_positions,
    generalised_inverses,
)
from model.ranks.gathered_meshes import GatheredCycle, WholeMesh, first_small
from model.solvers.galerkin_coarsening import (
    Level,
    columns_of,
    galerkin_product,
    multiply,
    prolongation,
    transposed,
)
from model.solvers.truncated_multigrid import Cycle, projected_inverses

TINY = 1e-300  # lets an entry that is zero count for nothing
KEPT = 0.5  # of the diagonal blocks, below


class SharedLevel(Level):
    """One mesh: the rows of the owned nodes, and the way to the next coarser mesh.

    Parameters
    ----------
    A : BlockMatrix
        Rows of the owned nodes, columns of all nodes held here.
    exchange : geometry.exchange.Exchange
    nodes : int
        Nodes held here, ghosts counted.
    inverse : (owned, d, d), optional
        Of the diagonal blocks, where it is known.
    """

    def __init__(self, A: BlockMatrix, exchange: Any, nodes: int, inverse: np.ndarray | None = None):
        self.A, self.ranks, self.nodes, self.d = A, exchange, nodes, A.data.shape[1]
        self.weight = np.zeros((exchange.owned, self.d, self.d))
        self.inverse = np.empty_like(self.weight) if inverse is None else inverse.copy()
        self.middle = diagonal_positions(A)
        self.ghost = np.flatnonzero(A.indices >= exchange.owned)
        self.ghost_rows = np.searchsorted(A.indptr, self.ghost.astype(np.uint64), side="right") - 1
        self.held = np.zeros(nodes, dtype=bool)
        self.T, self.L = (np.zeros((nodes, self.d, self.d)) for _ in range(2))
        self.invert(np.arange(exchange.owned) if inverse is None else np.unique(self.ghost_rows))

    def invert(self, rows: np.ndarray) -> None:
        """Invert the diagonal blocks of owned rows (k,), made heavier by their ghost entries.

        Gauss-Seidel within the ranks converges, whatever their number, where with M what a sweep inverts,
        M + M^T - A is positive. It is, with the diagonal blocks D, weights W added to them, and entries E
        between ranks, D + 2 W - E, which is no less than (1 - KEPT) D for

            2 W = (S - KEPT D)_+,    S = (sum |E| sum E E^T / |E|)^(1/2) >= sum (E E^T)^(1/2),

        the positive part being taken in the inner product of D, and S bounding the sum by Jensen's inequality
        (F. Hansen, G. K. Pedersen, Math. Ann. 258 (1982) 229). Half the sum of the sizes of all E, with
        nothing kept, is W in A. H. Baker, R. D. Falgout, T. V. Kolev, U. M. Yang, SIAM J. Sci. Comput. 33
        (2011) 2864. On 2, 4 and 8 ranks balls and half cylinders of 2,571 to 1,020,483 unknowns take at most
        15 cycles with 0.4 to 0.6 for KEPT; alone 14.
        """
        chosen = np.zeros(self.ranks.owned, dtype=bool)
        chosen[rows] = True
        here = chosen[self.ghost_rows]
        E = self.A.data[self.ghost[here]]
        near, first = np.unique(self.ghost_rows[here], return_index=True)  # sorted as they are
        if near.size:
            C, c = E @ E.transpose(0, 2, 1), np.linalg.norm(E, axis=(1, 2), keepdims=True) + TINY
            squares, turns = np.linalg.eigh(np.add.reduceat(c, first) * np.add.reduceat(C / c, first))
            sizes = (turns * np.sqrt(np.maximum(squares, 0.0))[:, None, :]) @ turns.transpose(0, 2, 1)
            self.weight[near] = 0.5 * excess(sizes, self.A.data[self.middle[near]])
        self.inverse[rows] = self.A.data[self.middle[rows]]
        self.inverse[near] += self.weight[near]
        generalised_inverses(self.inverse, rows, self.inverse)

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of fields on the nodes held here, ghosts counted."""
        return self.nodes, self.d

    def hold(self, nodes: np.ndarray, projectors: np.ndarray, tests: np.ndarray | None = None) -> None:
        """Let nodes (k,), ghosts too, move within the ranges of their projectors (k, d, d) only."""
        super().hold(nodes, projectors, tests)
        own = nodes < self.ranks.owned
        nodes, projectors = nodes[own], projectors[own]
        blocks = self.A.data[self.middle[nodes]] + self.weight[nodes]
        self.inverse[nodes] = projected_inverses(blocks, projectors, projectors)

    def coarsen(self, P: BlockMatrix, exchange: Any, ids: np.ndarray) -> "SharedLevel":
        """Set the way to the next coarser mesh and return that; collective.

        Parameters
        ----------
        P : BlockMatrix
            Rows of all nodes held here.
        exchange : geometry.exchange.Exchange
            Of the coarse mesh.
        ids : (coarse nodes,)
            Numbers that all ranks agree on.
        """
        indptr, coarse = P.indptr[: self.ranks.owned + 1], len(ids)
        count = int(indptr[-1])
        self.P, self.R = P, transposed(BlockMatrix(indptr, P.indices[:count], P.data[:count]), coarse)
        self.product = galerkin_product(self.A, P, self.R, self.held, self.T, self.T)
        self.shares = Shares(self.product, exchange, ids)
        self.shares.sum(self.product, np.ones(coarse, dtype=bool))
        self.coarser = SharedLevel(self.shares.own_rows(self.product), exchange, coarse)
        return self.coarser

    def recompute(self, fine: np.ndarray) -> np.ndarray:
        """Compute the coarse matrix anew where owned rows (k,) have part in it; collective.

        Return the owned coarse rows (m,) that have changed.
        """
        coarser, exchange = self.coarser, self.coarser.ranks
        touched = np.zeros(coarser.nodes, dtype=bool)
        touched[columns_of(self.P, fine, coarser.nodes)] = True
        exchange.add(touched)
        exchange.update(touched)
        multiply(self, self.product, np.flatnonzero(touched), self.T)
        self.shares.sum(self.product, touched)
        changed = np.flatnonzero(touched[: exchange.owned])
        coarser.invert(changed)
        return changed

    def around(self, nodes: np.ndarray) -> np.ndarray:
        """Return the owned rows (k,) of which some entry belongs to one of some nodes (m,), ghosts too."""
        owned, marked = self.ranks.owned, np.zeros(self.nodes, dtype=bool)
        marked[nodes] = True
        rows = columns_of(self.A, nodes[nodes < owned], self.nodes)
        of_ghosts = self.ghost_rows[marked[self.A.indices[self.ghost]]]
        return np.union1d(rows[rows < owned], of_ghosts)

    def sweep_from_zero(self, r: np.ndarray, z: np.ndarray, rest: np.ndarray) -> None:
        """Sweep over the owned rows, which leaves `rest`; collective."""
        super().sweep_from_zero(r, z, rest)
        self.ranks.update(z)
        subtract_ghosts(self.A, self.ghost_rows, self.ghost, z, rest)

    def sweep_back(self, r: np.ndarray, z: np.ndarray, rest: np.ndarray | None = None) -> None:
        """Sweep backwards over the owned rows, from z of which ghosts are known; collective."""
        super().sweep_back(r, z)
        self.ranks.update(z)
        if rest is not None:
            self.missing(r, z, rest)


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


class Shares:
    """What ranks contribute to each other's rows of a Galerkin product.

    Owned rows come first in the product, so that they are the coarse matrix as they stand. Meshes are nested
    and ranks hold all cells around the nodes they own: a row has all its entries where it is owned.

    Parameters
    ----------
    product : BlockMatrix
        Rows of all nodes held here.
    exchange : geometry.exchange.Exchange
    ids : (nodes,)
        Numbers that all ranks agree on.

    Raises
    ------
    ValueError
        If forms couple nodes that have no cell in common; on all ranks.
    """

    def __init__(self, product: BlockMatrix, exchange: Any, ids: np.ndarray):
        self.comm, self.owned = exchange.comm, exchange.owned
        counts = np.diff(product.indptr).astype(np.int64)
        asked: list[Any] = [(np.zeros(0, dtype=np.int64),) * 2] * self.comm.size
        self.sent, self.received = [], []
        for rank, _, receive in exchange.shared:
            rows = np.repeat(receive, counts[receive])
            first = product.indptr[receive].astype(np.int64) - np.cumsum(counts[receive]) + counts[receive]
            entries = np.repeat(first, counts[receive]) + np.arange(rows.size)
            self.sent.append((rank, entries, rows))
            asked[rank] = counts[receive], ids[product.indices[entries]]
        answers, missing = self.comm.alltoall(asked), False
        for rank, send, _ in exchange.shared:
            rows = np.repeat(send, answers[rank][0])
            places = places_of(product, ids, rows, answers[rank][1])
            self.received.append((rank, places, rows))
            missing |= bool(np.any(places < 0))
        exchange.agree(
            "On several ranks multigrid needs forms that couple nodes of one cell only; use 'algebraic'."
            if missing
            else ""
        )

    def own_rows(self, product: BlockMatrix) -> BlockMatrix:
        """Return the owned rows of the product; the values are shared."""
        count = int(product.indptr[self.owned])
        return BlockMatrix(product.indptr[: self.owned + 1], product.indices[:count], product.data[:count])

    def sum(self, product: BlockMatrix, touched: np.ndarray) -> None:
        """Add the contributions of other ranks to the owned rows that are touched (nodes,); collective."""
        arriving, requests = [], []
        for rank, places, rows in self.received:
            places = places[touched[rows]]
            if places.size:
                values = np.empty((places.size, *product.data.shape[1:]))
                requests.append(self.comm.Irecv(values, rank))
                arriving.append((places, values))
        for rank, entries, rows in self.sent:
            entries = entries[touched[rows]]
            if entries.size:
                requests.append(self.comm.Isend(product.data[entries], rank))
        for request in requests:
            request.Wait()
        for places, values in arriving:
            product.data[places] += values


@njit(cache=True, error_model="numpy")
def places_of(A, ids, rows, columns):
    """Positions (m,) of the entries of A whose rows are given, and their columns by `ids`; -1 if absent."""
    places = np.full(rows.size, -1)
    for m in range(rows.size):
        for k in range(A.indptr[rows[m]], A.indptr[rows[m] + 1]):
            if ids[A.indices[k]] == columns[m]:
                places[m] = k
    return places


class SharedCycle(Cycle):
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
        levels, shared = [finest], 1 + first_small(finest.d, exchanges)
        for weights, exchange, numbers in zip(prolongations[:shared], exchanges, ids):
            levels.append(levels[-1].coarsen(prolongation(weights), exchange, numbers))
        meshes = [
            WholeMesh(exchange, weights.shape[1]) for weights, exchange in zip(prolongations, exchanges)
        ]
        meshes = meshes[shared - 1 :]
        between = [f.weights(P, c) for (f, c), P in zip(pairwise(meshes), prolongations[shared:])]
        self._take(levels)
        self.coarsest = GatheredCycle(levels[-1], meshes[0], between)

    def below(self) -> "SharedCycle":
        """Return cycles that begin on the next coarser mesh, with matrices of their own."""
        other, levels = object.__new__(SharedCycle), [copy(level) for level in self.levels[1:]]
        for level in levels:
            level.inverse, level.weight = level.inverse.copy(), level.weight.copy()
        levels[0].A = levels[0].A._replace(data=levels[0].A.data.copy())
        for name in ("held", "T", "L"):
            setattr(levels[0], name, getattr(levels[0], name).copy())
        for fine, coarse in pairwise(levels):
            fine.product = fine.product._replace(data=fine.product.data.copy())
            fine.coarser, coarse.A = coarse, fine.shares.own_rows(fine.product)
        other._take(levels)
        other.coarsest = self.coarsest.of(levels[-1])
        return other

    def truncate(self, nodes: np.ndarray, projectors: np.ndarray, tests: np.ndarray | None = None) -> None:
        """Hold nodes (k,), ghosts too, to the ranges of their projectors (k, d, d).

        Only the rows of the coarse matrices that see these nodes are computed anew; collective.
        """
        finest = self.levels[0]
        finest.hold(nodes, projectors, tests)
        changed = finest.around(nodes)
        for fine, _ in pairwise(self.levels):
            changed = fine.recompute(changed)
        self.coarsest.stale = True

    def _visit_coarsest(self, r: np.ndarray, z: np.ndarray) -> None:
        """Set z to about what solves A z = r on the meshes that are gathered; collective."""
        self.coarsest.solve(r, z)
