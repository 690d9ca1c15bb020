"""Rigid roads: where is the nearest point, how far, and which way is out."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from checks import numbers, said, vector


class Road(Protocol):
    """What every road can do: find the nearest point of its surface.

    Examples
    --------
    >>> import numpy as np
    >>> from geometry import Road
    >>> class Ceiling(Road):  # a road of one's own says where its nearest points are
    ...     def closest(self, points):
    ...         nearest = np.column_stack([points[:, 0], np.ones(len(points))])
    ...         return 1.0 - points[:, 1], np.tile([0.0, -1.0], (len(points), 1)), nearest
    >>> Ceiling().closest(np.array([[0.0, 0.25]]))[0]
    array([0.75])
    """

    def closest(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return gap (n,), normal (n, dim) from the road into the body, and closest point (n, dim).

        The gap is positive above the road; point = closest point + gap * normal.
        """
        ...


def check_points(road: object, dim: int, points: np.ndarray) -> np.ndarray:
    """Return points (n, dim), or raise the ValueError that says that the road is not made for them."""
    points = np.ascontiguousarray(numbers("points", points))
    if points.ndim != 2 or points.shape[1] != dim:
        remedy = "give a road of the plane, say a profile over x"
        if dim == 2:
            remedy = "draw it out sideways by ExtrudedRoad, or give a road in space"
        raise ValueError(
            f"This {type(road).__name__} has {dim} dimensions, but the body's points have shape "
            f"{points.shape}; {remedy}."
        )
    return points


class Plane:
    """A flat road through `point`; `normal`, of any length, points from the road to the body.

    By default it is the level through the origin, under bodies in the plane and in space alike: the last
    coordinate points up.

    Examples
    --------
    >>> import numpy as np
    >>> from geometry import Plane
    >>> gap, normal, nearest = Plane(normal=(3.0, 4.0)).closest(np.array([[3.0, 4.0]]))
    >>> gap.round(9), normal.round(9)
    (array([5.]), array([[0.6, 0.8]]))
    """

    flat = True  # its tangent planes are itself, so that one problem solves a scene

    def __init__(self, point: Sequence[float] | None = None, normal: Sequence[float] | None = None):
        self._any_dimension = point is None and normal is None
        at = None if point is None else vector("point", point, 2, 3)
        up = None if normal is None else vector("normal", normal, 2, 3)
        dim = next((known.size for known in (at, up) if known is not None), 2)
        self.point = np.zeros(dim) if at is None else at
        direction = np.eye(dim)[-1] if up is None else up
        if self.point.shape != direction.shape:
            raise ValueError(
                f"The plane's point {said(point)} and normal {said(normal)} must both have 2, or both 3, "
                "components."
            )
        largest = np.abs(direction).max()
        if largest == 0:
            raise ValueError(f"The plane's normal is {normal}; it must not be zero.")
        direction = direction / largest
        self.normal = direction / np.linalg.norm(direction)

    def closest(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return gap (n,), normal (n, dim) and closest point (n, dim) for points (n, dim)."""
        if self._any_dimension and np.ndim(points) == 2 and np.shape(points)[1] == 3:
            return Plane((0.0, 0.0, 0.0)).closest(points)
        points = check_points(self, self.point.size, points)
        gap = (points - self.point) @ self.normal
        normal = np.empty_like(points)
        normal[:] = self.normal
        return gap, normal, points - gap[:, None] * normal
