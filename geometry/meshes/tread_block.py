"""Structured meshes of tyre treads: blocks on a common base, with grooves between them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from checks import positive, vector, whole
from geometry.grid import Grid, exterior_facets
from geometry.meshes.rectangle import box, rectangle


def tread_block(
    blocks: Sequence[int],
    size: Sequence[float],
    groove: Sequence[float],
    height: float,
    base: float,
    spacing: float,
) -> Grid:
    """Rectangular blocks in a row (2-D) or in rows (3-D), standing on the road below a common base.

    Parameters
    ----------
    blocks : (d - 1,) of int
        Their number along x, and in 3-D along y: (3,) or (3, 2).
    size : (d - 1,)
        Of a block along x, and in 3-D along y.
    groove : (d - 1,)
        Width of the grooves between them along x, and in 3-D along y.
    height : float
        Of the blocks, which is the depth of the grooves.
    base : float
        Thickness of the rubber above the grooves.
    spacing : float
        Of the nodes, about; halved by each refinement.

    Returns
    -------
    Grid
        From z = 0 (y = 0 in 2-D) upwards and symmetric about the other axes, with the boundaries
        "bottom" (the faces that may touch the road), "top", "sides" (the outer ones) and, where there
        are any, "grooves".

    Raises
    ------
    ValueError
        For lengths that are not positive, and numbers that do not fit each other.

    Examples
    --------
    >>> tread = tread_block(blocks=(3,), size=(20.0,), groove=(5.0,), height=8.0, base=4.0, spacing=2.0)
    >>> tread.dim, "grooves" in tread.facets
    (2, True)
    """
    axes, lengths = len(vector("blocks", blocks, 1, 2)), {"size": size, "groove": groove}
    for axis in range(axes):
        whole(1, **{f"blocks[{axis}]": blocks[axis]})
        positive(**{f"{name}[{axis}]": vector(name, of, axes)[axis] for name, of in lengths.items()})
    positive(height=height, base=base, spacing=spacing)
    across = [_lines(n, w, g, spacing) for n, w, g in zip(blocks, size, groove)]
    upwards = np.append(_steps(0, height, spacing), height + _steps(0, base, spacing)[1:])
    lines = [*(line for line, _ in across), upwards]
    counts = [len(line) - 1 for line in lines]
    if axes == 1:
        lattice = rectangle(1.0, 1.0, counts[0], counts[1])
    else:
        lattice = box(1.0, 1.0, 1.0, counts[0], counts[1], counts[2])
    place = np.rint(lattice.points * counts).astype(int)
    cell = place[lattice.cells].min(axis=1)  # column, (layer) and row of each cell
    empty = upwards[cell[:, -1]] < height * (1 - 1e-12)  # but for rounding
    empty &= np.any([in_groove[cell[:, axis]] for axis, (_, in_groove) in enumerate(across)], axis=0)
    cells = lattice.cells[~empty]
    used, number = np.unique(cells, return_inverse=True)
    points = np.stack([line[place[used, axis]] for axis, line in enumerate(lines)], axis=1)
    grid = Grid(points, number.reshape(cells.shape), lattice.cell)
    grid.facets = _named(grid, place[used], counts)
    return grid


def _lines(blocks: int, size: float, groove: float, spacing: float) -> tuple[np.ndarray, np.ndarray]:
    """Return mesh lines across blocks and grooves, symmetric about 0, and which cells are in grooves."""
    length = blocks * size + (blocks - 1) * groove
    pieces, in_groove, start = [np.array([-length / 2])], [], -length / 2
    for piece in range(2 * blocks - 1):
        width = groove if piece % 2 else size
        steps = _steps(start, width, spacing)
        pieces.append(steps[1:])
        in_groove.append(np.full(len(steps) - 1, bool(piece % 2)))
        start += width
    lines = np.concatenate(pieces)
    return (lines - lines[::-1]) / 2, np.concatenate(in_groove)


def _steps(start: float, length: float, spacing: float) -> np.ndarray:
    return start + length * np.linspace(0, 1, max(1, round(length / spacing)) + 1)


def _named(grid: Grid, place: np.ndarray, counts: list[int]) -> dict[str, np.ndarray]:
    """Sort the outer facets by the lattice planes that they lie in."""
    outside = exterior_facets(grid)
    at = place[outside]
    sides = np.zeros(len(outside), dtype=bool)
    for axis, count in enumerate(counts[:-1]):
        sides |= (at[:, :, axis] == 0).all(axis=1) | (at[:, :, axis] == count).all(axis=1)
    bottom, top = (at[:, :, -1] == 0).all(axis=1), (at[:, :, -1] == counts[-1]).all(axis=1)
    facets = {"bottom": outside[bottom], "top": outside[top], "sides": outside[sides]}
    grooves = outside[~(bottom | top | sides)]
    return facets | ({"grooves": grooves} if len(grooves) else {})
