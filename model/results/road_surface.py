"""The surface of a rigid road as a mesh for ParaView: where the gap is zero."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from checks import is_road, numbers, refused

CELLS = {2: 500, 3: 64}  # of the grid that the road is drawn from, along the longest side of the box: a pixel
MARGIN = 0.1  # of that side, around what the road is drawn for


class RoadSurface(NamedTuple):
    """Facets of a road: points (n, dim) that lie on it, facets (m, dim) of them, and its normals (n, dim)."""

    points: np.ndarray
    facets: np.ndarray
    normal: np.ndarray


def road_surface(road: Any, around: np.ndarray, cells: int | None = None) -> RoadSurface:
    """Return the part of a road that lies around some points.

    The gap is measured on a grid over the points and the points of the road nearest to them; where it is
    zero is the road, of whatever shape. The vertices are then put onto the road exactly; bumps smaller than a
    cell of the grid may be missed.

    Parameters
    ----------
    road : geometry.Road
        Its `closest` gives gap (positive above, negative below), normal and nearest point.
    around : ndarray, shape (n, dim)
        Say all places of a body in a run.
    cells : int, optional
        Cells of the grid along its longest side; default 500 in the plane, 64 in space.

    Raises
    ------
    ValueError
        If the points are not finite, or the road shows nowhere within a tenth of the box around them.

    Examples
    --------
    >>> from geometry import RoundRoad
    >>> hole = RoundRoad((0.0, -2.0), (0.0, 1.0), -2.0)  # a body inside a circle of radius 2
    >>> surface = road_surface(hole, np.array([[-1.0, -1.0], [1.0, 1.0], [-1.0, 1.0], [1.0, -1.0]]))
    >>> bool(np.allclose(np.linalg.norm(surface.points, axis=1), 2.0))
    True
    """
    around = numbers("around", around)
    if around.ndim != 2 or around.shape[1] not in CELLS or not np.isfinite(around).all():
        raise ValueError(f"The road is drawn around points (n, 2) or (n, 3), all finite, not {around.shape}.")
    all_of_it = np.concatenate([around, road.closest(around)[2]])
    low, high = all_of_it.min(axis=0), all_of_it.max(axis=0)
    margin = MARGIN * (high - low).max() or 1.0
    low, high = low - margin, high + margin
    h = (high - low).max() / (cells or CELLS[len(low)])
    axes = [a + h * np.arange(np.ceil((b - a) / h) + 1) for a, b in zip(low, high)]
    where = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    gap = road.closest(where.reshape(-1, len(axes)))[0].reshape(where.shape[:-1])
    points, facets = (_lines if len(axes) == 2 else _triangles)(axes, gap)
    if not len(facets):
        raise ValueError(f"The road does not show between {low} and {high}; give points nearer to it.")
    _, normal, points = road.closest(points)
    return RoadSurface(points, facets, normal)


def write_road(path: str | Path, road: Any, around: np.ndarray, times: Sequence[float] = ()) -> None:
    """Write the surface of a road, with its height and normal, to NAME.xdmf and HDF5 beside it.

    Parameters
    ----------
    path : str or Path
        NAME.xdmf.
    road : geometry.Road, or a geometry.MovingRoad
    around : ndarray, shape (n, dim)
        As for `road_surface`.
    times : sequence of float, optional
        Of a moving road: a series, with how far it has moved as `displacement`.

    Raises
    ------
    ValueError
        As `road_surface`, or if the file cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> from geometry import Plane
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_road(f"{folder}/road.xdmf", Plane(), np.array([[0.0, 0.1], [1.0, 0.2]]))
    """
    instants = numbers("times", times)
    if instants.ndim != 1 or not np.isfinite(instants).all():
        raise refused("times", "a list of finite numbers", times)
    from model.results.xdmf import FacetMesh, Series, write_xdmf

    is_road(road)
    surface = road_surface(road.at(0.0) if hasattr(road, "at") else road, around)
    mesh = FacetMesh(surface.points, surface.facets)
    fields = {"height": surface.points[mesh.order, -1], "normal": surface.normal[mesh.order]}
    if not instants.size:
        write_xdmf(path, mesh, fields)
        return
    series = Series(path, mesh)
    moves = hasattr(road, "at")
    for time in instants.tolist():
        moved = road.carried(surface.points, 0.0, time) - surface.points if moves else 0.0 * surface.points
        series.write(time, fields | {"displacement": moved[mesh.order]})


def _lines(axes: list[np.ndarray], gap: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Segments of the lines of gap zero in the plane."""
    from contourpy import contour_generator

    lines: Any = contour_generator(axes[0], axes[1], gap.T).lines(0.0)
    points = np.concatenate([np.empty((0, 2)), *lines])
    ends = np.cumsum([len(line) for line in lines])
    first = np.setdiff1d(np.arange(len(points)), ends - 1)
    facets = np.stack([first, first + 1], axis=1)
    apart = np.linalg.norm(points[facets[:, 1]] - points[facets[:, 0]], axis=1) > 0
    return points, facets[apart]


def _triangles(axes: list[np.ndarray], gap: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Triangles of the surface of gap zero in space."""
    import pyvista

    spacing = [axis[1] - axis[0] for axis in axes]
    image = pyvista.ImageData(dimensions=gap.shape, spacing=spacing, origin=[axis[0] for axis in axes])
    image["gap"] = gap.ravel(order="F")
    surface = image.contour([0.0], scalars="gap").triangulate()
    return np.asarray(surface.points, dtype=float), surface.faces.reshape(-1, 4)[:, 1:].astype(np.int64)
