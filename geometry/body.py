"""An elastic body: a dolfinx mesh with named boundaries and regions, checked at the door."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sparse

from checks import function, named, refused, vector, whole
from geometry import compat  # before dolfinx

from dolfinx import fem  # isort: skip
from dolfinx import mesh as dolfinx_mesh  # isort: skip

from mpi4py import MPI  # isort: skip

from geometry.grid import LOCAL_FACETS, Grid, is_grid, number_rows
from geometry.partition import Shared, partition, share_mesh

FLAT = 1e-14  # of the size of a cell, to the power of its dimensions: a volume that may be rounding
KINDS = {
    dolfinx_mesh.CellType.triangle: "triangle",
    dolfinx_mesh.CellType.quadrilateral: "quadrilateral",
    dolfinx_mesh.CellType.tetrahedron: "tetrahedron",
    dolfinx_mesh.CellType.hexahedron: "hexahedron",
}


class Body:
    """A dolfinx mesh of degree 1 with what contact needs to know of it.

    Make one with `Body.from_grid`; the grid may come from a file, by `geometry.read_mesh`.

    Attributes
    ----------
    mesh : dolfinx mesh, on this process alone
    cell : "triangle", "quadrilateral", "tetrahedron" or "hexahedron"
    dim : 2 or 3
    coordinates : (N, dim), in the order of the nodes, which is that of the degrees of freedom
    cells : (n, k) nodes of each cell, in dolfinx's order
    facets : {name of a boundary: (m, k_f) nodes of each of its facets}; a facet may belong to several
    facet_tags : dolfinx mesh tags of the named boundary facets
    names : {name of a boundary: its tag in `facet_tags`, or all its tags where it shares facets with others},
        so that `ds(body.names["foot"])` is an integral over that boundary
    node_sets : {name: nodes}, for supports only
    regions : {name: cell indices}
    prolongations : scalar csr matrices, finest first: [0] is (N, N_1), [1] is (N_1, N_2), ...; empty if not
        nested. Each coarse node is also a fine one, whose row has the single weight 1.

    Examples
    --------
    >>> from geometry import Body, ring
    >>> body = Body.from_grid(ring(1.0, 0.8, 16, 2), refinements=1)
    >>> body.dim, body.cell, len(body.prolongations), sorted(body.facets)
    (2, 'quadrilateral', 1, ['inner', 'outer'])
    """

    def __init__(
        self,
        mesh: dolfinx_mesh.Mesh,
        facets: Mapping[str, np.ndarray],
        regions: Mapping[str, np.ndarray] | None = None,
        prolongations: Sequence[sparse.csr_array] = (),
        node_sets: Mapping[str, np.ndarray] | None = None,
        shared: Shared | None = None,
    ):
        if not isinstance(mesh, dolfinx_mesh.Mesh):
            raise refused("mesh", "a dolfinx mesh; of arrays make one by Body.from_grid", mesh)
        if mesh.topology.cell_type not in KINDS:
            raise ValueError(
                f"Cells of type {mesh.topology.cell_type.name} cannot be used; "
                "use triangles, quadrilaterals, tetrahedra or hexahedra."
            )
        self.mesh, self.shared = mesh, shared
        if shared is not None:
            share_mesh(mesh, shared)
        self.cell = KINDS[mesh.topology.cell_type]
        self.dim = mesh.topology.dim
        self.coordinates = np.ascontiguousarray(mesh.geometry.x[:, : self.dim])
        self.cells = np.asarray(compat.geometry_dofmap(mesh))
        self.facets: dict[str, np.ndarray] = {}
        self.node_sets = {name: np.asarray(nodes) for name, nodes in named("node_sets", node_sets).items()}
        self.regions = {name: np.asarray(cells) for name, cells in named("regions", regions).items()}
        self.prolongations = list(prolongations)
        self._indices: dict[str, np.ndarray] = {}  # dolfinx's numbers of the facets of each boundary
        self._name({name: np.asarray(rows) for name, rows in named("facets", facets).items()})

    @classmethod
    def from_grid(
        cls, grid: Grid, refinements: int = 0, triangles: bool = False, comm: Any = MPI.COMM_WORLD
    ) -> Body:
        """Make the body of a grid, refined uniformly so many times.

        With `triangles`, the quadrilaterals of the finest mesh are then cut in four triangles each.

        The nodes of the coarser meshes are numbered in the order in which they appear on the finest, so that
        neighbours stay near each other in memory on every level.

        On several ranks of `comm` the cells of the grid, the same on all, are shared out, and refined where
        they are; each rank then holds its own and those that touch them.

        Raises
        ------
        ValueError
            for coordinates that are not finite, folded cells, unused nodes, and facets that no cell has.
        """
        is_grid(grid)
        whole(0, refinements=refinements)
        check_grid(grid)
        transfers = []
        if comm.size > len(grid.cells):
            raise ValueError(
                f"The coarsest mesh has {len(grid.cells)} cells for {comm.size} ranks; use fewer ranks."
            )
        parts: list[Any] = [grid if comm.size == 1 else partition(grid, comm)]
        for number in range(refinements + triangles):
            part, transfer = parts[-1].refine() if number < refinements else parts[-1].crossed()
            parts.append(part)
            transfers.append(transfer)
        grid = parts[-1] if comm.size == 1 else parts[-1].grid
        if transfers:
            check_orientation(grid)

        mesh = compat.create_mesh(grid.points, grid.cells, grid.cell)
        node_of = np.empty(len(grid.points), dtype=np.int64)  # node of each point of the grid
        node_of[mesh.geometry.input_global_indices] = np.arange(len(grid.points))
        cell_of = np.empty(len(grid.cells), dtype=np.int64)
        cell_of[mesh.topology.original_cell_index] = np.arange(len(grid.cells))

        prolongations = []
        orders = [np.argsort(node_of)]  # point of the grid at each node
        for transfer in reversed(transfers):
            order = orders[-1]
            coarse = _coarse_points(transfer, order)
            prolongations.append(narrow(transfer[order][:, coarse]))
            orders.append(coarse)
        shared = None
        if comm.size > 1:
            levels = list(zip(reversed(parts), orders))
            shared = Shared(
                comm,
                [part.ids[order] for part, order in levels],
                [part.owner[order] for part, order in levels],
                np.sort(cell_of[np.flatnonzero(parts[-1].cell_owner == comm.rank)]),
                prolongations,
            )
        return cls(
            mesh,
            {name: node_of[rows] for name, rows in grid.facets.items()},
            {name: np.sort(cell_of[cells]) for name, cells in grid.regions.items()},
            prolongations,
            {name: np.sort(node_of[points]) for name, points in grid.node_sets.items()},
            shared,
        )

    def mark(self, name: str, where: Callable[[np.ndarray], np.ndarray]) -> Body:
        """Name the part of the boundary whose facets have all their nodes where a condition holds.

        Parameters
        ----------
        name : of the new boundary; its facets may belong to others too
        where : function of the positions x (3, n) of nodes that tells which are meant, (n,) of bool, as for
            dolfinx's `locate_entities_boundary`

        Returns
        -------
        Body : itself, so that marks can follow each other

        Raises
        ------
        ValueError
            if the name is taken, or no facet is there; the sentence says what the condition does hold for.

        Examples
        --------
        >>> from geometry import Body, rectangle
        >>> body = Body.from_grid(rectangle(width=2.0, height=1.0, columns=4, rows=2))
        >>> len(body.mark("foot", lambda x: (x[1] < 1e-9) & (x[0] <= 1)).facets["foot"])
        2
        """
        if not isinstance(name, str):
            raise refused("name", "a text", name)
        function(where=where)
        if name in self.facets or name in self.node_sets:
            raise ValueError(f"There is a boundary {name!r} on this body already; choose another name.")
        there = np.asarray(where(self.mesh.geometry.x.T))
        low, high = self.coordinates.min(axis=0), self.coordinates.max(axis=0)
        if there.shape != (len(self.coordinates),) or there.dtype != bool:
            raise ValueError(
                f"The condition of the boundary {name!r} must return True or False for each of the "
                f"{len(self.coordinates)} nodes; it returns {there.dtype} of shape {there.shape}."
            )
        rows = self._exterior[0]
        rows = rows[there[rows].all(axis=1)]
        if len(rows) == 0:
            raise ValueError(
                f"No facet of the surface has all its nodes where {name!r} is meant to be, though "
                f"{there.sum()} nodes of the body are there, which reaches from {low} "
                f"to {high}; widen the condition."
            )
        self._name({name: rows})
        return self

    @cached_property
    def space(self) -> fem.FunctionSpace:
        """The dolfinx space of displacements, vectors of degree 1; its nodes are numbered as the body's."""
        V = fem.functionspace(self.mesh, compat.lagrange(self.cell, (self.dim,)))
        if not np.array_equal(V.dofmap.list, self.cells):
            raise RuntimeError("dolfinx numbers degrees of freedom and nodes differently on this mesh.")
        return V

    def nodes(self, name: str | Sequence[str]) -> np.ndarray:
        """Return the nodes of a boundary or a node set, or of several, sorted.

        Raises
        ------
        ValueError
            if there is no such boundary; the sentence lists those that there are.
        """
        found = []
        for one in _listed(name):
            found.append(self.node_sets[one] if one in self.node_sets else self.facets[self.check_name(one)])
        return np.unique(np.concatenate([nodes.ravel() for nodes in found]))

    def facet_nodes(self, name: str | Sequence[str]) -> np.ndarray:
        """Return the nodes (m, k) of each facet of a boundary, or of several, each facet once.

        Raises
        ------
        ValueError
            for a name that is not there.
        """
        rows = np.concatenate([self.facets[self.check_name(one)] for one in _listed(name)])
        return rows[np.unique(np.sort(rows, axis=1), axis=0, return_index=True)[1]]

    def facet_indices(self, name: str | Sequence[str]) -> np.ndarray:
        """Return dolfinx's numbers of the facets of a boundary, or of several, sorted.

        Raises
        ------
        ValueError
            if there is no such boundary; the sentence lists those that there are.
        """
        return np.unique(np.concatenate([self._indices[self.check_name(one)] for one in _listed(name)]))

    def check_name(self, name: str) -> str:
        """Return `name` if it is that of a boundary, or raise the ValueError that lists the names."""
        if name in self.node_sets:
            raise ValueError(
                f"{name!r} is a set of nodes that make no facet; it can be supported, but here a boundary is "
                "needed."
            )
        if name not in self.facets:
            known = ", ".join(repr(n) for n in (*self.facets, *self.node_sets)) or "none at all"
            raise ValueError(f"There is no boundary {name!r} on this body; its boundaries are {known}.")
        return name

    def nearest_node(self, point: Sequence[float]) -> int:
        """Return the node nearest to a point; on several ranks -1 where it is not held."""
        square = np.sum((self.coordinates - vector("point", point, self.dim)) ** 2, axis=1)
        nearest = int(np.argmin(square))
        if self.shared is None:
            return nearest
        ids = self.shared.ids[0]
        chosen = min(self.shared.comm.allgather((float(square[nearest]), int(ids[nearest]))))[1]
        return int(np.argmax(ids == chosen)) if np.any(ids == chosen) else -1

    def total(self, values: np.ndarray) -> np.ndarray:
        """Return the sum (k,) of nodal values (N, k), over all ranks where there are several."""
        if self.shared is None:
            return np.asarray(values.sum(axis=0))
        return np.asarray(
            self.shared.comm.allreduce(values[self.shared.owner[0] == self.shared.comm.rank].sum(axis=0))
        )

    @cached_property
    def _exterior(self) -> tuple[np.ndarray, np.ndarray]:
        """Nodes (m, k_f) and dolfinx's numbers (m,) of the facets of the surface."""
        topology, fdim = self.mesh.topology, self.dim - 1
        topology.create_entities(fdim)
        topology.create_connectivity(fdim, self.dim)
        topology.create_connectivity(fdim, 0)
        exterior = dolfinx_mesh.exterior_facet_indices(topology)
        node_of_vertex = np.empty(topology.index_map(0).size_local, dtype=np.int64)
        node_of_vertex[topology.connectivity(self.dim, 0).array] = self.cells.ravel()
        width = len(LOCAL_FACETS[self.cell][0])
        vertices = topology.connectivity(fdim, 0).array.reshape(-1, width)[exterior]
        return node_of_vertex[vertices], exterior

    def _name(self, facets: dict[str, np.ndarray]) -> None:
        """Find the dolfinx index of every facet of new boundaries, and tag all anew."""
        nodes, exterior = self._exterior
        rows = np.concatenate([nodes, *facets.values()])
        number = number_rows(np.sort(rows, axis=1))[1]
        index = np.full(number.max() + 1, -1)
        index[number[: len(exterior)]] = exterior
        start = len(exterior)
        for name, facet in facets.items():
            found = np.unique(index[number[start : start + len(facet)]])
            if (len(facet) == 0 and self.shared is None) or np.any(found < 0):
                raise ValueError(
                    f"The boundary {name!r} is empty or has facets inside the body; name outer facets only."
                )
            self._indices[name] = found
            start += len(facet)
        self.facets |= facets
        self.names, self.facet_tags = self._tags()

    def _tags(self) -> tuple[dict[str, int | tuple[int, ...]], dolfinx_mesh.MeshTags]:
        """One tag for every set of boundaries that have a facet in common, those of one boundary first."""
        none = np.empty(0, dtype=np.int32)
        facets = np.unique(np.concatenate([none, *self._indices.values()]))
        belongs = np.zeros((len(facets), len(self._indices)), dtype=np.int64)
        for column, indices in enumerate(self._indices.values()):
            belongs[np.searchsorted(facets, indices), column] = 1
        alone = belongs.sum(axis=1) == 1
        values = belongs @ np.arange(1, belongs.shape[1] + 1)
        names: dict[str, int | tuple[int, ...]] = {name: k for k, name in enumerate(self._indices, start=1)}
        if not alone.all():
            values[~alone] = len(names) + 1 + number_rows(belongs[~alone])[1]
            tags = [tuple(np.unique(values[column == 1]).tolist()) for column in belongs.T]
            names = {name: of if len(of) > 1 else of[0] for name, of in zip(names, tags)}
        return names, dolfinx_mesh.meshtags(
            self.mesh, self.dim - 1, facets.astype(np.int32), values.astype(np.int32)
        )


def _coarse_points(transfer: sparse.csr_array, order: np.ndarray) -> np.ndarray:
    """Points of the coarser mesh in the order in which the finer one has them; the others after them."""
    copies = order[np.diff(transfer.indptr)[order] == 1]
    first = transfer.indices[transfer.indptr[copies]]
    return np.concatenate([first, np.setdiff1d(np.arange(transfer.shape[1]), first)])


def _listed(name: str | Sequence[str]) -> list[str]:
    """One name, or several, as a list; none at all is refused with a ValueError."""
    names = [name] if isinstance(name, str) or not isinstance(name, Iterable) else list(name)
    if not names or not all(isinstance(one, str) for one in names):
        raise refused("name", "that of a boundary, or a list of names", name)
    return names


def narrow(P: sparse.csr_array) -> sparse.csr_array:
    """Return P with sorted 32-bit indices, as dolfinx's matrices have them."""
    P.sort_indices()
    return sparse.csr_array((P.data, P.indices.astype(np.int32), P.indptr.astype(np.int32)), shape=P.shape)


def check_grid(grid: Grid) -> None:
    """Refuse a grid that cannot be computed with.

    Raises
    ------
    ValueError
        one sentence, with the first culprit.
    """
    points, cells = np.asarray(grid.points), np.asarray(grid.cells)
    if len(cells) == 0:
        raise ValueError("The mesh has no cells; give at least one.")
    if points.shape[1] != grid.dim:
        raise ValueError(
            f"Cells of type {grid.cell} need points with {grid.dim} coordinates, not {points.shape[1]}."
        )
    if not np.isfinite(points).all():
        culprit = int(np.argmin(np.isfinite(points).all(axis=1)))
        raise ValueError(
            f"Node {culprit} of the mesh is at {points[culprit]}; all coordinates must be finite numbers."
        )
    if cells.min() < 0 or cells.max() >= len(points):
        raise ValueError(
            f"A cell names a node outside 0 ... {len(points) - 1}; the mesh has {len(points)} nodes."
        )
    unused = np.bincount(cells.ravel(), minlength=len(points)) == 0
    if unused.any():
        raise ValueError(
            f"{np.count_nonzero(unused)} nodes of the mesh belong to no cell, the first is node "
            f"{np.argmax(unused)}; remove them."
        )
    check_orientation(grid)


def check_orientation(grid: Grid) -> None:
    """Refuse cells that are folded, flat, or turned inside out among their neighbours (ValueError)."""
    corners = _corner_jacobians(grid)
    scale = np.ptp(grid.points[grid.cells], axis=1).max(axis=1) ** grid.dim
    sign = np.where(corners > FLAT * scale[:, None], 1, np.where(corners < -FLAT * scale[:, None], -1, 0))
    folded = np.abs(sign.sum(axis=1)) < sign.shape[1]
    if folded.any():
        culprit = int(np.argmax(folded))
        raise ValueError(
            f"{np.count_nonzero(folded)} cells of the mesh are folded or flat, the first is cell {culprit} "
            f"near {grid.points[grid.cells[culprit]].mean(axis=0)}; move its nodes apart."
        )
    if np.ptp(sign[:, 0]) == 0:
        return
    inverted = _overlapping_pairs(grid)
    if len(inverted):
        raise ValueError(
            f"{len(inverted)} pairs of neighbouring cells overlap, the first are cells {inverted[0]} "
            f"near {grid.points[grid.cells[inverted[0][0]]].mean(axis=0)}; unfold them."
        )


CORNER_EDGES = {
    "triangle": [[0, 1, 2]],
    "quadrilateral": [[0, 1, 2], [1, 3, 0], [2, 0, 3], [3, 2, 1]],
    "tetrahedron": [[0, 1, 2, 3]],
    "hexahedron": [
        [0, 1, 2, 4], [1, 3, 0, 5], [2, 0, 3, 6], [3, 2, 1, 7],
        [4, 6, 5, 0], [5, 4, 7, 1], [6, 7, 4, 2], [7, 5, 6, 3],
    ],
}  # fmt: skip


def _corner_jacobians(grid: Grid) -> np.ndarray:
    """Return the determinant of the edges that leave each corner of each cell, (n, corners)."""
    corners = grid.points[grid.cells][:, CORNER_EDGES[grid.cell]]
    return np.linalg.det(corners[:, :, 1:] - corners[:, :, :1])


def _overlapping_pairs(grid: Grid) -> np.ndarray:
    """Return pairs of cells that lie on the same side of the facet they share, (pairs, 2)."""
    local = np.array(LOCAL_FACETS[grid.cell])
    facets = grid.cells[:, local].reshape(-1, local.shape[1])
    owner = np.repeat(np.arange(len(grid.cells)), len(local))
    number = number_rows(np.sort(facets, axis=1))[1]
    order = np.argsort(number, kind="stable")
    shared = np.flatnonzero(number[order][1:] == number[order][:-1])
    first, second = order[shared], order[shared + 1]
    corner = grid.points[facets[first][:, : grid.dim]]
    centre = grid.points[grid.cells].mean(axis=1)
    edges = corner[:, 1:] - corner[:, :1]
    sides = [
        np.linalg.det(np.concatenate([edges, (centre[owner[f]] - corner[:, 0])[:, None]], axis=1))
        for f in (first, second)
    ]
    return np.stack([owner[first], owner[second]], axis=1)[sides[0] * sides[1] > 0]
