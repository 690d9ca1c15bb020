"""What a mesh file holds, whatever its format, and the grid that it makes."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from geometry.grid import DIMENSION, FACET, Grid, exterior_facets, number_rows

# The order in which dolfinx wants the vertices, which files list going around.
ORDER = {
    "vertex": [0],
    "interval": [0, 1],
    "triangle": [0, 1, 2],
    "quadrilateral": [0, 1, 3, 2],
    "tetrahedron": [0, 1, 2, 3],
    "hexahedron": [0, 1, 3, 2, 4, 5, 7, 6],
}
DIMENSIONS = {"vertex": 0, "interval": 1, **DIMENSION}
FLAT = 1e-12  # of its size: by how much the heights of a plane mesh may differ, which is rounding


@dataclass
class RawMesh:
    """Points, rows of every kind, and groups.

    Attributes
    ----------
    source : the file, as messages call it
    points : (n, 2) or (n, 3)
    rows : {"vertex", "interval", "triangle" or another kind: (m, k) points, in dolfinx's order}
    groups : {name: {kind: numbers of rows of that kind}}
    point_sets : {name: points}
    faces : {name: (m, k) points}, of facets that are named without being rows themselves
    others : names of the kinds that cannot be used
    grouped_only : whether such files hold nothing but what belongs to a group
    """

    source: str
    points: np.ndarray
    rows: dict[str, np.ndarray] = field(default_factory=dict)
    groups: dict[str, dict[str, np.ndarray]] = field(default_factory=dict)
    point_sets: dict[str, np.ndarray] = field(default_factory=dict)
    faces: dict[str, np.ndarray] = field(default_factory=dict)
    others: set[str] = field(default_factory=set)
    grouped_only: bool = False

    def add(self, kind: str, rows: np.ndarray, names: Iterable[str] = ()) -> None:
        """Add rows (m, k), listed going around, that belong to all these groups."""
        old = self.rows.get(kind, np.empty((0, rows.shape[1]), dtype=np.int64))
        self.rows[kind] = np.concatenate([old, np.asarray(rows, dtype=np.int64)[:, ORDER[kind]]])
        for name in names:
            self.put(name, kind, len(old) + np.arange(len(rows)))

    def put(self, name: str, kind: str, numbers: np.ndarray) -> None:
        """Put rows of a kind into a group."""
        group = self.groups.setdefault(name, {})
        group[kind] = np.union1d(group.get(kind, np.empty(0, dtype=np.int64)), numbers)

    def grid(self) -> Grid:
        """Return the grid: groups of cells are regions, those of facets boundaries, others node sets.

        Rows that are there twice count once. Points that no cell has are left out. A group of facets inside
        the body is a node set, and a set of points that is all the points of some facets a boundary.

        Raises
        ------
        ValueError
            one sentence, for meshes that are no body.
        """
        cell = self._cell()
        dim, facet = DIMENSION[cell], FACET[cell]
        distinct, new_number = _once(self.rows[cell])
        used, cells = np.unique(distinct, return_inverse=True)
        place = np.full(len(self.points), -1)
        place[used] = np.arange(len(used))
        grid = Grid(self.points[used, :dim].copy(), cells.reshape(distinct.shape), cell)

        regions, facets, sets = {}, dict(self.faces), dict(self.point_sets)
        for name, group in self.groups.items():
            for kind, numbers in group.items():
                rows = self.rows[kind][numbers]
                if kind == cell:
                    regions[name] = np.unique(new_number[numbers])
                elif kind == facet:
                    facets[name] = np.concatenate([facets.get(name, rows[:0]), rows])
                elif DIMENSIONS[kind] < dim - 1:
                    sets[name] = np.union1d(sets.get(name, rows[:0]), rows)
        grid.regions = {name: numbers for name, numbers in regions.items() if len(numbers)}
        grid.facets, grid.node_sets = _named(exterior_facets(grid), facets, sets, place)
        return grid

    def _cell(self) -> str:
        """Return the kind of the cells, or raise the ValueError that says why there is none."""
        dim = max((DIMENSIONS[kind] for kind, rows in self.rows.items() if len(rows)), default=0)
        kinds = sorted(kind for kind, rows in self.rows.items() if len(rows) and DIMENSIONS[kind] == dim)
        if self.others or len(kinds) != 1 and dim > 1:
            names = " and ".join([*sorted(self.others), *(f"{kind}s" for kind in kinds)])
            raise ValueError(
                f"The mesh of {self.source} has {names}; it must have triangles, quadrilaterals, tetrahedra "
                "or hexahedra of degree 1, of one kind only."
            )
        flat = dim > 1 and np.ptp(self._heights()) <= FLAT * np.ptp(self.points, axis=0).max()
        if dim == 3 or (dim == 2 and flat):
            return kinds[0]
        remedy = "give the body's cells too"
        if self.grouped_only:
            remedy = "put the cells in a physical group too, for gmsh saves only what belongs to one"
        if dim < 2:
            found = "facets, but no cells" if dim == 1 else "no cells"
            raise ValueError(f"The mesh of {self.source} has {found}; {remedy}.")
        raise ValueError(
            f"The mesh of {self.source} is a surface in space and has no cells; a plane mesh needs one z for "
            f"all nodes; for a body in space {remedy}; a rigid obstacle is read by SurfaceRoad.read."
        )

    def _heights(self) -> np.ndarray:
        used = np.unique(np.concatenate([rows.ravel() for rows in self.rows.values()]))
        return self.points[used, 2] if self.points.shape[1] == 3 else np.zeros(1)


def _once(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the distinct rows, in the order of their first copies, and which of them each row is."""
    first, number = number_rows(np.sort(rows, axis=1))
    order = np.argsort(first)
    rank = np.empty(len(order), dtype=np.int64)
    rank[order] = np.arange(len(order))
    return rows[first[order]], rank[number]


def _named(
    surface: np.ndarray, facets: dict[str, np.ndarray], sets: dict[str, np.ndarray], place: np.ndarray
) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Return boundaries and node sets, both by name, given where each point of the file has its place."""
    boundaries, node_sets = {}, {}
    for name, points in facets.items():
        rows = place[points]
        rows = rows[(rows >= 0).all(axis=1)]
        if len(rows) == 0:
            continue
        rows = _once(rows)[0]
        number = number_rows(np.sort(np.concatenate([surface, rows]), axis=1))[1]
        if np.isin(number[len(surface) :], number[: len(surface)]).any():
            boundaries[name] = rows
        else:
            node_sets[name] = np.unique(rows)
    for name, points in sets.items():
        nodes = np.unique(place[points])
        nodes = nodes[nodes >= 0]
        inside = surface[np.isin(surface, nodes).all(axis=1)]
        if name in boundaries or len(nodes) == 0:
            continue
        if np.array_equal(np.unique(inside), nodes):
            boundaries[name] = inside
        else:
            node_sets[name] = nodes
    return boundaries, node_sets
