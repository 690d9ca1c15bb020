"""Structured meshes of rectangles and boxes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from checks import function, named, number, one_of, positive, refused, vector, whole
from geometry.grid import Grid

SIDES = {
    2: (("left", "right"), ("bottom", "top")),
    3: (("left", "right"), ("front", "back"), ("bottom", "top")),
}
# Kuhn's six tetrahedra of a hexahedron: paths from corner 0 to corner 7, one for each order of the axes.
KUHN = [[0, 1, 3, 7], [0, 1, 5, 7], [0, 2, 3, 7], [0, 2, 6, 7], [0, 4, 5, 7], [0, 4, 6, 7]]


def rectangle(
    width: float,
    height: float,
    columns: int,
    rows: int,
    cell: str = "quadrilateral",
    corner: Sequence[float] = (0.0, 0.0),
    distortion: float = 0.0,
    seed: int = 0,
    regions: Mapping[str, Callable[[np.ndarray], np.ndarray]] | None = None,
) -> Grid:
    """Structured mesh of a rectangle, with the boundaries "left", "right", "bottom" and "top".

    Parameters
    ----------
    width, height : float
        Lengths along x and y.
    columns, rows : int
        Cells along x and y.
    cell : str
        "quadrilateral" or "triangle".
    corner : (2,)
        Position of the lower left corner.
    distortion : float
        Each node is moved at random by up to this part (0 to 0.5) of the spacing; nodes of the boundary
        move along it, corners stay.
    seed : int
        Of the random numbers.
    regions : mapping, optional
        {name: function from cell centres (n, 2) to a mask (n,)}.

    Examples
    --------
    >>> strip = rectangle(2.0, 0.5, columns=8, rows=2, corner=(-1.0, 0.0))
    >>> strip.points.shape, strip.cells.shape, sorted(strip.facets)
    ((27, 2), (16, 4), ['bottom', 'left', 'right', 'top'])
    """
    positive(width=width, height=height)
    whole(1, columns=columns, rows=rows)
    return _block((width, height), (columns, rows), cell, corner, distortion, seed, regions)


def box(
    width: float,
    depth: float,
    height: float,
    columns: int,
    layers: int,
    rows: int,
    cell: str = "hexahedron",
    corner: Sequence[float] = (0.0, 0.0, 0.0),
    distortion: float = 0.0,
    seed: int = 0,
    regions: Mapping[str, Callable[[np.ndarray], np.ndarray]] | None = None,
) -> Grid:
    """Structured mesh of a box: x from "left" to "right", y from "front" to "back", z from "bottom" to "top".

    Parameters
    ----------
    width, depth, height : float
        Lengths along x, y and z.
    columns, layers, rows : int
        Cells along x, y and z.
    cell : str
        "hexahedron" or "tetrahedron".
    corner, distortion, seed, regions : (3,), float, int, mapping
        As for `rectangle`.

    Examples
    --------
    >>> box(1.0, 1.0, 2.0, columns=2, layers=2, rows=4).cells.shape
    (16, 8)
    """
    positive(width=width, depth=depth, height=height)
    whole(1, columns=columns, layers=layers, rows=rows)
    return _block((width, depth, height), (columns, layers, rows), cell, corner, distortion, seed, regions)


def _block(
    lengths: tuple[float, ...],
    counts: tuple[int, ...],
    cell: str,
    corner: Sequence[float],
    distortion: float,
    seed: int,
    regions: Mapping[str, Callable[[np.ndarray], np.ndarray]] | None,
) -> Grid:
    dim = len(lengths)
    allowed = {2: ("quadrilateral", "triangle"), 3: ("hexahedron", "tetrahedron")}[dim]
    one_of(allowed, cell=cell)
    if not 0 <= number(distortion) < 0.5:
        raise refused("distortion", "a number of at least 0 and below 0.5", distortion)
    lowest = vector("corner", corner, dim)
    whole(0, seed=seed)
    masks = named("regions", regions)
    for name, inside in masks.items():
        function(**{f"the region {name!r}": inside})
    lattice = np.stack(np.meshgrid(*(np.arange(n + 1) for n in counts), indexing="ij"), axis=-1)
    lattice = _first_axis_fastest(lattice)
    spacing = np.array(lengths) / np.array(counts)
    shift = np.random.default_rng(seed).uniform(-distortion, distortion, lattice.shape)
    shift[(lattice == 0) | (lattice == np.array(counts))] = 0.0
    points = lowest + (lattice + shift) * spacing

    stride = np.cumprod([1, *(n + 1 for n in counts[:-1])])
    origins = lattice[(lattice < np.array(counts)).all(axis=1)] @ stride
    steps = np.array([sum(s for axis, s in enumerate(stride) if v >> axis & 1) for v in range(2**dim)])
    cells = origins[:, None] + steps
    facets = {}
    for axis, names in enumerate(SIDES[dim]):
        flat = [v for v in range(2**dim) if not v >> axis & 1]
        for name, end, place in zip(names, (0, counts[axis] - 1), (0, 1)):
            here = lattice[origins][:, axis] == end
            facets[name] = origins[here][:, None] + steps[flat] + place * stride[axis]
    grid = Grid(points, cells, allowed[0], facets)
    if cell == "triangle":
        grid = grid.halved()
    if cell == "tetrahedron":
        facets = {name: rows[:, [[0, 1, 3], [0, 2, 3]]].reshape(-1, 3) for name, rows in facets.items()}
        grid = Grid(points, cells[:, KUHN].reshape(-1, 4), cell, facets)
    centres = grid.points[grid.cells].mean(axis=1)
    grid.regions = {name: np.flatnonzero(inside(centres)) for name, inside in masks.items()}
    return grid


def _first_axis_fastest(lattice: np.ndarray) -> np.ndarray:
    dim = lattice.shape[-1]
    return lattice.transpose(*range(dim - 1, -1, -1), dim).reshape(-1, dim)
