"""Rings that turn: how far, how wide, their weight on the road, and the velocities of steady rolling."""

from typing import Any

import numpy as np

from forms import Hyperelasticity, NeoHookean, Support
from geometry import Body, Plane, ring
from model import BodyOnRoad, FiniteBody, FiniteContact

GRAVITY = 9.81  # m/s^2


def wheel(
    E: float,
    mu: float | None,
    mesh: tuple[int, int] = (96, 6),
    height: float = 0.0,
    weight: tuple[float, float] = (0.0, -GRAVITY),
) -> FiniteBody:
    """Ring of the paper (radii 0.5 and 0.2 m, density 1, nu = 0.3) of neo-Hookean rubber above a road."""
    body = Body.from_grid(ring(0.5, 0.2, *mesh, lowest=(0.0, height)))
    elastic = Hyperelasticity(body, NeoHookean(E, nu=0.3))
    return FiniteBody.from_forms(elastic, 1.0, elastic.body_force(weight), Plane(), "outer", friction=mu)


def sagged(moving: FiniteBody, weight: float = GRAVITY) -> np.ndarray:
    """Displacement (N, 2) under its own weight on the road."""
    elastic = moving.elastic
    x, support = moving.coordinates, Support(elastic.body)
    for y in (x[:, 1].min(), x[:, 1].max()):
        support.fix_node(elastic.body.nearest_node((0.0, y)), x=0.0)
    contact = BodyOnRoad(elastic.system(elastic.body_force((0.0, -weight)), support), "outer", Plane())
    return contact.displacement(FiniteContact(contact).solve())


def turn(before: np.ndarray, after: np.ndarray) -> float:
    """Mean rotation (rad, -pi to pi) from positions (N, 2) to positions (N, 2)."""
    a, b = before - before.mean(axis=0), after - after.mean(axis=0)
    return float(np.arctan2(np.sum(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]), np.sum(a * b)))


def mean_radius(moving: Any, u: np.ndarray) -> float:
    """Mean distance of the outer nodes from their centre (m)."""
    x = (moving.coordinates + u)[moving.contact_nodes]
    return float(np.linalg.norm(x - x.mean(axis=0), axis=1).mean())


def inertia(scheme: Any, radius: float = 0.5) -> tuple[float, float]:
    """Mass, and I / (m R^2), of the ring as the scheme has it."""
    x = scheme.body.coordinates - scheme.body.coordinates.mean(axis=0)
    mass = float((scheme.M @ np.tile([1.0, 0.0], len(x))).sum())
    return mass, float(x.ravel() @ (scheme.M @ x.ravel())) / (mass * radius**2)


def speed_of(scheme: Any, state: Any, mass: float) -> float:
    """Speed of the centre of mass along the road (m/s)."""
    return float((scheme.M @ state.velocity.ravel())[0::2].sum() / mass)


def treadmill(moving: FiniteBody, u: np.ndarray) -> np.ndarray:
    """Change of the positions (N, 2) as the material goes round through a shape that stays, per radian."""
    X = moving.coordinates
    arm = X - [0.0, 0.5 * (X[:, 1].min() + X[:, 1].max())]
    angle, radius = np.arctan2(arm[:, 1], arm[:, 0]), np.linalg.norm(arm, axis=1)
    change = np.zeros_like(X)
    for r in np.unique(radius.round(9)):
        layer = np.flatnonzero(np.abs(radius - r) < 1e-8)
        layer = layer[np.argsort(angle[layer])]
        waves = np.fft.fftfreq(layer.size, 1 / layer.size)
        waves[layer.size // 2] = 0.0
        spectrum = 1j * waves[:, None] * np.fft.fft((X + u)[layer], axis=0)
        change[layer] = np.fft.ifft(spectrum, axis=0).real
    return change
