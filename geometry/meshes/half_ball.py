"""Block mesh of the lower half of a ball on the road z = 0, for uniform refinement.

As in the plane (half_cylinder.py), the half ball is a conformal image of the upper half of the unit ball,
by the same map in every plane through the axis: it takes the disc s_z = 0 to the sphere, s = 0 to its
lowest point and the unit hemisphere to the flat face, so that what is orthogonal and well shaped around s
= 0 is so around the contact.
"""

from __future__ import annotations

import numpy as np

from checks import one_of, positive, whole
from geometry.grid import Grid, exterior_facets, number_rows
from geometry.meshes.circle import onto_circle, shell_sizes

HALF = 2  # cells along half a side of the inner block
# Of the inner block: 0 for a cube, 1 for a ball; 0.5 makes angles of 120 degrees along its edges.
ROUNDING = 0.5
PARTS = {"quarter": (0, 0), "half": (-HALF, 0), "whole": (-HALF, -HALF)}  # lowest i and j of the lattice


def half_ball(
    radius: float, part: str = "whole", refinements: int = 0, inner_half_width: float | None = None
) -> Grid:
    """Block mesh of hexahedra for the lower half of a ball, refined so many times.

    A rounded block of 4 x 4 x 2 hexahedra at the lowest point (0, 0, 0) lies within shells of 48, each
    SHELL_GROWTH times larger than the one before; the last ends on the flat face. With the default width
    the whole has 320 hexahedra. No hexahedron has two faces on the sphere. For multigrid give the coarse
    grid to `Body.from_grid(grid, refinements)`, which keeps the transfers.

    Parameters
    ----------
    radius : float
        Of the ball; its centre is (0, 0, radius).
    part : str
        "whole", "half" (y >= 0) or "quarter" (x >= 0 and y >= 0).
    refinements : int
        How many times to halve every edge; new nodes of the sphere lie on it exactly.
    inner_half_width : float, optional
        Arc length from the lowest point to the middle of the inner block's side, best a little more
        than the radius of the contact; default 0.1 radius. A smaller one makes more shells.

    Returns
    -------
    Grid
        With the boundaries "sphere", "top" (the flat face, z = radius) and, where it is cut, "x0" (x =
        0) and "y0" (y = 0).

    Raises
    ------
    ValueError
        For a radius or width that is not positive, a width beyond the radius, and parts unknown.

    Examples
    --------
    >>> half_ball(10.0, part="quarter").cells.shape
    (80, 8)
    """
    positive(radius=radius)
    one_of(tuple(PARTS), part=part)
    whole(0, refinements=refinements)
    size = shell_sizes(radius, inner_half_width)
    shells = size.size - 1

    corners = _cells(PARTS[part], shells)  # (n, 8, 4): shell, i, j, k of every vertex
    rows = corners.reshape(-1, 4)
    first, number = number_rows(rows + [0, HALF, HALF, 0])
    node = rows[first]
    grid = Grid(_from_unit_ball(_positions(node, size), radius), number.reshape(-1, 8), "hexahedron")
    grid.points[node[:, 0] == shells, 2] = radius

    faces = exterior_facets(grid)
    shell, i, j, k = np.moveaxis(node[faces], -1, 0)
    sides = {"sphere": k == 0, "top": shell == shells, "x0": i == 0, "y0": j == 0}
    on_side = {name: faces[here.all(axis=1)] for name, here in sides.items()}
    grid.facets = {name: rows for name, rows in on_side.items() if len(rows)}
    grid.snap = {"sphere": onto_circle(radius, (0.0, 0.0, 0.0))}
    for _ in range(refinements):
        grid, _ = grid.refine()
    return grid


def _cells(low: tuple[int, int], shells: int) -> np.ndarray:
    """Vertices (n, 8, 4) of all hexahedra: shell (0: the block), and place i, j, k on the block's lattice."""
    i, j, k = (np.arange(start, HALF) for start in (*low, 0))
    block = _boxes(i, j, k)
    cells = [np.concatenate([np.zeros((*block.shape[:2], 1), dtype=int), block], axis=2)]
    end = np.array([HALF])
    faces = [
        _boxes(j, k, end)[:, :4, [2, 0, 1]],
        _boxes(k, i, end)[:, :4, [1, 2, 0]],
        _boxes(i, j, end)[:, :4],
    ]
    if low[0] < 0:
        faces.append(_boxes(k, j, -end)[:, :4, [2, 1, 0]])
    if low[1] < 0:
        faces.append(_boxes(i, k, -end)[:, :4, [0, 2, 1]])
    outside = np.concatenate(faces)
    for shell in range(shells):
        layers = [np.insert(outside, 0, shell + above, axis=2) for above in (0, 1)]
        cells.append(np.concatenate(layers, axis=1))
    return np.concatenate(cells)


def _boxes(*axes: np.ndarray) -> np.ndarray:
    """Vertices (n, 8, 3), first axis fastest, of unit boxes with lowest corners on the lattice of `axes`."""
    lowest = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 1, 3)
    return lowest + (np.arange(8)[:, None] >> np.arange(3) & 1)


def _positions(node: np.ndarray, size: np.ndarray) -> np.ndarray:
    """Positions (N, 3) in the half unit ball of nodes given by shell, i, j, k."""
    shell, place = node[:, 0], node[:, 1:]
    side = np.abs(place).max(axis=1)[:, None] / HALF  # 1 on the surface of the block, 0 in its middle
    cube = np.abs(place) / HALF
    ball = np.tan(np.pi / 4 * cube / np.maximum(side, 1 / HALF))
    ball = ball * (side / np.maximum(np.linalg.norm(ball, axis=1, keepdims=True), 1e-300))  # 0 in the middle
    rounding = np.where(shell[:, None] > 0, 1.0, ROUNDING * side**2)
    return np.sign(place) * size[shell][:, None] * ((1 - rounding) * cube + rounding * ball)


def _from_unit_ball(s: np.ndarray, radius: float) -> np.ndarray:
    """Map the upper half of the unit ball: in planes through the axis, z = 2 R s / (1 - i s)."""
    across = np.sum(s[:, :2] ** 2, axis=1)
    up = s[:, 2]
    stretch = 2 * radius / ((1 + up) ** 2 + across)
    return stretch[:, None] * np.stack([s[:, 0], s[:, 1], across + up**2 + up], axis=1)
