"""Joining and shifting of meshes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from checks import named, refused, vector
from geometry.grid import Grid, is_grid


def join(grids: Mapping[str, Grid]) -> Grid:
    """Put bodies that do not touch each other into one mesh, for one scene on one road.

    Parameters
    ----------
    grids : mapping
        {name: Grid}, all of one type of cells.

    Returns
    -------
    Grid
        Whose regions are the bodies, by name, and "NAME REGION" where a body has regions of its own,
        and whose boundaries are called "NAME BOUNDARY".

    Raises
    ------
    ValueError
        For no grids, or grids of different cells.

    Examples
    --------
    >>> from geometry import rectangle
    >>> left, right = rectangle(1.0, 1.0, 2, 2), rectangle(1.0, 1.0, 2, 2, corner=(1.5, 0.0))
    >>> sorted(join({"left": left, "right": right}).facets)[:2]
    ['left bottom', 'left left']
    """
    if not named("grids", grids):
        raise refused("grids", "a dictionary of one grid or more", grids)
    for name, grid in grids.items():
        is_grid(grid, f"grids[{name!r}]")
    kinds = {grid.cell for grid in grids.values()}
    if len(kinds) != 1:
        raise ValueError(
            f"The bodies have cells of types {sorted(kinds)}; only bodies of one type can be joined."
        )
    facets: dict[str, np.ndarray] = {}
    regions: dict[str, np.ndarray] = {}
    snap: dict[str, Callable[[np.ndarray], np.ndarray]] = {}
    node_sets: dict[str, np.ndarray] = {}
    nodes = cells = 0
    for name, grid in grids.items():
        facets |= {f"{name} {side}": rows + nodes for side, rows in grid.facets.items()}
        regions |= {f"{name} {region}": np.asarray(inside) + cells for region, inside in grid.regions.items()}
        regions[name] = np.arange(cells, cells + len(grid.cells))
        node_sets |= {f"{name} {some}": np.asarray(inside) + nodes for some, inside in grid.node_sets.items()}
        snap |= {f"{name} {side}": onto for side, onto in grid.snap.items()}
        nodes, cells = nodes + len(grid.points), cells + len(grid.cells)
    starts = np.cumsum([0, *(len(grid.points) for grid in grids.values())])
    return Grid(
        np.concatenate([grid.points for grid in grids.values()]),
        np.concatenate([grid.cells + start for grid, start in zip(grids.values(), starts)]),
        kinds.pop(),
        facets,
        regions,
        snap,
        node_sets,
    )


def shifted(grid: Grid, by: Sequence[float]) -> Grid:
    """Return the grid moved by a vector (dim,), with the shapes of its boundaries.

    Raises
    ------
    ValueError
        for a vector of another dimension, or not finite

    Examples
    --------
    >>> from geometry import rectangle
    >>> float(shifted(rectangle(1.0, 1.0, 2, 2), by=(0.0, 3.0)).points[:, 1].min())
    3.0
    """
    is_grid(grid)
    way = vector("by", by, grid.dim)

    def there(onto: Callable[[np.ndarray], np.ndarray]) -> Callable[[np.ndarray], np.ndarray]:
        return lambda points: onto(points - way) + way

    return replace(
        grid, points=grid.points + way, snap={name: there(onto) for name, onto in grid.snap.items()}
    )
