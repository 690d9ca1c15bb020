"""Meshes of the half cylinder on the road y = 0: one structured block, or a block mesh to refine.

Both use that the half disc is a conformal image of the upper half of the unit disc: z = 2 R s / (1 - i s)
takes the real axis to the arc, s = 0 to its lowest point and the unit circle to the flat face, so that what
is orthogonal and well shaped around s = 0 is so around the contact.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import brentq
from scipy.special import ellipj, ellipk, ellipkinc

from checks import number, one_of, positive, refused, whole
from geometry.grid import Grid, exterior_facets
from geometry.meshes.circle import SPACING, onto_circle, shell_sizes

CELLS = ("quadrilateral", "triangle")
ROUNDING = 0.3  # of the inner block, by eye: 0 for a square outline, 1 for a circular one


def half_cylinder(
    radius: float,
    columns: int = 40,
    layers: int = 19,
    spacing: float | None = None,
    contact_half_width: float | None = None,
    side: float = 0.15,
    cell: str = "quadrilateral",
) -> Grid:
    """Structured block of `columns` x `layers` quadrilaterals, graded towards the lowest point (0, 0).

    Columns run from the arc to the flat face; nodes are spaced evenly along the arc under the contact and
    geometrically beyond; in depth evenly to half as far, and geometrically beyond. The block has two of its
    corners on the arc: the quadrilaterals there have an angle of nearly 180 degrees, which a direct solver
    does not mind (`half_cylinder_nested` has none).

    Parameters
    ----------
    radius : float
        Of the cylinder; its centre is (0, radius).
    columns, layers : int
        Even number of cells along the arc, and cells from the arc to the flat face.
    spacing : float, optional
        Of the nodes on the arc under the contact, and of the first layer; default 0.0073 radius.
    contact_half_width : float, optional
        Arc length from the lowest point that is evenly spaced; default 0.09 radius.
    side : float
        Angle (radians, from the lowest point) of the block's corners on the arc.
    cell : str
        "quadrilateral", or "triangle" to cut each in four.

    Returns
    -------
    Grid
        With the boundaries "arc" and "top" (the flat face, y = radius), its own mirror image to the
        last bit.

    Raises
    ------
    ValueError
        for a radius that is not positive, another cell, an odd number of columns, or sizes that do not fit

    Examples
    --------
    >>> half_cylinder(radius=10.0).cells.shape
    (760, 4)
    """
    positive(radius=radius)
    one_of(CELLS, cell=cell)
    whole(2, columns=columns, layers=layers)
    spacing = SPACING * radius if spacing is None else spacing
    even = 0.09 * radius if contact_half_width is None else contact_half_width
    positive(spacing=spacing, contact_half_width=even)
    if columns < 4 or columns % 2:
        raise ValueError(
            f"The half cylinder has {columns} columns and {layers} layers; "
            "it needs an even number of columns, 4 or more, and 2 layers or more."
        )
    if not 0 < number(side) < np.pi / 2:
        raise refused("side", "an angle between 0 and pi/2", side)
    if not spacing <= even < side * radius:
        raise ValueError(
            f"The spacing {spacing:g} must be at most contact_half_width, {even:g}, and that "
            f"less than the arc length {side * radius} of the block's corners."
        )
    # Elliptic functions map a rectangle to the half plane of sigma = (s + 1/s)/2, where the block's corners
    # are +-1 (of the flat face) and +-1/k (on the arc).
    k = np.sin(side)
    evenly = max(1, min(round(even / spacing), columns // 2 - 1))
    s = np.tan(spacing * np.arange(evenly + 1) / radius / 2)
    x = ellipkinc(np.arcsin(2 * s / (k * (1 + s**2))), k**2)
    left, first = ellipk(k**2) - x[-1], x[-1] - x[-2]
    most = 2 * (evenly + int(left / first))
    if columns > most:
        raise ValueError(
            f"{columns} columns are too many for a spacing of {spacing:g}, from which they grow; take at "
            f"most {most}, or a smaller spacing."
        )
    rest = graded(left, columns // 2 - evenly, first)
    x = np.concatenate([x, x[-1] + rest[1:]])
    depth = graded(radius, layers, spacing, even / 2)
    t = depth / (2 * radius - depth)
    y = ellipkinc(np.append(np.pi / 2, np.arctan((1 / t[1:] - t[1:]) / 2)), 1 - k**2)
    sn, cn, dn, _ = (f[:, None] for f in ellipj(x, k**2))
    sn1, cn1, dn1, _ = ellipj(y, 1 - k**2)
    sigma = (sn * dn1 + 1j * cn * dn * sn1 * cn1) / (cn1**2 + (k * sn * sn1) ** 2)
    s_inside = 1 / (sigma + np.sqrt(sigma - 1) * np.sqrt(sigma + 1))
    z = _from_unit_disc(np.abs(s_inside.real) + 1j * np.abs(s_inside.imag), radius)
    z[:, -1] = z[:, -1].real + 1j * radius
    z[:, 0] = _on_arc(s_inside[:, 0].real, radius)
    z[-1] = _on_arc(s_inside[-1].real, radius)
    z[0], z[-1, -1] = 1j * depth, radius + 1j * radius
    grid = _sew([z.T], radius)
    return grid if cell == "quadrilateral" else grid.crossed()[0]


def half_cylinder_nested(
    radius: float, refinements: int = 0, inner_half_width: float | None = None, cell: str = "quadrilateral"
) -> Grid:
    """Block mesh of 56 quadrilaterals made for uniform refinement, refined so many times.

    A block of 4 x 2 quadrilaterals at the lowest point (0, 0) lies within shells of 8, each 1.65
    times larger than the one before; the last ends on the flat face. Every boundary node meets two
    quadrilaterals, but for the two right angles of the flat face. For multigrid give the coarse grid to
    `Body.from_grid(grid, refinements)`, which keeps the transfers.

    Parameters
    ----------
    radius : float
        Of the cylinder; its centre is (0, radius).
    refinements : int
        How many times to halve every edge; new nodes of the arc lie on the circle.
    inner_half_width : float, optional
        Arc length from the lowest point to the end of the inner block, best a little more than the half
        width of the contact; default 0.1 radius. A smaller one makes more shells.
    cell : str
        "quadrilateral", or "triangle" to cut each in four.

    Returns
    -------
    Grid
        With the boundaries "arc" and "top" (the flat face, y = radius), symmetric about x = 0.

    Examples
    --------
    >>> half_cylinder_nested(radius=10.0, refinements=1).cells.shape
    (224, 4)
    """
    positive(radius=radius)
    one_of(CELLS, cell=cell)
    whole(0, refinements=refinements)
    size = shell_sizes(radius, inner_half_width)
    b, rings = size[0], size[:, None] * np.exp(1j * np.pi / 8 * np.arange(5))
    square = b * np.array([1, 1 + 0.5j, 1 + 1j, 0.5 + 1j, 1j])
    rings[0] = (1 - ROUNDING) * square + ROUNDING * rings[0]
    rings[:, 4] = 1j * rings[:, 4].imag
    outline = rings[0]
    block = np.array(
        [
            [0, b / 2, outline[0]],
            [outline[4] / 2, (outline[1] + outline[2] + outline[3]) / 4, outline[1]],
            [outline[4], outline[3], outline[2]],
        ]
    )
    patches = [_from_unit_disc(patch, radius) for patch in (block, rings.T)]
    patches[0][0] = _on_arc(block[0].real, radius)
    patches[1][0] = _on_arc(rings[:, 0].real, radius)
    patches[1][:, -1] = patches[1][:, -1].real + 1j * radius
    patches[1][0, -1] = radius + 1j * radius
    grid = _sew(patches, radius)
    for _ in range(refinements):
        grid, _ = grid.refine()
    return grid if cell == "quadrilateral" else grid.crossed()[0]


def graded(length: float, cells: int, first: float, even: float = 0.0) -> np.ndarray:
    """Return positions from 0 to `length`, `first` apart up to about `even`, then geometrically."""
    evenly = min(max(round(even / first), 0), cells - 1)
    rest = cells - evenly
    if not 0 < first * cells < length:
        raise ValueError(
            f"{cells} cells, the smallest {first} long, do not fit a length of {length}; take less than "
            f"{length / cells}."
        )

    def excess(growth: float) -> float:
        return first * (evenly + np.sum(growth ** np.arange(1.0, rest + 1))) - length

    growth = brentq(excess, 1.0, (length / first) ** (1 / rest), xtol=1e-14)
    steps = first * np.concatenate([np.ones(evenly), growth ** np.arange(1.0, rest + 1)])
    return np.concatenate([[0.0], np.cumsum(steps)[:-1], [length]])


def _from_unit_disc(s: np.ndarray, radius: float) -> np.ndarray:
    """Map the upper half of the unit disc to the half cylinder."""
    return 2 * radius * s / (1 - 1j * s)


def _on_arc(s: np.ndarray, radius: float) -> np.ndarray:
    """Map real s to the arc; to the last digit also where x^2 is lost beside the radius."""
    return 2 * radius * (s + 1j * s**2) / (1 + s**2)


def _sew(patches: list[np.ndarray], radius: float) -> Grid:
    """Join patches (rows, columns) of complex positions in x >= 0 and their mirror images."""
    positions, cells, count = [], [], 0
    for patch in [*patches, *(-np.conj(patch[:, ::-1]) for patch in patches)]:
        node = count + np.arange(patch.size).reshape(patch.shape)
        corners = [node[:-1, :-1], node[:-1, 1:], node[1:, :-1], node[1:, 1:]]
        cells.append(np.stack(corners, axis=-1).reshape(-1, 4))
        positions.append(patch.ravel() + 0.0)
        count += patch.size
    points, copy = np.unique(np.concatenate(positions), return_inverse=True)
    points = np.stack([points.real, points.imag], axis=1) + 0.0
    grid = Grid(points, copy[np.concatenate(cells)], "quadrilateral")
    edges = exterior_facets(grid)
    top = (grid.points[edges, 1] == radius).all(axis=1)
    grid.facets = {"arc": edges[~top], "top": edges[top]}
    grid.snap = {"arc": onto_circle(radius)}
    return grid
