"""Rigid roads: where is the nearest point, how far, and which way is out."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np


class Road(Protocol):
    """What every road can do: find the nearest point of its surface."""

    def closest(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return gap (n,), normal (n, dim) from the road into the body, and closest point (n, dim).

        The gap is positive above the road; point = closest point + gap * normal.
        """
        ...


class Plane:
    """A flat road through `point`; `normal`, of any length, points from the road to the body."""

    def __init__(self, point: Sequence[float] = (0.0, 0.0), normal: Sequence[float] = (0.0, 1.0)):
        self.point = np.asarray(point, dtype=float)
        direction = np.asarray(normal, dtype=float)
        if self.point.shape != direction.shape or self.point.shape not in ((2,), (3,)):
            raise ValueError(
                f"The plane's point {point} and normal {normal} must both have 2, or both 3, components."
            )
        if not (np.isfinite(self.point).all() and np.isfinite(direction).all()):
            raise ValueError(f"The plane's point {point} and normal {normal} must be finite numbers.")
        largest = np.abs(direction).max()
        if largest == 0:
            raise ValueError(f"The plane's normal is {normal}; it must not be zero.")
        direction = direction / largest
        self.normal = direction / np.linalg.norm(direction)

    def closest(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return gap (n,), normal (n, dim) and closest point (n, dim) for points (n, dim)."""
        points = np.asarray(points, dtype=float)
        gap = (points - self.point) @ self.normal
        normal = np.empty_like(points)
        normal[:] = self.normal
        return gap, normal, points - gap[:, None] * normal
