"""Everyday roads, and how a body is brought to them."""

from collections.abc import Callable

import numpy as np

from geometry import ExtrudedRoad, LinearRoad, Plane, Road, RoundRoad, SeveralRoads, ShiftedRoad, SmoothRoad


def two_walls(width: float, lean: float) -> Road:
    """Two plane walls, each leaning by an angle from the vertical, the bodies between them."""
    c, s = np.cos(lean), np.sin(lean)
    return SeveralRoads([Plane((-width / 2, 0.0), (c, s)), Plane((width / 2, 0.0), (-c, s))])


def plane(random: np.random.Generator, dim: int, size: float) -> Road:
    """A plane: level, a slope, or at any tilt."""
    normal = np.zeros(dim)
    normal[-1] = 1.0
    kind = random.random()
    if kind > 0.4:
        normal[:-1] = np.tan(random.uniform(-1.0, 1.0)) * _direction(random, dim - 1)
    if kind > 0.9:
        normal = _direction(random, dim)
    return Plane(np.zeros(dim), normal)


def groove(random: np.random.Generator, size: float) -> Road:
    """A V of two slopes of 10 to 70 degrees, alike or not."""
    slopes = np.tan(np.radians(random.uniform(10.0, 70.0, 2)))
    if random.random() < 0.5:
        slopes[1] = slopes[0]
    return LinearRoad(np.array([-20.0, 0.0, 20.0]) * size, np.array([slopes[0], 0.0, slopes[1]]) * 20 * size)


def step(random: np.random.Generator, size: float) -> Road:
    """A step up to the right, its face steep."""
    high, steep = random.uniform(0.02, 0.4) * size, random.uniform(0.01, 0.5)
    return LinearRoad(np.array([-20 * size, 0.0, steep * high, 20 * size]), np.array([0.0, 0.0, high, high]))


def bump(random: np.random.Generator, size: float) -> Road:
    """A smooth bump."""
    high, wide = random.uniform(0.02, 0.3) * size, random.uniform(0.1, 1.0) * size
    return SmoothRoad(lambda x: high * np.exp(-((x / wide) ** 2)), np.linspace(-15.0, 15.0, 301) * size)


def hill(random: np.random.Generator, size: float) -> Road:
    """A round hill."""
    return RoundRoad((0.0, 0.0), (0.0, 1.0), size * random.uniform(0.5, 5.0))


def hole(random: np.random.Generator, size: float) -> Road:
    """A round hole with the body in it."""
    return RoundRoad((0.0, 0.0), (0.0, 1.0), -size * random.uniform(1.1, 5.0))


def walls(random: np.random.Generator, size: float) -> Road:
    """Two walls, upright or leaning."""
    return two_walls(
        size * random.uniform(1.1, 1.6), 0.0 if random.random() < 0.3 else random.uniform(0.05, 0.8)
    )


CURVED: dict[str, Callable] = {
    "V groove": groove,
    "step": step,
    "bump": bump,
    "round hill": hill,
    "round hole": hole,
    "two walls": walls,
}


def brought(road: Road, points: np.ndarray, way: np.ndarray, size: float, gap: float) -> Road:
    """Shift a road so that the nearest of the points (n, d), moved back along `way` (d,), has that gap.

    Far from the road the points go down along `way` until the first is as near as that; where no place is
    that far from the road (a hole, walls), they stop as far from it as they can be.
    """

    def lowest(heights: np.ndarray) -> np.ndarray:
        there = points + heights[:, None, None] * way
        return road.closest(there.reshape(-1, len(way)))[0].reshape(len(heights), -1).min(axis=1)

    heights = np.linspace(30.0, -5.0, 141) * size
    for _ in range(15):
        far = lowest(heights) >= gap
        if not far.any():  # as far as can be
            return ShiftedRoad(road, -heights[np.argmax(lowest(heights))] * way)
        first = int(np.argmax(far))
        last = first + int(np.argmin(far[first:]))
        if far[last]:
            return ShiftedRoad(road, -heights[-1] * way)
        heights = np.linspace(heights[last - 1], heights[last], 17)
    return ShiftedRoad(road, -heights[0] * way)


def extruded(road: Road) -> Road:
    """A road of the plane for a body in space."""
    return ExtrudedRoad(road)


def _direction(random: np.random.Generator, dim: int) -> np.ndarray:
    x = random.standard_normal(dim)
    return x / np.linalg.norm(x)
