"""Projection of points onto a circle or a sphere."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from checks import positive

SPACING = 0.0073  # of the radius: ten cells across half the patch under the load of the paper
SHELL_GROWTH = 1.65  # each shell of a nested mesh is about so many times larger than the one within


def onto_circle(radius: float, lowest: Sequence[float] = (0.0, 0.0)) -> Callable[[np.ndarray], np.ndarray]:
    """Return the function that moves points (n, dim) along their radius onto a circle, or a sphere.

    Near the lowest point the height above it is x^2 / (R + sqrt(R^2 - x^2)) rather than a difference, so that
    gaps to a road there are right to the last digits and never negative.

    Parameters
    ----------
    radius : float
        Of the circle or sphere.
    lowest : sequence of float
        Its lowest point, of 2 or 3 coordinates, the last of which is the height.

    Examples
    --------
    >>> import numpy as np
    >>> onto_circle(2.0)(np.array([[0.0, 4.5], [0.0, 0.1]]))
    array([[0., 4.],
           [0., 0.]])
    """
    base = np.asarray(lowest, dtype=float)

    def snap(points: np.ndarray) -> np.ndarray:
        from_centre = points - base
        from_centre[:, -1] -= radius
        length = np.sqrt(np.sum(from_centre**2, axis=1, keepdims=True))
        onto = radius * (from_centre / length)
        y = onto[:, -1]
        across = np.sum(onto[:, :-1] ** 2, axis=1)
        onto[:, -1] = np.where(y < 0, across / (radius - np.minimum(y, 0)), radius + y)
        return onto + base

    return snap


def shell_sizes(radius: float, inner_half_width: float | None) -> np.ndarray:
    """Return the sizes (k,) of shells of a nested mesh in the unit disc: the inner block's first, 1 last.

    Mapped onto the body the block is as wide as asked for, by default a fifth of the radius.

    Raises
    ------
    ValueError
        if the inner block does not fit
    """
    inner = 0.1 * radius if inner_half_width is None else inner_half_width
    positive(inner_half_width=inner)
    if inner >= radius:
        raise ValueError(f"inner_half_width is {inner!r}; it must be less than the radius, {radius!r}.")
    b = np.tan(inner / radius / 2)
    shells = max(1, round(np.log(1 / b) / np.log(SHELL_GROWTH)))
    return np.asarray(b ** (1 - np.arange(shells + 1) / shells))
