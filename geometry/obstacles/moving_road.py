"""Roads made from other roads: moving with a velocity, looked for only when near, or drawn out sideways."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from geometry.obstacles.plane import Road, check_points


class ShiftedRoad:
    """Another road, translated by `shift`."""

    def __init__(self, road: Road, shift: ArrayLike):
        self.road, self.shift = road, _finite("shift", shift)

    def closest(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return gap (n,), normal (n, dim) and closest point (n, dim) for points (n, dim)."""
        points = check_points(self, self.shift.size, points)
        gap, normal, foot = self.road.closest(points - self.shift)
        return gap, normal, foot + self.shift


class MovingRoad:
    """A road that translates with a constant velocity, for sliding.

    Parameters
    ----------
    road : where it is at time 0
    velocity : dim components, length per time

    A node that sticks moves with the road: let its sticking position (`tangential_reference`) grow by
    `displacement(t)` from step to step.
    """

    def __init__(self, road: Road, velocity: ArrayLike):
        self.road, self.velocity = road, _finite("velocity", velocity)

    def displacement(self, time: float) -> np.ndarray:
        """Return how far (dim,) the road has moved by `time`."""
        return self.velocity * time

    def at(self, time: float) -> ShiftedRoad:
        """Return the road where it is at `time`."""
        return ShiftedRoad(self.road, self.displacement(time))


class RoadSeenFromAfar:
    """A road whose nearest point is sought for points near to it only, to save time.

    Parameters
    ----------
    road : of any kind, its normals with an upward last component
    summit : height that it nowhere exceeds
    reach : points that are higher than this above the summit see the level at the summit's height instead:
        their gaps are too small, and never smaller than `reach`
    """

    def __init__(self, road: Road, summit: float, reach: float):
        self.road, self.summit, self.reach = road, float(summit), float(reach)
        if not (np.isfinite(self.summit) and self.reach > 0):
            raise ValueError(
                f"The road's summit is {summit} and its reach {reach}; both must be finite, the reach > 0."
            )

    def closest(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return gap (n,), normal (n, dim) and closest point (n, dim) for points (n, dim)."""
        points = np.asarray(points, dtype=float)
        normal, foot = np.zeros_like(points), points.copy()
        normal[:, -1], foot[:, -1] = 1.0, self.summit
        gap = points[:, -1] - self.summit
        near = np.flatnonzero(gap <= self.reach)
        if near.size:
            gap[near], normal[near], foot[near] = self.road.closest(points[near])
        return gap, normal, foot


class ExtrudedRoad:
    """A road of the plane (x, height), the same for every y: a road for bodies in 3-D."""

    def __init__(self, road: Road):
        self.road = road

    def closest(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return gap (n,), normal (n, 3) and closest point (n, 3) for points (n, 3)."""
        points = check_points(self, 3, points)
        gap, in_plane, foot = self.road.closest(points[:, [0, 2]])
        normal = np.insert(in_plane, 1, 0.0, axis=1)
        return gap, normal, np.insert(foot, 1, points[:, 1], axis=1)


def _finite(name: str, vector: ArrayLike) -> np.ndarray:
    value = np.asarray(vector, dtype=float)
    if value.shape not in ((2,), (3,)) or not np.isfinite(value).all():
        raise ValueError(f"The road's {name} is {value}; it must be 2 or 3 finite numbers.")
    return value
