"""Put points onto a circle, to the last digit where it touches the road."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np


def onto_circle(radius: float, lowest: Sequence[float] = (0.0, 0.0)) -> Callable[[np.ndarray], np.ndarray]:
    """Return the function that moves points (n, 2) along their radius onto a circle.

    Near the lowest point the height above it is x^2 / (R + sqrt(R^2 - x^2)) rather than a difference, so that
    gaps to a road there are right to the last digits and never negative.
    """

    def snap(points: np.ndarray) -> np.ndarray:
        x, y = (points - np.asarray(lowest) - (0.0, radius)).T
        length = np.hypot(x, y)
        x, y = radius * (x / length), radius * (y / length)
        height = np.where(y < 0, x**2 / (radius - np.minimum(y, 0)), radius + y)
        return np.stack([x, height], axis=1) + lowest

    return snap
