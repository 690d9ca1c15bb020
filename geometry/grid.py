"""A mesh as plain arrays, and its uniform refinement with the transfer between the two."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from itertools import product
from typing import Any

import numpy as np
import scipy.sparse as sparse

from checks import named, numbers, one_of, refused, whole_numbers

FACET = {
    "quadrilateral": "interval",
    "triangle": "interval",
    "hexahedron": "quadrilateral",
    "tetrahedron": "triangle",
}
DIMENSION = {"quadrilateral": 2, "triangle": 2, "hexahedron": 3, "tetrahedron": 3}
LOCAL_FACETS = {
    "triangle": [[1, 2], [0, 2], [0, 1]],
    "quadrilateral": [[0, 1], [0, 2], [1, 3], [2, 3]],
    "tetrahedron": [[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]],
    "hexahedron": [[0, 1, 2, 3], [0, 1, 4, 5], [0, 2, 4, 6], [1, 3, 5, 7], [2, 3, 6, 7], [4, 5, 6, 7]],
}


def _tensor_pattern(dim: int) -> tuple[list[tuple[int, ...]], np.ndarray]:
    """Lattice of 3^dim nodes on a tensor-product cell and its 2^dim children.

    Each lattice node is given by the vertices of which it is the mean: one (a vertex), two (an edge), four (a
    face) or eight (the cell).
    """
    lattice = list(product(range(3), repeat=dim))
    corners = [corner[::-1] for corner in product(range(2), repeat=dim)]  # vertex i + 2 j + 4 k
    means = [
        tuple(v for v, corner in enumerate(corners) if all(x in (1, 2 * c) for x, c in zip(node, corner)))
        for node in lattice
    ]
    children = [
        [lattice.index(tuple(o + c for o, c in zip(origin, corner))) for corner in corners]
        for origin in corners
    ]
    return means, np.array(children)


def _simplex_pattern(
    vertices: int, children: list[list[tuple[int, ...]]]
) -> tuple[list[tuple[int, ...]], np.ndarray]:
    """Vertices and edge midpoints of a simplex and its children, each child given by such nodes."""
    means: list[tuple[int, ...]] = [(v,) for v in range(vertices)]
    means += [(a, b) for a in range(vertices) for b in range(a + 1, vertices)]
    return means, np.array([[means.index(node) for node in child] for child in children])


PATTERN = {
    "interval": _tensor_pattern(1),
    "quadrilateral": _tensor_pattern(2),
    "hexahedron": _tensor_pattern(3),
    "triangle": _simplex_pattern(
        3,
        [
            [(0,), (0, 1), (0, 2)],
            [(0, 1), (1,), (1, 2)],
            [(0, 2), (1, 2), (2,)],
            [(1, 2), (0, 2), (0, 1)],
        ],
    ),
    # Bey, Tetrahedral grid refinement, Computing 55 (1995): the octahedron in the middle is always cut along
    # the same diagonal (02)-(13), so that repeated refinement makes at most three shapes of each tetrahedron.
    "tetrahedron": _simplex_pattern(
        4,
        [
            [(0,), (0, 1), (0, 2), (0, 3)],
            [(0, 1), (1,), (1, 2), (1, 3)],
            [(0, 2), (1, 2), (2,), (2, 3)],
            [(0, 3), (1, 3), (2, 3), (3,)],
            [(0, 1), (0, 2), (0, 3), (1, 3)],
            [(0, 1), (0, 2), (1, 2), (1, 3)],
            [(0, 2), (0, 3), (1, 3), (2, 3)],
            [(0, 2), (1, 2), (1, 3), (2, 3)],
        ],
    ),
}


def number_rows(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Count off the distinct rows of an integer array.

    Parameters
    ----------
    rows : (m, k) nonnegative integers

    Returns
    -------
    first : (distinct,) position of the first copy of each distinct row
    number : (m,) which distinct row each row is
    """
    base = int(rows.max(initial=0)) + 1
    first, number = np.unique(rows[:, 0], return_index=True, return_inverse=True)[1:]
    for column in rows.T[1:]:
        key = number.astype(np.int64) * base + column
        first, number = np.unique(key, return_index=True, return_inverse=True)[1:]
    return first, number


@dataclass
class Grid:
    """A mesh as plain arrays.

    Parameters
    ----------
    points : (N, dim) float
    cells : (n, k) int, vertices in tensor-product order (quadrilateral: 0 and 3 are opposite corners)
    cell : "quadrilateral", "triangle", "hexahedron" or "tetrahedron"
    facets : named parts of the boundary, each (m, k_f) vertices
    regions : named sets of cells, each an array of cell indices
    snap : for some of the names in `facets`, a function (m, dim) -> (m, dim) that puts points onto the exact
        boundary
    node_sets : named sets of points, for supports

    Examples
    --------
    >>> import numpy as np
    >>> from geometry import Body, Grid
    >>> corners = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]])
    >>> square = Grid(corners, np.array([[0, 1, 2, 3]]), "quadrilateral", {"foot": np.array([[0, 1]])})
    >>> Body.from_grid(square, refinements=2).facets["foot"].shape
    (4, 2)
    """

    points: np.ndarray
    cells: np.ndarray
    cell: str
    facets: Mapping[str, np.ndarray] = field(default_factory=dict)
    regions: Mapping[str, np.ndarray] = field(default_factory=dict)
    snap: Mapping[str, Callable[[np.ndarray], np.ndarray]] = field(default_factory=dict)
    node_sets: Mapping[str, np.ndarray] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Refuse what are no arrays of a mesh; `Body.from_grid` looks at the mesh itself."""
        one_of(tuple(DIMENSION), cell=self.cell)
        self.points, self.cells = numbers("points", self.points), whole_numbers("cells", self.cells)
        corners = 1 + max(max(facet) for facet in LOCAL_FACETS[self.cell])
        if self.points.ndim != 2:
            raise refused("points", "an array (N, dim)", self.points)
        if self.cells.ndim != 2 or self.cells.shape[1] != corners:
            raise refused("cells", f"an array (n, {corners}) of numbers of points", self.cells)
        for name in ("facets", "regions", "snap", "node_sets"):
            named(name, getattr(self, name))

    @property
    def dim(self) -> int:
        """Number of space dimensions, 2 or 3."""
        return DIMENSION[self.cell]

    def refine(self) -> tuple[Grid, sparse.csr_array]:
        """Halve every edge.

        New nodes are means of the vertices of their edge, face or cell; those on a boundary with a `snap`
        function are then moved by it. Old nodes keep their numbers. Names of facets and regions pass on to
        the children.

        Returns
        -------
        finer : Grid, 4 (2-D) or 8 (3-D) cells for each
        transfer : (N_fine, N) weights; each row the mean that made the node, before snapping
        """
        names = list(self.facets)
        families = [self.cells] + [self.facets[name] for name in names]
        kinds = [self.cell] + [FACET[self.cell]] * len(names)
        lattices = [np.empty((len(f), len(PATTERN[k][0])), dtype=np.int64) for f, k in zip(families, kinds)]

        weights = [sparse.eye_array(len(self.points), format="csr")]
        for family, lattice, kind in zip(families, lattices, kinds):
            lattice[:, _positions(kind, 1)] = family[
                :, [mean[0] for mean in PATTERN[kind][0] if len(mean) == 1]
            ]
        for size in sorted({len(mean) for mean in PATTERN[self.cell][0]} - {1}):
            numbers, means = _number_means(families, kinds, size)
            offset = sum(w.shape[0] for w in weights)
            weights.append(_mean_of(means, len(self.points)))
            for lattice, kind, number in zip(lattices, kinds, numbers):
                lattice[:, _positions(kind, size)] = number + offset
        transfer = sparse.csr_array(sparse.vstack(weights, format="csr"))
        points = transfer @ self.points

        children = [
            lattice[:, PATTERN[kind][1]].reshape(-1, family.shape[1])
            for lattice, kind, family in zip(lattices, kinds, families)
        ]
        facets = dict(zip(names, children[1:]))
        for name, onto in self.snap.items():
            new = np.unique(facets[name])
            new = new[new >= len(self.points)]
            points[new] = onto(points[new])
        regions = _regions_of_children(self.regions, len(PATTERN[self.cell][1]))
        return Grid(
            points, children[0], self.cell, facets, regions, self.snap, self._sets_of_finer(transfer)
        ), transfer

    def _sets_of_finer(self, transfer: sparse.csr_array) -> dict[str, np.ndarray]:
        """Node sets of a finer mesh: a new node belongs where all those do of which it is the mean."""
        finer = {}
        for name, nodes in self.node_sets.items():
            inside = np.zeros(len(self.points))
            inside[nodes] = 1.0
            finer[name] = np.flatnonzero(transfer @ inside > 0.99)  # weights are eighths at least
        return finer

    def crossed(self) -> tuple[Grid, sparse.csr_array]:
        """Cut each quadrilateral in four triangles that meet at its centre.

        Boundary nodes all look alike on such a mesh, so that nodal pressures are as smooth as those of the
        quadrilaterals. Do it last: on triangles that are refined afterwards they are not (halves the order of
        the pressure in L2).

        Returns
        -------
        triangles : Grid
        transfer : (N + n, N) weights, as for `refine`
        """
        self._check_quadrilaterals()
        n = len(self.cells)
        centre = np.broadcast_to(len(self.points) + np.arange(n)[:, None], (n, 4))
        around = np.array([[0, 1], [1, 3], [3, 2], [2, 0]])
        cells = np.concatenate([self.cells[:, around], centre[:, :, None]], axis=2).reshape(-1, 3)
        transfer = sparse.csr_array(
            sparse.vstack([sparse.eye_array(len(self.points)), _mean_of(self.cells, len(self.points))])
        )
        regions = _regions_of_children(self.regions, 4)
        return (
            Grid(transfer @ self.points, cells, "triangle", self.facets, regions, self.snap, self.node_sets),
            transfer,
        )

    def halved(self) -> Grid:
        """Cut each quadrilateral in two triangles along its shorter diagonal."""
        self._check_quadrilaterals()
        corner = self.points[self.cells]
        first = np.linalg.norm(corner[:, 3] - corner[:, 0], axis=1)
        second = np.linalg.norm(corner[:, 2] - corner[:, 1], axis=1)
        along_first = (first < second * (1 + 1e-9))[:, None, None]  # equal ones all alike
        split = np.where(along_first, [[[0, 1, 3], [0, 3, 2]]], [[[0, 1, 2], [1, 3, 2]]])
        cells = np.take_along_axis(self.cells[:, None, :], split, axis=2).reshape(-1, 3)
        regions = _regions_of_children(self.regions, 2)
        return Grid(self.points, cells, "triangle", self.facets, regions, self.snap, self.node_sets)

    def _check_quadrilaterals(self) -> None:
        if self.cell != "quadrilateral":
            raise ValueError(f"Only quadrilaterals can be cut into triangles, not cells of type {self.cell}.")


def _regions_of_children(regions: Mapping[str, np.ndarray], per_cell: int) -> dict[str, np.ndarray]:
    """Cells of each region after every cell has been replaced by `per_cell` children in its place."""
    return {
        name: (np.asarray(cells)[:, None] * per_cell + np.arange(per_cell)).ravel()
        for name, cells in regions.items()
    }


def _positions(kind: str, size: int) -> list[int]:
    """Places on the lattice whose node is the mean of `size` vertices."""
    return [i for i, mean in enumerate(PATTERN[kind][0]) if len(mean) == size]


def _number_means(
    families: list[np.ndarray], kinds: list[str], size: int
) -> tuple[list[np.ndarray], np.ndarray]:
    """Count off the edges (size 2), faces (4) or cells (8) of all families together.

    Returns the numbers (cells, places) of each family and the vertices (distinct, size) of each number.
    """
    rows = []
    for family, kind in zip(families, kinds):
        local = [PATTERN[kind][0][i] for i in _positions(kind, size)]
        rows.append(family[:, np.array(local, dtype=np.int64).reshape(-1, size)].reshape(-1, size))
    stacked = np.sort(np.concatenate(rows), axis=1)
    first, number = number_rows(stacked)
    parts = np.split(number, np.cumsum([len(r) for r in rows])[:-1])
    places = [len(_positions(kind, size)) for kind in kinds]
    parts = [part.reshape(len(family), k) for part, family, k in zip(parts, families, places)]
    return parts, stacked[first]


def _mean_of(vertices: np.ndarray, columns: int) -> sparse.csr_array:
    """Rows that take the mean of their vertices (m, size)."""
    count, size = vertices.shape
    return sparse.csr_array(
        (np.full(count * size, 1.0 / size), vertices.ravel(), np.arange(0, count * size + 1, size)),
        shape=(count, columns),
    )


def is_grid(grid: Any, name: str = "grid") -> None:
    """Refuse what is no mesh as arrays (ValueError)."""
    if not isinstance(grid, Grid):
        raise refused(name, "a Grid, which rectangle, read_mesh and their like return", grid)


def exterior_facets(grid: Grid) -> np.ndarray:
    """Return the facets that belong to one cell only, (m, k_f) vertices."""
    local = np.array(LOCAL_FACETS[grid.cell])
    facets = grid.cells[:, local].reshape(-1, local.shape[1])
    first, number = number_rows(np.sort(facets, axis=1))
    return facets[first[np.bincount(number) == 1]]
