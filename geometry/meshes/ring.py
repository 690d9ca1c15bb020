"""Structured mesh of a ring."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from checks import positive, vector, whole
from geometry.grid import Grid
from geometry.meshes.circle import onto_circle


def ring(
    outer: float, inner: float, around: int = 60, across: int = 5, lowest: Sequence[float] = (0.0, 0.0)
) -> Grid:
    """Ring of `around` x `across` quadrilaterals, with the boundaries "outer" and "inner".

    Parameters
    ----------
    outer, inner : float
        Radii.
    around, across : int
        Cells along the circles, an even number, and from one circle to the other.
    lowest : (2,)
        The ring's lowest point; a node lies exactly there.

    Returns
    -------
    Grid
        Symmetric about the vertical to the last bit; when it is refined, new nodes lie on the circles.

    Raises
    ------
    ValueError
        for radii that make no ring, or fewer than 6 x 1 cells

    Examples
    --------
    >>> wheel = ring(outer=0.5, inner=0.3, around=60, across=5)
    >>> wheel.cells.shape, float(wheel.points[:, 1].min())
    ((300, 4), 0.0)
    """
    positive(outer=outer, inner=inner)
    whole(1, around=around, across=across)
    base = vector("lowest", lowest, 2)
    if not inner < outer:
        raise ValueError(f"The radii are {outer} and {inner}; the inner one must be positive and smaller.")
    if around < 6 or around % 2:
        raise ValueError(
            f"The ring has {around} x {across} cells; it needs an even number around, 6 or more, "
            "and 1 or more across."
        )
    half = np.arange(around // 2 + 1)
    angle = 2 * np.pi * half / around
    sine, versine = np.sin(angle), 2 * np.sin(angle / 2) ** 2
    sine[-1] = 0.0
    mirrored = half[-2:0:-1]
    sine, versine = np.append(sine, -sine[mirrored]), np.append(versine, versine[mirrored])
    depth = (outer - inner) * np.arange(across + 1) / across  # from the outer circle inwards
    radius = outer - depth
    x = radius[:, None] * sine
    y = depth[:, None] + radius[:, None] * versine
    points = np.stack([x.ravel(), y.ravel()], axis=1) + base

    node = np.arange(len(points)).reshape(across + 1, around)
    turned = np.roll(node, -1, axis=1)
    cells = np.stack([node[:-1], turned[:-1], node[1:], turned[1:]], axis=-1).reshape(-1, 4)
    facets = {
        "outer": np.stack([node[0], turned[0]], axis=1),
        "inner": np.stack([node[-1], turned[-1]], axis=1),
    }
    innermost = (lowest[0], lowest[1] + outer - inner)
    snap = {"outer": onto_circle(outer, lowest), "inner": onto_circle(inner, innermost)}
    return Grid(points, cells, "quadrilateral", facets, {}, snap)
