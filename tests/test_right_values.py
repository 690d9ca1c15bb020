"""Scenes with a right value: a rope on a bollard, a wavy surface, a punch, a sphere between plates."""

import numpy as np
import pytest

from forms import Elasticity, Isotropic, Support
from geometry import (
    Body,
    Grid,
    LinearRoad,
    Plane,
    RoundRoad,
    SeveralRoads,
    half_cylinder_nested,
    rectangle,
)
from model import BodyOnRoad, MassRedistribution, MovingBody, follow, solve


def stretched(xs, ys):
    """A rectangle whose cells have the corners (xs, ys)."""
    grid = rectangle(1.0, 1.0, len(xs) - 1, len(ys) - 1)
    column, row = np.rint(grid.points.T * [[len(xs) - 1], [len(ys) - 1]]).astype(int)
    points = np.column_stack([np.asarray(xs)[column], np.asarray(ys)[row]])
    return Body.from_grid(Grid(points, grid.cells, grid.cell, grid.facets))


@pytest.mark.parametrize("mu", [0.1, 0.3])
def test_a_rope_round_a_bollard(mu):
    """Capstan: T2 / T1 = exp(mu wrap), within 1 %; the rope goes on straight where it leaves the bollard."""
    R, t, wrap, T1 = 1.0, 0.03, np.pi / 2, 1.0
    grid = rectangle(wrap * 1.1, t, 66, 2)
    along, radius = grid.points[:, 0], R + grid.points[:, 1]
    angle = np.minimum(along, wrap)
    points = np.column_stack([radius * np.sin(angle), radius * np.cos(angle) - (along - angle)])
    body = Body.from_grid(Grid(points, grid.cells, grid.cell, grid.facets))
    elasticity = Elasticity(body, Isotropic(E=1e6, nu=0.0))
    support = Support(body).fix("right", x=0.0, y=lambda s: -s)
    load = elasticity.total_force("left", (-T1, 0.0))
    body.mark("inner side", lambda x: (np.hypot(x[0], x[1]) < R + 1e-9) & (x[1] > -1e-9))
    bollard = RoundRoad((0.0, R), (0.0, 1.0), R)
    contact = BodyOnRoad(elasticity.system(load, support), "inner side", bollard, friction=mu)
    *_, solution = follow(contact, [5e-5, 1e-4])
    T2 = -contact.reactions(solution).at(body.nodes("right"))[0][1]
    assert pytest.approx(np.exp(mu * wrap), rel=0.01) == T2 / T1


@pytest.mark.parametrize("load", [0.1, 0.4, 0.8, 1.1, 1.5])
def test_a_wavy_surface_after_westergaard(load):
    """Peak 2 sqrt(p p*) in partial, p + p* in full contact, p* = pi E* amplitude / wavelength."""
    wavelength, amplitude, E, nu = 2.0, 1e-4, 1e3, 0.3
    size = np.concatenate([[0.0], np.cumsum(np.geomspace(1 / 64, 0.25, 24))])
    body = stretched(np.linspace(0.0, 1.0, 65), size)
    elasticity = Elasticity(body, Isotropic(E, nu))
    full = np.pi * E / (1 - nu**2) * amplitude / wavelength
    x = np.linspace(-1.0, 2.0, 3 * 64 + 1)
    road = LinearRoad(x, amplitude * (np.cos(2 * np.pi * x / wavelength) - 1))
    support = Support(body).fix(["left", "right"], x=0.0)
    system = elasticity.system(elasticity.total_force("top", (0.0, -load * full)), support)
    contact = BodyOnRoad(system, "bottom", road)
    pressure = contact.pressure(solve(contact))
    peak = 2 * np.sqrt(load) if load < 1 else 1 + load
    assert pressure[np.argmin(contact.points[:, 0])] / full == pytest.approx(peak, rel=0.01)


def test_a_flat_punch_on_a_half_space():
    """F = 2 a E* depth, a rigid disc, within 1 %: axisymmetric, on a half space that reaches 300 a far."""
    a, E, nu, depth = 1.0, 1e3, 0.3, 1e-3
    far = np.geomspace(0.004, 300.0, 56)
    inside = np.concatenate([np.linspace(0.0, 0.8, 17), 1.0 - far[(far > 0.004) & (far < 0.18)][::-1], [1.0]])
    body = stretched(np.concatenate([inside, 1.0 + far]), np.concatenate([-far[::-1], [0.0]]))
    body.mark("under the punch", lambda x: (x[1] > -1e-9) & (x[0] <= a + 1e-9)).mark(
        "rim", lambda x: x[0] > 300
    )
    elasticity = Elasticity(body, Isotropic(E, nu), "axisymmetric")
    support = Support(body).fix("left", x=0.0).fix(["bottom", "rim"], x=0.0, y=0.0)
    system = elasticity.system(elasticity.body_force((0.0, 0.0)), support)
    punch = Plane((0.0, -depth), (0.0, -1.0))
    contact = BodyOnRoad(system, "under the punch", punch, interference=True)
    force = solve(contact, "direct").pressure_force.sum()
    assert force == pytest.approx(2 * a * E / (1 - nu**2) * depth, rel=0.01)


def test_a_whole_sphere_between_two_plates():
    """Hertz at both poles, F = 4/3 E* sqrt(R) d^1.5, but for what the whole sphere yields."""
    R, E, nu = 10.0, 210e3, 0.3
    points, cells = disc(R)
    body = Body.from_grid(Grid(points, cells, "quadrilateral"))
    body.mark("axis", lambda x: x[0] < 1e-9)
    body.mark("surface", lambda x: np.abs(np.hypot(x[0], x[1]) - R) < 1e-6)
    elasticity = Elasticity(body, Isotropic(E, nu), "axisymmetric")
    system = elasticity.system(elasticity.body_force((0.0, 0.0)), Support(body).fix("axis", x=0.0))
    depth = 0.02
    plates = [Plane((0.0, -R + depth), (0.0, 1.0)), Plane((0.0, R - depth), (0.0, -1.0))]
    contact = BodyOnRoad(system, "surface", SeveralRoads(plates), interference=True, reach=0.5)
    solution = solve(contact)
    lower = contact.points[:, 1] < 0
    below, above = solution.pressure_force[lower].sum(), solution.pressure_force[~lower].sum()
    assert below == pytest.approx(above, rel=1e-6)
    expected = 4 / 3 * E / (1 - nu**2) * np.sqrt(R) * depth**1.5
    assert below == pytest.approx(expected, rel=0.03)


def disc(R):
    """The right half of a disc about the origin, fine at its poles."""
    half = half_cylinder_nested(R, 3)
    points = half.points - [0.0, R]
    cells = half.cells[points[half.cells, 0].mean(axis=1) > 0]
    both = np.concatenate([points, points * [1.0, -1.0]])
    twice = np.concatenate([cells, cells[:, [1, 0, 3, 2]] + len(points)])
    _, first, number = np.unique(both.round(9) + 0.0, axis=0, return_index=True, return_inverse=True)
    used, cells = np.unique(number.ravel()[twice], return_inverse=True)
    return both[first[used]], cells.reshape(twice.shape)


def test_a_block_thrown_along_the_ground_slides_v2_over_2_mu_g():
    mu, g, v = 0.3, 10.0, 1.0
    elasticity = Elasticity(Body.from_grid(rectangle(0.1, 0.02, 6, 4)), Isotropic(E=1e6, nu=0.0))
    weight = elasticity.body_force((0.0, -g))
    moving = MovingBody.from_forms(elasticity, 1.0, weight, Plane(), "bottom", friction=mu)
    scheme = MassRedistribution(moving, dt=1e-3)
    state = scheme.start(velocity=np.tile([v, 0.0], (len(moving.coordinates), 1)))
    state = scheme.run(state, 400)
    assert state.displacement[:, 0].mean() == pytest.approx(v**2 / (2 * mu * g), rel=2e-3)
