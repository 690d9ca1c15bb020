"""A rubber ball thrown along a road in space: where its speed and its spin end."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from forms import Hyperelasticity, NeoHookean
from geometry import Body, Grid, Plane, SurfaceRoad, box
from model import EnergyMomentum, FiniteBody, History, LosslessContact, integrate

RADIUS, GRAVITY = 0.5, 9.81  # m, m/s^2


class Thrown(NamedTuple):
    """A run of a ball, after each of its steps.

    Attributes
    ----------
    time : (steps,)
    velocity, spin : (steps, 3)
        Of the centre of mass (m/s), and angular momentum about it over its moment of inertia (rad/s).
    rolling : float
        Speed over that of the throw at which a rigid ball of its mass and inertia rolls: 5/7 if it is round.
    history : History
    deepest : float
        How far a node was below the road at most (m).
    """

    time: np.ndarray
    velocity: np.ndarray
    spin: np.ndarray
    rolling: float
    history: History
    deepest: float


def ball(cells: int, height: float) -> Grid:
    """A ball of hexahedra, a cube of `cells` along each side drawn round, its lowest point at a height (m)."""
    cube = box(2.0, 2.0, 2.0, cells, cells, cells, corner=(-1.0, -1.0, -1.0))
    square = cube.points**2
    y, z = np.roll(square, -1, axis=1), np.roll(square, -2, axis=1)
    points = RADIUS * cube.points * np.sqrt(1.0 - y / 2 - z / 2 + y * z / 3)
    faces = np.concatenate([cube.facets[name] for name in cube.facets])
    return Grid(points + [0.0, 0.0, RADIUS + height], cube.cells, "hexahedron", {"surface": faces})


def rough(height: float = 0.02, wave: float = 0.2, length: float = 3.0, width: float = 1.2) -> SurfaceRoad:
    """A road of triangles in space: waves of a height and a length (m) across each other, crests on z = 0."""
    x = np.arange(-0.5 * width, length + 1e-9, wave / 6)
    y = np.arange(-0.5 * width, 0.5 * width + 1e-9, wave / 6)
    X, Y = np.meshgrid(x, y, indexing="ij")
    waves = np.sin(2 * np.pi * X / wave + 1.0) * np.cos(2 * np.pi * Y / wave)
    number = np.arange(X.size).reshape(X.shape)
    a, b, c, d = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    triangles = np.concatenate(
        [np.stack(corners, axis=-1).reshape(-1, 3) for corners in ((a, b, c), (a, c, d))]
    )
    return SurfaceRoad(np.stack([X, Y, height * (waves - 1.0)], axis=-1).reshape(-1, 3), triangles)


def thrown(
    velocity: tuple[float, float, float],
    spin: tuple[float, float, float] = (0.0, 0.0, 0.0),
    seconds: float = 0.6,
    mu: float | None = 0.3,
    E: float = 1e4,
    cells: int = 6,
    dt: float = 0.005,
    height: float = 0.0,
    method: Callable[..., EnergyMomentum] = LosslessContact,
    road: Any = None,
) -> Thrown:
    """Throw a ball of density 1 at a velocity (m/s) and a spin (rad/s) along z = 0, or another road."""
    body = Body.from_grid(ball(cells, height))
    elastic = Hyperelasticity(body, NeoHookean(E, 0.3))
    weight = elastic.body_force((0.0, 0.0, -GRAVITY))
    road = Plane((0.0, 0.0, 0.0), (0.0, 0.0, 1.0)) if road is None else road
    scheme = method(FiniteBody.from_forms(elastic, 1.0, weight, road, "surface", friction=mu), dt)
    X = body.coordinates
    mass = (scheme.M @ np.tile([1.0, 0.0, 0.0], len(X))).reshape(X.shape)[:, 0]
    arm = X - mass @ X / mass.sum()
    inertia = float(arm.ravel() @ (scheme.M @ arm.ravel())) * 2.0 / 3.0
    begin = scheme.start(velocity=np.array(velocity) + np.cross(spin, arm))
    history, found, deepest = History(scheme, begin), [], 0.0
    for state in integrate(scheme, begin, round(seconds / dt), history, progress=False):
        x, p = X + state.displacement, (scheme.M @ state.velocity.ravel()).reshape(X.shape)
        about = np.cross(x - mass @ x / mass.sum(), p).sum(axis=0)
        found.append((state.time, p.sum(axis=0) / mass.sum(), about / inertia))
        deepest = max(deepest, -float(scheme.body.gaps(state.displacement)[0].min()))
    times, velocities, spins = (np.array(each) for each in zip(*found, strict=True))
    rolling = 1.0 / (1.0 + inertia / (mass.sum() * RADIUS**2))
    return Thrown(times, velocities, spins, rolling, history, deepest)
