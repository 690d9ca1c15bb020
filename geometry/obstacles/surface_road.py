"""Roads of any shape: a triangulated surface in space, say from an STL file, and a polyline in the plane.

Which facet is nearest to a point is found by VTK's cell locator; nearest point, normal and side are those of
`geometry.obstacles.linear_road`, with whole wedges of normals at edges and corners.
"""

from __future__ import annotations

import os
from functools import cached_property
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import ArrayLike

from checks import is_path, numbers, positive, refused, whole_numbers
from geometry.meshes.mesh_file import read_raw
from geometry.obstacles.linear_road import (
    TINY,
    Surface,
    apart,
    closest_on_segment,
    closest_on_triangle,
    signed_gap,
)
from geometry.obstacles.plane import check_points

FLAT = 1e-14  # of the square of its longest side: the area of a triangle that rounding makes a line


class _FacetRoad:
    """Vertices (m, dim) and facets (f, dim), whose normals point to the body's side."""

    def __init__(self, points: np.ndarray, facets: np.ndarray, normals: np.ndarray):
        self.dim = points.shape[1]
        tiny = TINY * (np.abs(points).max() + np.ptp(points, axis=0).max())
        self._surface = Surface(points, facets, normals, None, tiny)
        self._at_corner = _corner_normals(points, facets, normals)
        self._at_edge = _edge_normals(facets, normals) if self.dim == 3 else np.empty((0, 0, 0))

    def closest(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return gap (n,), normal (n, dim) and closest point (n, dim) for points (n, dim)."""
        points = check_points(self, self.dim, points)
        gap, normal, foot = np.empty(len(points)), np.empty(points.shape), np.empty(points.shape)
        nearest = self._nearest_facets(points)
        _nearest_points(self._surface, self._at_corner, self._at_edge, nearest, points, gap, normal, foot)
        return gap, normal, foot

    def _nearest_facets(self, points: np.ndarray) -> np.ndarray:
        from vtkmodules.vtkCommonCore import reference

        find, nearest = self._locator.FindClosestPoint, np.empty(len(points), dtype=np.int64)
        facet: Any = reference(0)
        foot, part, square = [0.0, 0.0, 0.0], reference(0), reference(0.0)
        for n, point in enumerate(_in_space(points).tolist()):
            find(point, foot, facet, part, square)
            nearest[n] = facet.get()
        return nearest

    @cached_property
    def _locator(self) -> Any:
        from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray
        from vtkmodules.vtkCommonCore import vtkPoints
        from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData, vtkStaticCellLocator

        vertices, cells, data = vtkPoints(), vtkCellArray(), vtkPolyData()
        vertices.SetData(numpy_to_vtk(_in_space(self._surface.points), deep=True))
        cells.SetData(self.dim, numpy_to_vtkIdTypeArray(self._surface.facets.ravel(), deep=True))
        data.SetPoints(vertices)
        (data.SetPolys if self.dim == 3 else data.SetLines)(cells)
        locator = vtkStaticCellLocator()
        locator.SetDataSet(data)
        locator.BuildLocator()
        return locator

    def __getstate__(self) -> dict[str, Any]:
        """Leave out VTK's locator, which cannot be copied; it is built again."""
        return {name: value for name, value in self.__dict__.items() if name != "_locator"}


class SurfaceRoad(_FacetRoad):
    """A triangulated surface in space.

    The body is on the side from which the corners of the triangles go anticlockwise: the outside of a part
    whose surface is oriented outwards, as that of an STL file is. Where the surface ends it just ends; let it
    reach beyond the body.

    Parameters
    ----------
    points : (m, 3)
    triangles : (f, 3) numbers of points
    inside : the body is on the other side, in a hole

    Raises
    ------
    ValueError
        for points that are not finite, and triangles that name other points, or face different sides where
        they meet.

    Examples
    --------
    >>> import numpy as np
    >>> from geometry import SurfaceRoad
    >>> roof = SurfaceRoad([[0, 0, 1], [9, 0, 1], [0, 9, 1], [0, -9, 0]], [[0, 1, 2], [0, 3, 1]])
    >>> gap, normal, foot = roof.closest(np.array([[1.0, 1.0, 3.0]]))
    >>> gap, normal
    (array([2.]), array([[0., 0., 1.]]))
    """

    def __init__(self, points: ArrayLike, triangles: ArrayLike, inside: bool = False):
        vertices, corners = numbers("points", points), whole_numbers("triangles", triangles)
        if vertices.ndim != 2 or vertices.shape[1] != 3 or corners.ndim != 2 or corners.shape[1] != 3:
            raise ValueError(
                f"The surface has points of shape {vertices.shape} and triangles of shape {corners.shape}; "
                "(m, 3) and (f, 3) are needed."
            )
        _check_finite(vertices, "surface")
        if corners.size == 0 or corners.min() < 0 or corners.max() >= len(vertices):
            raise refused("triangles", f"numbers of points from 0 to {len(vertices) - 1}", triangles)
        vertices, number = np.unique(vertices, axis=0, return_inverse=True)  # one point where triangles meet
        corners = number.ravel()[corners]
        a, b, c = vertices[corners].transpose(1, 0, 2)
        across = np.cross(b - a, c - a)
        twice_area = np.linalg.norm(across, axis=1)
        longest = np.sum((np.stack([a, b, c]) - np.stack([b, c, a])) ** 2, axis=2).max(axis=0)
        solid = twice_area > FLAT * longest
        if not solid.any():
            raise ValueError("All triangles of the surface are lines or points.")
        corners, normals = corners[solid], across[solid] / twice_area[solid, None]
        _check_orientation(vertices, corners)
        super().__init__(vertices, corners, -normals if inside else normals)

    @classmethod
    def read(cls, path: str | os.PathLike, inside: bool = False, scale: float = 1.0) -> SurfaceRoad:
        """Read the triangles and quadrilaterals of a file: .stl, .ply, .obj, .off, .msh and others.

        Parameters
        ----------
        path : of the file
        inside : the body is on the other side, in a hole
        scale : the file's unit of length in the user's, 25.4 for a part in inches and a body in mm

        Raises
        ------
        ValueError
            if the file cannot be read, or has no surface.
        """
        positive(scale=scale)
        mesh = read_raw(is_path(path))
        triangles = [mesh.rows.get("triangle", np.empty((0, 3), dtype=np.int64))]
        for corners in ([0, 1, 3], [0, 3, 2]):
            triangles.append(mesh.rows.get("quadrilateral", np.empty((0, 4), dtype=np.int64))[:, corners])
        found = np.concatenate(triangles)
        if len(found) == 0 or mesh.points.shape[1] != 3:
            raise ValueError(f"{str(path)!r} has no surface in space; a rigid obstacle needs its triangles.")
        return cls(mesh.points * scale, found, inside)


class PolylineRoad(_FacetRoad):
    """A chain of segments in the plane that may hang over, or a closed polygon.

    The body is on the left when one walks from the first point to the last, which is above a profile over x;
    of a closed polygon it is outside, whichever way round. An open chain just ends; let it reach beyond the
    body.

    Parameters
    ----------
    points : (m, 2), in order; a polygon's first point is not repeated
    closed : join the last point to the first
    inside : the body is on the right, or in the polygon

    Raises
    ------
    ValueError
        for points that are not finite, too few, or the same as the one before.

    Examples
    --------
    >>> import numpy as np
    >>> from geometry import PolylineRoad
    >>> square = PolylineRoad([[0, 0], [1, 0], [1, 1], [0, 1]], closed=True)
    >>> square.closest(np.array([[0.5, 1.25], [0.5, 0.9]]))[0]
    array([ 0.25, -0.1 ])
    """

    def __init__(self, points: ArrayLike, closed: bool = False, inside: bool = False):
        chain = numbers("points", points)
        if chain.ndim != 2 or chain.shape[1] != 2 or len(chain) < 2 + closed:
            raise ValueError(
                f"The polyline has points of shape {chain.shape}; (m, 2) with m of {2 + closed} or more is "
                "needed."
            )
        _check_finite(chain, "polyline")
        count = len(chain) if closed else len(chain) - 1
        facets = np.stack([np.arange(count), (np.arange(count) + 1) % len(chain)], axis=1)
        along = chain[facets[:, 1]] - chain[facets[:, 0]]
        length = np.linalg.norm(along, axis=1)
        if not length.all():
            first, second = facets[np.argmin(length)]
            raise ValueError(
                f"Points {first} and {second} of the polyline are both at {chain[first]}; leave one out."
            )
        normals = np.stack([-along[:, 1], along[:, 0]], axis=1) / length[:, None]
        x, y = (chain - chain[0]).T
        anticlockwise = closed and np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)) > 0
        super().__init__(chain, facets, -normals if anticlockwise != inside else normals)


@njit(cache=True, error_model="numpy")
def _nearest_points(surface, at_corner, at_edge, nearest, points, gap, normal, foot):
    """Fill gap (n,), normal and foot (n, dim), of points whose nearest facets (n,) are known."""
    dim, best = points.shape[1], np.empty(2)
    for n in range(points.shape[0]):
        f = nearest[n]
        corners = surface.facets[f]
        mean = surface.normals[f]
        if dim == 2:
            closest_on_segment(surface.points[corners[0]], surface.points[corners[1]], points[n], foot[n])
        else:
            a, b, c = surface.points[corners[0]], surface.points[corners[1]], surface.points[corners[2]]
            closest_on_triangle(a, b, c, points[n], foot[n])
            for k in range(3):
                if _off_edge(surface, f, k, foot[n]) <= surface.tiny:
                    mean = at_edge[f, k]
        for k in range(dim):
            if apart(foot[n], surface.points[corners[k]]) <= surface.tiny:
                mean = at_corner[f, k]
        best[0], best[1] = apart(points[n], foot[n]), f
        gap[n] = signed_gap(surface, points[n], foot[n], mean, best, normal[n])


@njit(cache=True, error_model="numpy")
def _off_edge(surface, f, k, p):
    """Distance of p from edge k of triangle f."""
    nearest = np.empty(3)
    start, end = surface.facets[f, k], surface.facets[f, (k + 1) % 3]
    closest_on_segment(surface.points[start], surface.points[end], p, nearest)
    return apart(nearest, p)


def _corner_normals(points: np.ndarray, facets: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Sum of the normals that meet at each corner of each facet (f, k, dim), in space by their angles."""
    weight = np.ones(facets.shape)
    if points.shape[1] == 3:
        for k in range(3):
            one, other = (points[facets[:, (k + j) % 3]] - points[facets[:, k]] for j in (1, 2))
            cosine = np.sum(one * other, axis=1) / np.linalg.norm(one, axis=1) / np.linalg.norm(other, axis=1)
            weight[:, k] = np.arccos(np.clip(cosine, -1, 1))
    total = np.zeros(points.shape)
    for k in range(facets.shape[1]):
        np.add.at(total, facets[:, k], weight[:, k, None] * normals)
    return total[facets]


def _edge_normals(triangles: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Sum of the normals that meet at each edge of each triangle, (f, 3, 3)."""
    edges = np.sort(np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2), axis=2).reshape(-1, 2)
    _, number = np.unique(edges, axis=0, return_inverse=True)
    total = np.zeros((number.max() + 1, 3))
    np.add.at(total, number.ravel(), np.repeat(normals, 3, axis=0))
    return total[number.ravel()].reshape(-1, 3, 3)


def _check_orientation(points: np.ndarray, triangles: np.ndarray) -> None:
    """Refuse triangles that run along their common edge the same way (ValueError)."""
    edges = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2).reshape(-1, 2)
    distinct, count = np.unique(edges, axis=0, return_counts=True)
    if count.max() > 1:
        where = points[distinct[np.argmax(count)]].mean(axis=0)
        raise ValueError(
            f"{np.sum(count > 1)} edges of the surface are run along the same way by two triangles, one near "
            f"{where}, so that these face different sides; orient them, say by trimesh.repair.fix_winding."
        )


def _check_finite(points: np.ndarray, what: str) -> None:
    bad = ~np.isfinite(points).all(axis=1)
    if bad.any():
        first = int(np.argmax(bad))
        raise ValueError(f"Point {first} of the {what} is at {points[first]}; it must be finite.")


def _in_space(points: np.ndarray) -> np.ndarray:
    return np.column_stack([points, np.zeros(len(points))]) if points.shape[1] == 2 else points
