"""An elastic body: a dolfinx mesh with named boundaries and regions, checked at the door."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import scipy.sparse as sparse

from geometry import compat  # before dolfinx

from dolfinx import mesh as dolfinx_mesh  # isort: skip

from geometry.grid import LOCAL_FACETS, Grid, number_rows

KINDS = {
    dolfinx_mesh.CellType.triangle: "triangle",
    dolfinx_mesh.CellType.quadrilateral: "quadrilateral",
    dolfinx_mesh.CellType.tetrahedron: "tetrahedron",
    dolfinx_mesh.CellType.hexahedron: "hexahedron",
}


class Body:
    """A dolfinx mesh of degree 1 with what contact needs to know of it.

    Make one with `Body.from_grid`; the grid may come from a file, by `geometry.read_msh`.

    Attributes
    ----------
    mesh : dolfinx mesh, on this process alone
    cell : "triangle", "quadrilateral", "tetrahedron" or "hexahedron"
    dim : 2 or 3
    coordinates : (N, dim), in the order of the nodes, which is that of the degrees of freedom
    cells : (n, k) nodes of each cell, in dolfinx's order
    names : {name of a boundary: tag in `facet_tags`}
    facet_tags : dolfinx mesh tags of the named boundary facets
    facets : {name: (m, k_f) nodes of each facet of that boundary}
    regions : {name: cell indices}
    prolongations : scalar csr matrices, finest first: [0] is (N, N_1), [1] is (N_1, N_2), ...; empty if not
        nested. Each coarse node is also a fine one, whose row has the single weight 1.
    """

    def __init__(
        self,
        mesh: dolfinx_mesh.Mesh,
        facets: Mapping[str, np.ndarray],
        regions: Mapping[str, np.ndarray] | None = None,
        prolongations: Sequence[sparse.csr_array] = (),
    ):
        if mesh.topology.cell_type not in KINDS:
            raise ValueError(
                f"Cells of type {mesh.topology.cell_type.name} cannot be used; "
                "use triangles, quadrilaterals, tetrahedra or hexahedra."
            )
        self.mesh = mesh
        self.cell = KINDS[mesh.topology.cell_type]
        self.dim = mesh.topology.dim
        self.coordinates = np.ascontiguousarray(mesh.geometry.x[:, : self.dim])
        self.cells = np.asarray(compat.geometry_dofmap(mesh))
        self.facets = {name: np.asarray(rows) for name, rows in facets.items()}
        self.regions = {name: np.asarray(cells) for name, cells in (regions or {}).items()}
        self.prolongations = list(prolongations)
        self.names = {name: tag for tag, name in enumerate(self.facets, start=1)}
        self.facet_tags = self._tag_facets()

    @classmethod
    def from_grid(cls, grid: Grid, refinements: int = 0, triangles: bool = False) -> Body:
        """Make the body of a grid, refined uniformly so many times.

        With `triangles`, the quadrilaterals of the finest mesh are then cut in four triangles each.

        The nodes of the coarser meshes are numbered in the order in which they appear on the finest, so that
        neighbours stay near each other in memory on every level.

        Raises
        ------
        ValueError
            for coordinates that are not finite, folded cells, unused nodes, and facets that no cell has.
        """
        check_grid(grid)
        transfers = []
        for _ in range(refinements):
            grid, transfer = grid.refine()
            transfers.append(transfer)
        if triangles:
            grid, transfer = grid.crossed()
            transfers.append(transfer)
        if transfers:
            check_orientation(grid)

        mesh = compat.create_mesh(grid.points, grid.cells, grid.cell)
        node_of = np.empty(len(grid.points), dtype=np.int64)  # node of each point of the grid
        node_of[mesh.geometry.input_global_indices] = np.arange(len(grid.points))
        cell_of = np.empty(len(grid.cells), dtype=np.int64)
        cell_of[mesh.topology.original_cell_index] = np.arange(len(grid.cells))

        prolongations = []
        order = np.argsort(node_of)  # point of the grid at each node
        for transfer in reversed(transfers):
            coarse = order[order < transfer.shape[1]]
            prolongations.append(narrow(transfer[order][:, coarse]))
            order = coarse
        return cls(
            mesh,
            {name: node_of[rows] for name, rows in grid.facets.items()},
            {name: np.sort(cell_of[cells]) for name, cells in grid.regions.items()},
            prolongations,
        )

    def nodes(self, name: str) -> np.ndarray:
        """Return the nodes of the boundary `name`, sorted.

        Raises
        ------
        ValueError
            if there is no such boundary; the sentence lists those that there are.
        """
        return np.unique(self.facets[self.check_name(name)])

    def check_name(self, name: str) -> str:
        """Return `name` if it is that of a boundary, or raise the ValueError that lists the names."""
        if name not in self.facets:
            known = ", ".join(repr(n) for n in self.facets) or "none at all"
            raise ValueError(f"There is no boundary {name!r} on this body; its boundaries are {known}.")
        return name

    def nearest_node(self, point: Sequence[float]) -> int:
        """Return the node nearest to a point."""
        return int(np.argmin(np.sum((self.coordinates - np.asarray(point)) ** 2, axis=1)))

    def _tag_facets(self) -> dolfinx_mesh.MeshTags:
        """Find the dolfinx index of every named facet."""
        mesh, fdim = self.mesh, self.dim - 1
        mesh.topology.create_entities(fdim)
        mesh.topology.create_connectivity(fdim, self.dim)
        mesh.topology.create_connectivity(fdim, 0)
        exterior = dolfinx_mesh.exterior_facet_indices(mesh.topology)
        node_of_vertex = np.empty(mesh.topology.index_map(0).size_local, dtype=np.int64)
        node_of_vertex[mesh.topology.connectivity(self.dim, 0).array] = self.cells.ravel()
        table = mesh.topology.connectivity(fdim, 0)
        width = len(LOCAL_FACETS[self.cell][0])
        vertices = table.array.reshape(-1, width)[exterior]
        rows = np.concatenate([node_of_vertex[vertices], *self.facets.values()])
        number = number_rows(np.sort(rows, axis=1))[1]
        index = np.full(number.max() + 1, -1)
        index[number[: len(exterior)]] = exterior
        tagged, values, start = [], [], len(exterior)
        for name, tag in self.names.items():
            count = len(self.facets[name])
            found = np.unique(index[number[start : start + count]])
            if count == 0 or found[0] < 0:
                raise ValueError(
                    f"The boundary {name!r} is empty or has facets inside the body; name outer facets only."
                )
            tagged.append(found)
            values.append(np.full(len(found), tag))
            start += count
        none = np.empty(0, dtype=np.int32)
        facets, tags = np.concatenate([none, *tagged]), np.concatenate([none, *values])
        if len(np.unique(facets)) < len(facets):
            raise ValueError("A facet belongs to two named boundaries; let each belong to one only.")
        order = np.argsort(facets)
        return dolfinx_mesh.meshtags(mesh, fdim, facets[order].astype(np.int32), tags[order].astype(np.int32))


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
    sign = np.where(corners > 1e-14 * scale[:, None], 1, np.where(corners < -1e-14 * scale[:, None], -1, 0))
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
