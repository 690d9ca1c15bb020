"""Roads made from other roads: moving, looked for only when near, or drawn out sideways."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from checks import finite, function, is_road, numbers, positive, vector
from geometry.obstacles.plane import Road, check_points


class ShiftedRoad:
    """Another road, translated by `shift`.

    Examples
    --------
    >>> import numpy as np
    >>> from geometry import Plane, ShiftedRoad
    >>> ShiftedRoad(Plane(), (0.0, -0.1)).closest(np.array([[0.0, 0.0]]))[0]
    array([0.1])
    """

    def __init__(self, road: Road, shift: ArrayLike):
        self.road, self.shift = _at_rest(road, self), vector("shift", shift, 2, 3)
        self.flat = getattr(road, "flat", False)

    def closest(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return gap (n,), normal (n, dim) and closest point (n, dim) for points (n, dim)."""
        points = check_points(self, self.shift.size, points)
        gap, normal, foot = self.road.closest(points - self.shift)
        return gap, normal, foot + self.shift


class TurnedRoad:
    """Another road, turned about `centre` by a rotation matrix, then translated by `shift`."""

    def __init__(self, road: Road, rotation: np.ndarray, centre: np.ndarray, shift: np.ndarray):
        self.road, self.rotation, self.centre, self.shift = road, rotation, centre, shift

    def closest(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return gap (n,), normal (n, dim) and closest point (n, dim) for points (n, dim)."""
        points = check_points(self, self.centre.size, points)
        here = (points - self.shift - self.centre) @ self.rotation + self.centre
        gap, normal, foot = self.road.closest(here)
        return (
            gap,
            normal @ self.rotation.T,
            (foot - self.centre) @ self.rotation.T + self.centre + self.shift,
        )


class MovingRoad:
    """A road that moves as a rigid body: a belt, a press, a roller that turns.

    What sticks to it goes with it.

    Parameters
    ----------
    road : where it is at time 0
    velocity : dim components, length per time; or a function of the time (or load parameter) that returns
        the displacement (dim,), zero at time 0
    turn : function of the time that returns the angle in radians, anticlockwise (in space, about `axis`)
    centre : what it turns about, moving with it; default the origin
    axis : in space

    Raises
    ------
    ValueError
        for vectors of another dimension, and motions that are not finite numbers.

    Examples
    --------
    >>> import numpy as np
    >>> from geometry import MovingRoad, Plane
    >>> belt = MovingRoad(Plane(), (2.0, 0.0))
    >>> tilting = MovingRoad(Plane(), turn=lambda t: 0.1 * t)
    >>> belt.displacement(3.0), tilting.at(1.0).closest(np.array([[1.0, 0.0]]))[0].round(4)
    (array([6., 0.]), array([-0.0998]))
    """

    def __init__(
        self,
        road: Road,
        velocity: ArrayLike | Callable[[float], ArrayLike] | None = None,
        turn: Callable[[float], float] | None = None,
        centre: ArrayLike | None = None,
        axis: ArrayLike | None = None,
    ):
        self.road, self.turn = _at_rest(road, self), turn
        if velocity is None and turn is None:
            raise ValueError("The road does not move; give its velocity or its turn.")
        if turn is not None:
            function(turn=turn)
        self.path = velocity if callable(velocity) else None
        rate = None if velocity is None or callable(velocity) else vector("velocity", velocity, 2, 3)
        start = None if self.path is None else vector("velocity(0)", self.path(0.0), 2, 3)
        known = [value for value in (rate, start, centre) if value is not None]
        dim = 3 if axis is not None else len(np.ravel(known[0])) if known else 2
        self.velocity = np.zeros(dim) if rate is None else rate
        self.centre = np.zeros(dim) if centre is None else vector("centre", centre, dim)
        if dim == 3 and turn is not None and axis is None:
            raise ValueError("The road turns in space; give the axis that it turns about.")
        self.axis = None if axis is None else vector("axis", axis, 3)
        if self.axis is not None:
            positive(**{"the length of axis": np.linalg.norm(self.axis)})
            self.axis = self.axis / np.linalg.norm(self.axis)

    def displacement(self, time: float) -> np.ndarray:
        """Return how far (dim,) the road, or its centre if it turns, has moved by `time`."""
        finite(time=time)
        if self.path is None:
            return self.velocity * time
        return vector(f"velocity({time:g})", self.path(time), len(self.centre))

    def rotation(self, time: float) -> np.ndarray:
        """Return the rotation matrix (dim, dim) at `time`; a turn that is not finite raises ValueError."""
        finite(time=time)
        dim = len(self.centre)
        angle = 0.0 if self.turn is None else self.turn(time)
        finite(**{f"turn({time:g})": angle})
        if angle == 0.0:
            return np.eye(dim)
        about = np.array([0.0, 0.0, angle]) if self.axis is None else angle * self.axis
        return Rotation.from_rotvec(about).as_matrix()[:dim, :dim]

    def at(self, time: float) -> Road:
        """Return the road where it is at `time`."""
        if self.turn is None:
            return ShiftedRoad(self.road, self.displacement(time))
        return TurnedRoad(self.road, self.rotation(time), self.centre, self.displacement(time))

    def carried(self, points: np.ndarray, start: float, end: float) -> np.ndarray:
        """Return where points (n, dim) that go with the road from time `start` on are at time `end`."""
        if self.turn is None:
            return points + (self.displacement(end) - self.displacement(start))
        turned = self.rotation(end) @ self.rotation(start).T
        before, after = self.centre + self.displacement(start), self.centre + self.displacement(end)
        return (points - before) @ turned.T + after


class RoadSeenFromAfar:
    """A road whose nearest point is sought for points near to it only, to save time.

    Parameters
    ----------
    road : of any kind, its normals with an upward last component
    summit : height that it nowhere exceeds
    reach : points that are higher than this above the summit see the level at the summit's height instead:
        their gaps are too small, and never smaller than `reach`

    Examples
    --------
    >>> import numpy as np
    >>> from geometry import RoadSeenFromAfar, RoundRoad
    >>> road = RoadSeenFromAfar(RoundRoad(radius=5.0), summit=0.0, reach=0.1)
    >>> road.closest(np.array([[3.0, 0.05], [3.0, 2.0]]))[0].round(6)  # the second sees the level instead
    array([0.873883, 2.      ])
    """

    def __init__(self, road: Road, summit: float, reach: float):
        self.road = _at_rest(road, self)
        finite(summit=summit)
        positive(reach=reach)
        self.summit, self.reach = float(summit), float(reach)

    def closest(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return gap (n,), normal (n, dim) and closest point (n, dim) for points (n, dim)."""
        points = numbers("points", points)
        normal, foot = np.zeros_like(points), points.copy()
        normal[:, -1], foot[:, -1] = 1.0, self.summit
        gap = points[:, -1] - self.summit
        near = np.flatnonzero(gap <= self.reach)
        if near.size:
            gap[near], normal[near], foot[near] = self.road.closest(points[near])
        return gap, normal, foot


class ExtrudedRoad:
    """A road of the plane (x, height), the same for every y: a road for bodies in 3-D.

    Examples
    --------
    >>> import numpy as np
    >>> from geometry import ExtrudedRoad, RoundRoad
    >>> cylinder = ExtrudedRoad(RoundRoad(radius=5.0))
    >>> cylinder.closest(np.array([[0.0, 7.0, 2.0]]))[0]
    array([2.])
    """

    def __init__(self, road: Road):
        self.road = _at_rest(road, self)

    def closest(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return gap (n,), normal (n, 3) and closest point (n, 3) for points (n, 3)."""
        points = check_points(self, 3, points)
        gap, in_plane, foot = self.road.closest(points[:, [0, 2]])
        normal = np.insert(in_plane, 1, 0.0, axis=1)
        return gap, normal, np.insert(foot, 1, points[:, 1], axis=1)


def _at_rest(road: Road, maker: object) -> Road:
    """Refuse what is no road, and a road that moves where only one at rest can be taken."""
    is_road(road)
    if hasattr(road, "at"):
        kind = type(maker).__name__
        raise ValueError(
            f"{kind} takes a road at rest, but this {type(road).__name__} moves; let the whole move: "
            f"MovingRoad({kind}(...), ...)."
        )
    return road
