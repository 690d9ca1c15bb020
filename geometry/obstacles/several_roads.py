"""Several obstacles in one scene: two plates, two walls, a floor and a step."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from itertools import combinations
from typing import Any

import numpy as np

from checks import is_road, refused
from geometry.obstacles.linear_road import TINY

STEPS = 30  # of the search for the nearest point of a corner, whose planes turn where roads are curved


class SeveralRoads:
    """Roads of which a body keeps off all.

    Outside all of them the nearest of their points counts. Below one, the nearest point that is below none:
    its own nearest point, or where that lies in another road, the corner that both make. There the normal is
    anywhere between those of the two, as in the hollows of `LinearRoad`, so that a node in a corner is held
    by both.

    Parameters
    ----------
    roads : which may overlap each other, and some of which may move

    Raises
    ------
    ValueError
        for no roads.

    Examples
    --------
    >>> import numpy as np
    >>> from geometry import Plane, SeveralRoads
    >>> corner = SeveralRoads([Plane((0, 0), (0, 1)), Plane((0, 0), (1, 0))])
    >>> gap, normal, foot = corner.closest(np.array([[3.0, 1.0], [-3.0, -4.0]]))
    >>> gap, foot
    (array([ 1., -5.]), array([[3., 0.],
           [0., 0.]]))
    """

    def __new__(cls, roads: Sequence[Any]) -> SeveralRoads:
        """Make the kind that can be asked where the roads are at a time, if any of them moves."""
        if isinstance(roads, str) or not isinstance(roads, Collection):
            raise refused("roads", "a list of roads, say [Plane(), RoundRoad()]", roads)
        moving = any(hasattr(road, "at") for road in roads)
        return super().__new__(SeveralMovingRoads if moving else SeveralRoads)

    def __init__(self, roads: Sequence[Any]):
        self.roads = list(roads)
        if not self.roads:
            raise refused("roads", "a list of one road or more, and this has no roads", roads)
        for road in self.roads:
            is_road(road)

    def closest(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return gap (n,), normal (n, dim) and closest point (n, dim) for points (n, dim)."""
        points = np.asarray(points, dtype=float)
        extent = np.ptp(points, axis=0).max(initial=0.0) if len(points) else 0.0
        tiny = TINY * (np.abs(points).max(initial=0.0) + extent)
        each, gaps = np.arange(len(points)), self._of_each(points)
        first = np.argmin(gaps[0], axis=0)
        gap, normal, foot = (values[first, each] for values in gaps)
        corner = (np.abs(gaps[0]) <= tiny).sum(axis=0) > 1
        below = np.flatnonzero(gap < 0)
        alone = np.full(len(below), -np.inf)  # gap to the road whose nearest point is below no other
        for one, (depth, its_normal, its_foot) in enumerate(zip(*gaps)):
            clear = (
                np.delete(self._of_each(its_foot[below])[0], one, axis=0).min(axis=0, initial=np.inf) >= -tiny
            )
            here = clear & (depth[below] < 0) & (depth[below] > alone)
            alone[here] = depth[below[here]]
            for values, its in ((gap, depth), (normal, its_normal), (foot, its_foot)):
                values[below[here]] = its[below[here]]
        corner[below[np.isinf(alone)]] = True
        for n in np.flatnonzero(corner):
            gap[n], normal[n], foot[n] = self._corner(points[n], tiny)
        return gap, normal, foot

    def which(self, points: np.ndarray) -> np.ndarray:
        """Return the number (n,) of the road whose surface is nearest to each point (n, dim)."""
        return np.argmin(np.abs(self._of_each(np.asarray(points, dtype=float))[0]), axis=0)

    def _corner(self, point: np.ndarray, tiny: float) -> tuple[float, np.ndarray, np.ndarray]:
        """Find the nearest point that is below no road, by Newton's method on their tangent planes."""
        x = point.copy()
        for _ in range(STEPS):
            gap, normal, _ = (values[:, 0] for values in self._of_each(x[None]))
            step, holding = _nearest_above(point - x, gap, normal, tiny)
            x = x + step
            if np.abs(step).max() <= tiny:
                break
        way = point - x
        distance = float(np.linalg.norm(way))
        if distance > tiny:
            return -distance, -way / distance, x
        mean = normal[holding or np.abs(gap) <= tiny].sum(axis=0)
        mean /= np.linalg.norm(mean)
        return float(mean @ way), mean, x

    def _of_each(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Gap (roads, n), normal and nearest point (roads, n, dim)."""
        gap, normal, foot = zip(*(road.closest(points) for road in self.roads))
        return np.array(gap), np.array(normal), np.array(foot)


class SeveralMovingRoads(SeveralRoads):
    """Several roads, some of which move."""

    def which(self, points: np.ndarray) -> np.ndarray:
        """Return the number (n,) of the road whose surface is nearest to each point (n, dim) at time 0."""
        return self.at(0.0).which(points)

    def at(self, time: float) -> SeveralRoads:
        """Return the roads where they are at `time`."""
        return SeveralRoads([_at(road, time) for road in self.roads])

    def carried(self, points: np.ndarray, start: float, end: float) -> np.ndarray:
        """Return where points (n, dim) that go with the road nearest to each have come to be."""
        gap = np.array([_at(road, start).closest(points)[0] for road in self.roads])
        moved = np.array(
            [road.carried(points, start, end) if hasattr(road, "at") else points for road in self.roads]
        )
        return moved[np.argmin(np.abs(gap), axis=0), np.arange(len(points))]


def _at(road: Any, time: float) -> Any:
    return road.at(time) if hasattr(road, "at") else road


def _nearest_above(
    wanted: np.ndarray, gap: np.ndarray, normal: np.ndarray, tiny: float
) -> tuple[np.ndarray, list[int]]:
    """The step d nearest to a wanted one with gap + normal . d >= 0 for all planes, and the planes it is on.

    By trying which planes hold it: none, one, two, in space three, with forces that push outwards.
    """
    best, best_distance, best_on = wanted, np.inf, []
    for count in range(len(wanted) + 1):
        for on in combinations(range(len(gap)), count):
            N, g = normal[list(on)], gap[list(on)]
            gram = N @ N.T
            if count and np.linalg.matrix_rank(gram) < count:
                continue
            force = np.linalg.solve(gram, -g - N @ wanted) if count else np.zeros(0)
            d = wanted + N.T @ force
            distance = np.linalg.norm(d - wanted)
            if (force >= -tiny).all() and (gap + normal @ d >= -tiny).all() and distance < best_distance:
                best, best_distance, best_on = d, distance, list(on)
    return best, best_on
