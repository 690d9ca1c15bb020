"""Round roads: the arc of a circle or a sphere, as a hill or as a hollow."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from checks import finite
from geometry.obstacles.plane import Plane, check_points


class RoundRoad:
    """A circle (2-D) or sphere (3-D) through `point`, with `normal`, from the road to the body, there.

    Parameters
    ----------
    point : where the road passes; default the origin
    normal : of any length, at that point; default up
    radius : positive for a hill (the body is outside the circle), negative for a hollow (the body is inside)

    Raises
    ------
    ValueError
        for points and normals that a plane refuses too, and radii that are zero or not finite.

    Examples
    --------
    >>> import numpy as np
    >>> from geometry import RoundRoad
    >>> hill, hollow = RoundRoad(radius=5.0), RoundRoad(radius=-5.0)
    >>> above = np.array([[0.0, 1.0]])
    >>> hill.closest(above)[0], hollow.closest(above)[0]
    (array([1.]), array([1.]))
    """

    def __init__(
        self,
        point: Sequence[float] | None = None,
        normal: Sequence[float] | None = None,
        radius: float = 1.0,
    ):
        plane = Plane(point, normal)
        finite(radius=radius)
        if radius == 0:
            raise ValueError(
                f"The road's radius is {radius}; positive makes a hill, negative a hollow, and zero nothing."
            )
        self.point, self.normal, self.radius = plane.point, plane.normal, float(radius)

    def closest(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return gap (n,), normal (n, dim) and closest point (n, dim) for points (n, dim).

        Gaps are right to the last digits for any radius: (|x - c|^2 - R^2) / (|x - c| + |R|), the
        numerator taken from `point`. At the centre, from which all of the road is equally far, the
        closest point is `point`.
        """
        offset = check_points(self, self.point.size, points) - self.point
        from_centre = offset + self.radius * self.normal
        distance = np.linalg.norm(from_centre, axis=1)
        side = np.sign(self.radius)
        beyond = np.sum(offset**2, axis=1) + 2 * self.radius * (offset @ self.normal)
        gap = side * beyond / (distance + abs(self.radius))
        at_centre = distance < 1e-14 * abs(self.radius)  # where rounding alone would give a direction
        normal = side * from_centre / np.where(at_centre, 1.0, distance)[:, None]
        normal[at_centre] = self.normal
        return gap, normal, self.point + (offset - gap[:, None] * normal)
