"""A short rubber ring on a rim that drives it over a road in space, at a slip angle."""

from typing import NamedTuple

import numpy as np

from forms import Hyperelasticity, NeoHookean, Support
from geometry import Body, Grid, Plane
from model import EnergyMomentum, FiniteBody

INNER, OUTER, WIDTH = 0.3, 0.5, 0.2  # m


class SideForce(NamedTuple):
    """Over the distance rolled (steps,) (m): side force (steps,) and load (steps,) (N)."""

    way: np.ndarray
    side: np.ndarray
    load: np.ndarray


def short_ring(around: int = 48, across: int = 2, wide: int = 4) -> Grid:
    """A ring about the y axis that stands on z = 0: hexahedra, boundaries `tread` and `rim`."""
    angle = 2 * np.pi * np.arange(around) / around
    radii, y = np.linspace(INNER, OUTER, across + 1), np.linspace(-0.5 * WIDTH, 0.5 * WIDTH, wide + 1)
    points = np.array([(r * np.sin(a), s, OUTER - r * np.cos(a)) for a in angle for r in radii for s in y])
    number = np.arange(len(points)).reshape(around, across + 1, wide + 1)
    ahead = np.roll(number, -1, axis=0)
    near = (number[:, :-1, :-1], ahead[:, :-1, :-1], number[:, 1:, :-1], ahead[:, 1:, :-1])
    far = (number[:, :-1, 1:], ahead[:, :-1, 1:], number[:, 1:, 1:], ahead[:, 1:, 1:])
    cells = np.stack([*near, *far], axis=-1).reshape(-1, 8)
    faces = {
        name: np.stack(
            [number[:, k, :-1], ahead[:, k, :-1], number[:, k, 1:], ahead[:, k, 1:]], axis=-1
        ).reshape(-1, 4)
        for name, k in (("rim", 0), ("tread", across))
    }
    return Grid(points, cells, "hexahedron", faces)


def side_force(
    slip_angle: float,
    mu: float = 0.5,
    pressed: float = 0.015,
    speed: float = 1.0,
    dt: float = 0.01,
    way: float = 0.4,
    mesh: tuple[int, int, int] = (48, 2, 4),
) -> SideForce:
    """Roll the ring by its rim, pressed down and not braked, along a line turned from its plane (rad)."""
    body = Body.from_grid(short_ring(*mesh))
    X, elastic = body.coordinates, Hyperelasticity(body, NeoHookean(1000.0, 0.45), mean_dilatation=True)
    support, arm = Support(body), X - [0.0, 0.0, OUTER]
    along = np.array([speed * np.cos(slip_angle), speed * np.sin(slip_angle), 0.0])
    spin = along[0] / (OUTER - pressed / 3.0)  # near free rolling: the tread is as long as it was

    def place(node: int, axis: int):
        x, z = arm[node, 0], arm[node, 2]

        def displacement(t: float) -> float:
            down = -pressed * np.sin(0.5 * np.pi * min(t / 0.05, 1.0)) ** 2
            a = spin * t
            turned = (x * np.cos(a) + z * np.sin(a) - x, 0.0, z * np.cos(a) - x * np.sin(a) - z + down)
            return float(turned[axis] + along[axis] * t)

        return displacement

    for node in body.nodes("rim"):
        support.fix_node(int(node), x=place(node, 0), y=place(node, 1), z=place(node, 2))
    moving = FiniteBody.from_forms(
        elastic,
        1.0,
        elastic.body_force((0.0, 0.0, 0.0)),
        Plane((0, 0, 0), (0, 0, 1)),
        "tread",
        support=support,
        friction=mu,
    )
    scheme = EnergyMomentum(moving, dt)
    state = scheme.start()
    forces = []
    for _ in range(round(way / speed / dt)):
        state = scheme.step(state)
        forces.append(state.contact_force.sum(axis=0))
    force = np.array(forces)
    return SideForce(speed * dt * np.arange(1, len(force) + 1), -force[:, 1], force[:, 2])
