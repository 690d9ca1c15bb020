"""How a body is held: prescribed displacements and a rigid platen, eliminated symmetrically."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sparse

from geometry import Body
from geometry.body import narrow


@dataclass
class System:
    """Matrix and load after the supports.

    Attributes
    ----------
    A : (R dim, R dim) in dim x dim blocks. A prescribed unknown keeps its place as a row and column with a
        lone diagonal entry, its effect moved to the load.
    load : (R, dim)
    coordinates : (R, dim); of a platen, the mean of its nodes
    node_of : (N,) the node of the system that each node of the body has become
    prolongations : between the meshes, finest first, with platens as one node on each; to be truncated at
        prescribed unknowns by the solver
    fixed : (R, dim) which unknowns are prescribed
    """

    A: sparse.bsr_array
    load: np.ndarray
    coordinates: np.ndarray
    node_of: np.ndarray
    prolongations: list[sparse.csr_array]
    fixed: np.ndarray

    def expand(self, u: np.ndarray) -> np.ndarray:
        """Return displacements (N, dim) of the body's nodes from those of the system (R, dim)."""
        return np.asarray(u)[self.node_of]

    def reduce(self, load: np.ndarray) -> np.ndarray:
        """Return forces (R, dim) on the system from forces (N, dim) on the body; a platen has their sum."""
        reduced = np.zeros((len(self.coordinates), load.shape[1]))
        np.add.at(reduced, self.node_of, load)
        return reduced


class Support:
    """Supports of a body, collected one by one and applied at once.

    >>> system = Support(body).fix("left", x=0.0).platen("top").apply(K, load)  # doctest: +SKIP
    """

    def __init__(self, body: Body):
        self.body = body
        self.value = np.full(body.coordinates.shape, np.nan)
        self.platens: list[np.ndarray] = []

    def fix(
        self,
        name: str | Sequence[str],
        x: float | None = None,
        y: float | None = None,
        z: float | None = None,
    ) -> Support:
        """Prescribe components of the displacement on boundaries; components left out stay free."""
        return self._prescribe(self.body.nodes(name), (x, y, z), f"on {name!r}")

    def fix_node(
        self, index: int, x: float | None = None, y: float | None = None, z: float | None = None
    ) -> Support:
        """Prescribe components of the displacement of one node."""
        if not 0 <= index < len(self.value):
            raise ValueError(f"There is no node {index}; the body's nodes are 0 to {len(self.value) - 1}.")
        return self._prescribe(np.array([index]), (x, y, z), f"of node {index}")

    def platen(self, name: str | Sequence[str]) -> Support:
        """Tie the nodes of a boundary, or of several, into one: it translates, it does not tilt."""
        nodes = self.body.nodes(name)
        for other in self.platens:
            if np.intersect1d(nodes, other).size:
                raise ValueError(
                    f"The boundary {name!r} shares nodes with another platen; make them one boundary."
                )
        self.platens.append(nodes)
        return self

    def apply(self, A: sparse.bsr_array, load: np.ndarray) -> System:
        """Return the system with these supports.

        Parameters
        ----------
        A : (N dim, N dim), symmetric, in dim x dim blocks
        load : (N, dim) nodal forces

        Raises
        ------
        ValueError
            if the sizes do not fit, entries are not finite, or a platen has two different prescribed
            displacements.
        """
        N, dim = self.body.coordinates.shape
        load = np.asarray(load, dtype=float)
        if A.shape != (N * dim, N * dim) or load.shape != (N, dim):
            raise ValueError(
                f"The matrix is {A.shape} and the load {load.shape}; this body of {N} nodes needs "
                f"({N * dim}, {N * dim}) and ({N}, {dim})."
            )
        A = sparse.bsr_array(A, blocksize=(dim, dim))
        if not (np.isfinite(A.data).all() and np.isfinite(load).all()):
            raise ValueError("The matrix or the load has entries that are not finite numbers.")
        node_of, chosen = _collapse(N, self.platens)
        R = len(chosen)
        value = self._reduced_values(node_of, R)
        if self.platens:
            A = _renumber(A, node_of, R)
        summed = np.zeros((R, dim))
        np.add.at(summed, node_of, load)
        fixed = ~np.isnan(value)
        A, summed = _eliminate(A, summed, value, fixed)
        counts = np.bincount(node_of, minlength=R)[:, None]
        coordinates = np.zeros((R, dim))
        np.add.at(coordinates, node_of, self.body.coordinates)
        return System(A, summed, coordinates / counts, node_of, self._prolongations(chosen), fixed)

    def _prescribe(self, nodes: np.ndarray, components: Sequence[float | None], where: str) -> Support:
        dim = self.body.dim
        if dim == 2 and components[2] is not None:
            raise ValueError(f"A displacement z is prescribed {where}, but this body is in the plane.")
        if all(c is None for c in components):
            raise ValueError(
                f"No displacement is prescribed {where}; give at least one of {'x, y, z'[: 3 * dim - 2]}."
            )
        for component, value in enumerate(components):
            if value is None:
                continue
            if not np.isfinite(value):
                raise ValueError(
                    f"The prescribed displacement {where} is {value}; it must be a finite number."
                )
            self.value[nodes, component] = value
        return self

    def _reduced_values(self, node_of: np.ndarray, R: int) -> np.ndarray:
        """Prescribed displacements (R, dim) of the system's nodes, NaN where free."""
        low, high = np.full((R, self.body.dim), np.inf), np.full((R, self.body.dim), -np.inf)
        nodes, components = np.nonzero(~np.isnan(self.value))
        where = (node_of[nodes], components)
        np.minimum.at(low, where, self.value[nodes, components])
        np.maximum.at(high, where, self.value[nodes, components])
        if np.any((high > low) & np.isfinite(high)):
            raise ValueError(
                "Two nodes of one platen have different prescribed displacements; give them the same."
            )
        return np.where(np.isfinite(low), low, np.nan)

    def _prolongations(self, chosen: np.ndarray) -> list[sparse.csr_array]:
        """Prolongations between the meshes with each platen as one node on all of them.

        A node of the platen that is new on its mesh is the mean of coarse nodes of the platen, so its row
        collapses to a weight of 1 on the coarse platen by itself.
        """
        reduced = []
        tied = self.platens
        for P in self.body.prolongations if tied else []:
            coarse_of_copy = np.full(P.shape[0], -1)  # the coarse node that sits on each fine node, if any
            copies = np.flatnonzero(np.diff(P.indptr) == 1)
            coarse_of_copy[copies] = P.indices[P.indptr[copies]]
            tied = [np.sort(coarse_of_copy[nodes][coarse_of_copy[nodes] >= 0]) for nodes in tied]
            coarse_of, coarse_chosen = _collapse(P.shape[1], tied)
            rows = P[chosen]
            shape = (len(chosen), len(coarse_chosen))
            Q = sparse.csr_array((rows.data, coarse_of[rows.indices], rows.indptr), shape=shape)
            Q.sum_duplicates()
            reduced.append(narrow(Q))
            chosen = coarse_chosen
        return reduced if self.platens else list(self.body.prolongations)


def _collapse(N: int, groups: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Make one node of each group; return the new number of each node, the first node of each number."""
    first = np.arange(N)
    for nodes in groups:
        first[nodes] = nodes[0]
    chosen, node_of = np.unique(first, return_inverse=True)
    return node_of, chosen


def _renumber(A: sparse.bsr_array, node_of: np.ndarray, R: int) -> sparse.bsr_array:
    """Add up the blocks of nodes that have become one."""
    rows = np.repeat(node_of, np.diff(A.indptr))
    key = rows.astype(np.int64) * R + node_of[A.indices]
    order = np.argsort(key, kind="stable")  # quick: nearly sorted already
    key = key[order]
    start = np.flatnonzero(np.concatenate([[True], key[1:] != key[:-1]]))
    data = np.add.reduceat(A.data[order], start, axis=0)
    rows, columns = np.divmod(key[start], R)
    indptr = np.concatenate([[0], np.cumsum(np.bincount(rows, minlength=R))])
    dim = A.blocksize[0]
    columns, indptr = columns.astype(np.int32), indptr.astype(np.int32)
    return sparse.bsr_array((data, columns, indptr), shape=(R * dim, R * dim))


def _eliminate(
    A: sparse.bsr_array, load: np.ndarray, value: np.ndarray, fixed: np.ndarray
) -> tuple[sparse.bsr_array, np.ndarray]:
    """Move the effect of prescribed unknowns to the load and leave them a lone diagonal entry each."""
    if not fixed.any():
        return A, load
    prescribed = np.where(fixed, value, 0.0)
    diagonal = A.diagonal().reshape(fixed.shape)
    if prescribed.any():
        load = load - (A @ prescribed.ravel()).reshape(fixed.shape)
    load = np.where(fixed, diagonal * prescribed, load)
    rows = np.repeat(np.arange(len(fixed)), np.diff(A.indptr))
    held = fixed.any(axis=1)
    touched = np.flatnonzero(held[rows] | held[A.indices])
    data = A.data.copy()
    rows, columns = rows[touched], A.indices[touched]
    blocks = np.where(fixed[rows][:, :, None] | fixed[columns][:, None, :], 0.0, data[touched])
    own, component = np.nonzero((rows == columns)[:, None] & fixed[rows])
    blocks[own, component, component] = diagonal[rows[own], component]
    data[touched] = blocks
    return sparse.bsr_array((data, A.indices, A.indptr), shape=A.shape), load
