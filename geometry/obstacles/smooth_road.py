"""Roads without corners: the height is a smooth function, the user's own or drawn through samples."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.interpolate import Akima1DInterpolator, RectBivariateSpline

from checks import function, numbers
from geometry.obstacles.linear_road import LinearRoad, checked_samples
from geometry.obstacles.plane import check_points

STEPS = 12  # of Newton's method at most; near the road it takes four
SHORT = 1e-2  # of the spacing of the positions: the step of difference quotients of the height
SHORTER = 1e-5  # and of the slope
STILL = 1e-12  # of the spacing: a step so short ends the search
ASKEW = 1e-9  # of the spacing: a foot farther beside the normal is no nearest point of the smooth road
HALVINGS = 30  # of a step: what is left is rounding


class SmoothRoad:
    """The road z = height(x), or z = height(x, y).

    The nearest point is sought by Newton's method from the nearest point of the chain (or the triangles)
    through the given positions, each step shortened until it comes nearer. Beyond the positions a profile
    goes on flat; let those of a surface reach beyond the body.

    Parameters
    ----------
    height : function of arrays x (n,), or x and y, that returns heights (n,)
    positions : (m,) or (m, 2), dense enough to show every hill and hollow
    slope : function likewise that returns the derivative (n,), or a pair of them; default difference
        quotients of fourth order

    Raises
    ------
    ValueError
        for positions that no LinearRoad can have, and heights there that are not finite.

    Examples
    --------
    >>> import numpy as np
    >>> from geometry import SmoothRoad
    >>> waves = SmoothRoad(np.cos, np.linspace(-10.0, 10.0, 201), slope=lambda x: -np.sin(x))
    >>> gap, normal, nearest = waves.closest(np.array([[0.0, 1.5]]))
    >>> gap.round(9), nearest.round(9)
    (array([0.5]), array([[0., 1.]]))
    """

    def __init__(self, height: Callable, positions: np.ndarray, slope: Callable | None = None):
        function(height=height)
        if slope is not None:
            function(slope=slope)
        places = numbers("positions", positions)
        places = places[:, None] if places.ndim == 1 else places
        places, heights = checked_samples(places, height(*places.T))
        self.dim = places.shape[1] + 1
        self._linear = LinearRoad(places, heights)
        self._low, self._high = places.min(axis=0), places.max(axis=0)
        self._spacing = (np.prod(self._high - self._low) / len(places)) ** (1 / places.shape[1])
        self._height, self._given_slope = height, slope

    @classmethod
    def through(cls, positions: np.ndarray, heights: np.ndarray) -> SmoothRoad:
        """Draw a smooth road through samples: for a profile Akima's curve, on a grid cubic splines.

        Parameters
        ----------
        positions : (m,), or (m, 2) on the lattice of two sets of lines, of any spacings
        heights : (m,)

        Raises
        ------
        ValueError
            for samples that no LinearRoad can have, and surfaces not sampled on a grid.
        """
        positions, heights = checked_samples(positions, heights)
        order = np.lexsort(positions.T[::-1])
        positions, heights = positions[order], heights[order]
        if positions.shape[1] == 1:
            curve = Akima1DInterpolator(positions[:, 0], heights, method="makima")
            return cls(curve, positions, curve.derivative())
        x, y = np.unique(positions[:, 0]), np.unique(positions[:, 1])
        if len(x) * len(y) != len(positions):
            raise ValueError(
                f"The {len(positions)} samples lie at {len(x)} different x and {len(y)} different y, not at "
                "all crossings; use LinearRoad for scattered samples."
            )
        grid = heights.reshape(len(x), len(y))
        surface = RectBivariateSpline(x, y, grid, kx=min(3, len(x) - 1), ky=min(3, len(y) - 1))

        def slope(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            return surface.ev(x, y, dx=1), surface.ev(x, y, dy=1)

        return cls(surface.ev, positions, slope)

    def height(self, places: np.ndarray) -> np.ndarray:
        """Return heights (n,) at places (n, dim - 1); beyond the ends, that at the end."""
        return np.asarray(self._height(*np.clip(places, self._low, self._high).T), dtype=float)

    def slope(self, places: np.ndarray) -> np.ndarray:
        """Return slopes (n, dim - 1) at places (n, dim - 1)."""
        if self._given_slope is None:
            step = SHORT * self._spacing
            near, far = (_differences(self.height, places, k * step) for k in (1, 2))
            return (4 * near - far) / 3
        inside = np.clip(places, self._low, self._high)
        slope = np.asarray(self._given_slope(*inside.T), dtype=float).reshape(self.dim - 1, len(places)).T
        return np.where(places == inside, slope, 0.0)

    def closest(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return gap (n,), normal (n, dim) and closest point (n, dim) for points (n, dim)."""
        points = check_points(self, self.dim, points)
        place = self._linear.closest(points)[2][:, :-1].copy()
        todo = np.arange(len(points))
        for _ in range(STEPS):
            if todo.size == 0:
                break
            step = self._step(place[todo], points[todo])
            place[todo] += step
            todo = todo[
                np.abs(step).max(axis=1) > STILL * self._spacing + 4e-16 * np.abs(place[todo]).max(axis=1)
            ]
        foot = np.column_stack([place, self.height(place)])
        normal = np.column_stack([-self.slope(place), np.ones(len(points))])
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        gap = np.einsum("na,na->n", points - foot, normal)
        beside = np.linalg.norm(points - foot - gap[:, None] * normal, axis=1)
        askew = beside > ASKEW * self._spacing  # nearest to the end of a slope, or to many points
        gap[askew] = np.copysign(np.linalg.norm(points - foot, axis=1), gap)[askew]
        normal[askew] = (points - foot)[askew] / gap[askew, None]
        return gap, normal, foot

    def _step(self, place: np.ndarray, points: np.ndarray) -> np.ndarray:
        """One step (n, k) of Newton's method towards the least squared distance, halved until that falls."""
        below = self.height(place) - points[:, -1]
        slope = self.slope(place)
        downhill = place - points[:, :-1] + below[:, None] * slope
        gauss = np.eye(place.shape[1]) + slope[:, :, None] * slope[:, None, :]
        step_size = SHORTER * self._spacing
        curvature = np.stack(
            [
                _differences(lambda p, a=a: self.slope(p)[:, a], place, step_size)
                for a in range(place.shape[1])
            ],
            axis=1,
        )
        newton = gauss + below[:, None, None] * (curvature + curvature.transpose(0, 2, 1)) / 2
        convex = np.linalg.eigvalsh(newton)[:, 0] > 0.1
        step = -np.linalg.solve(np.where(convex[:, None, None], newton, gauss), downhill[:, :, None])[:, :, 0]
        distance = np.sum((place - points[:, :-1]) ** 2, axis=1) + below**2
        length = np.ones(len(place))
        for _ in range(HALVINGS):
            trial = place + length[:, None] * step
            after = np.sum((trial - points[:, :-1]) ** 2, axis=1) + (self.height(trial) - points[:, -1]) ** 2
            farther = after > distance * (1 + 1e-14) + 1e-28 * self._spacing**2
            if not farther.any():
                break
            length[farther] /= 2
        return length[:, None] * step


def _differences(function: Callable, places: np.ndarray, step: float) -> np.ndarray:
    """Central difference quotients (n, k) of a function of places (n, k)."""
    quotients = []
    for direction in np.eye(places.shape[1]):
        ahead, behind = places + step * direction, places - step * direction
        quotients.append((function(ahead) - function(behind)) / (2 * step))
    return np.stack(quotients, axis=1)
