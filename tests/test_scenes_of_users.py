"""Scenes that users bring: press fits, several obstacles, moving roads, springs, bodies of revolution."""

import numpy as np
import pytest

from forms import Elasticity, Isotropic, Support
from geometry import (
    Body,
    Grid,
    LinearRoad,
    MovingRoad,
    Plane,
    RoundRoad,
    SeveralRoads,
    box,
    half_cylinder_nested,
    rectangle,
    ring,
)
from model import BodyOnRoad, ContactProblem, MovingBody, Newmark, follow, solve
from model.closed_forms.hertz import HertzSphere

random = np.random.default_rng(4)


def test_a_ring_on_a_shaft_too_thick_has_lames_pressure(tmp_path):
    """Radii 20 and 30, 0.02 too thick, E = 210e3, nu = 0.3: 76.197 at the first try."""
    body = Body.from_grid(ring(30.0, 20.0, 48, 8, lowest=(0.0, -30.0)), 1)
    elasticity = Elasticity(body, Isotropic(210e3, 0.3))
    support = Support(body).fix_node(body.nearest_node((0, 30)), x=0.0)
    support.fix_node(body.nearest_node((30, 0)), y=0.0).fix_node(body.nearest_node((0, -30)), x=0.0)
    system = elasticity.system(elasticity.body_force((0.0, 0.0)), support)
    shaft = RoundRoad((0.0, 20.02), (0.0, 1.0), 20.02)
    with pytest.raises(ValueError, match="interference=True"):
        BodyOnRoad(system, "inner", shaft)
    contact = BodyOnRoad(system, "inner", shaft, interference=True)
    solution = solve(contact)
    np.testing.assert_allclose(contact.pressure(solution), 76.197, rtol=3e-3)
    at = contact.points + contact.displacement(solution)[contact.nodes]
    assert abs(shaft.closest(at)[0]).max() < 1e-10
    contact.problem.save(tmp_path / "fit.npz", solution)
    assert ContactProblem.load(tmp_path / "fit.npz").gap == pytest.approx(contact.problem.gap)


def test_a_block_started_in_the_ground_is_pushed_out():
    body = Body.from_grid(rectangle(1.0, 1.0, 4, 4, corner=(0.0, -0.05)))
    elasticity = Elasticity(body, Isotropic(1e3, 0.3))
    support = Support(body).fix_node(body.nearest_node((0.5, 1.0)), x=0.0)
    system = elasticity.system(elasticity.body_force((0.0, -1.0)), support)
    contact = BodyOnRoad(system, "bottom", Plane(), interference=True)
    solution = solve(contact)
    assert solution.gap.min() == 0 and solution.pressure_force.sum() == pytest.approx(1.0)
    np.testing.assert_allclose(contact.displacement(solution)[contact.nodes, 1][[0, -1]], 0.05, atol=2e-3)


@pytest.mark.parametrize("dim", [2, 3])
def test_a_corner_of_two_planes_is_the_hollow_of_a_profile(dim):
    points = random.uniform(-2, 2, (300, 2))
    corner = LinearRoad([-2.0, 0, 4], [4.0, 0, 2])
    normals = np.array([[2.0, 1.0], [-0.5, 1.0]])
    if dim == 2:
        both = SeveralRoads([Plane((0, 0), normal) for normal in normals])
        gap, normal, foot = both.closest(points)
    else:
        both = SeveralRoads([Plane((0, 0, 0), (normal[0], 0, normal[1])) for normal in normals])
        gap, normal, foot = both.closest(np.insert(points, 1, 7, axis=1))
        normal, foot = normal[:, [0, 2]], foot[:, [0, 2]]
    for one, other in zip((gap, normal, foot), corner.closest(points)):
        np.testing.assert_allclose(one, other, atol=1e-12)
    mean = SeveralRoads([Plane((0, 0), (0, 1)), Plane((0, 0), (1, 0))]).closest(np.zeros((1, 2)))[1]
    np.testing.assert_allclose(mean, np.full((1, 2), 0.5**0.5))


def test_a_cylinder_between_two_plates_is_pressed_alike_by_both():
    """A bar of square section between floor and ceiling that is too low for it, pushed out by both."""
    body = Body.from_grid(rectangle(2.0, 1.0, 8, 4))
    elasticity = Elasticity(body, Isotropic(1e3, 0.0))
    support = Support(body).fix_node(body.nearest_node((1.0, 0.5)), x=0.0)
    system = elasticity.system(elasticity.body_force((0.0, 0.0)), support)
    plates = SeveralRoads([Plane(), Plane((0.0, 0.98), (0.0, -1.0))])
    contact = BodyOnRoad(system, ["bottom", "top"], plates, interference=True)
    np.testing.assert_allclose(contact.pressure(solve(contact)), 1e3 * 0.02, rtol=1e-8)


def test_a_ring_in_a_right_angle_of_two_walls():
    """Half its weight on each wall of a groove of 45 degrees; nothing is fixed but x on top."""
    body = Body.from_grid(ring(1.0, 0.3, 16, 2))
    elasticity = Elasticity(body, Isotropic(1e6, 0.3))
    load = elasticity.body_force((0.0, -1.0))
    groove = SeveralRoads([Plane((0, -0.42), (1, 1)), Plane((0, -0.42), (-1, 1))])
    system = elasticity.system(load, Support(body).fix_node(body.nearest_node((0, 2)), x=0.0))
    contact = BodyOnRoad(system, "outer", groove)
    solution = solve(contact, "algebraic")
    left = solution.contact_force[contact.points[:, 0] < 0].sum(axis=0)
    weight = -load.sum()
    np.testing.assert_allclose(left, [weight / 2, weight / 2], rtol=1e-6)


def test_a_block_in_a_corner_of_space_stands_on_floor_and_against_two_walls():
    body = Body.from_grid(box(1.0, 1.0, 1.0, 2, 2, 2))
    elasticity = Elasticity(body, Isotropic(1e3, 0.3))
    force = (-1.0, -2.0, -3.0)
    system = elasticity.system(elasticity.body_force(force), Support(body))
    walls = SeveralRoads([Plane((0, 0, 0), normal) for normal in np.eye(3)])
    body.mark("all", lambda x: x[0] > -1)
    contact = BodyOnRoad(system, "all", walls)
    solution = solve(contact)
    np.testing.assert_allclose(solution.contact_force.sum(axis=0), [1, 2, 3], rtol=1e-8)
    at = contact.points + contact.displacement(solution)[contact.nodes]
    assert walls.closest(at)[0].min() > -1e-11


@pytest.mark.parametrize("mu", [0.2, 0.9])
def test_a_belt_under_a_block_beside_a_wall(mu):
    """The belt drags a block against a wall that holds it, and slides on beneath."""
    body = Body.from_grid(rectangle(1.0, 1.0, 4, 4))
    elasticity = Elasticity(body, Isotropic(1e3, 0.3))
    system = elasticity.system(elasticity.body_force((0.0, -5.0)))
    wall = Plane((1.001, 0.0), (-1.0, 0.0))
    scene = SeveralRoads([MovingRoad(Plane(), (1.0, 0.0)), wall])
    contact = BodyOnRoad(system, ["bottom", "right"], scene, friction=mu)
    solution = list(follow(contact, np.linspace(0.005, 0.02, 4)))[-1]
    under = (contact.points[:, 1] < 1e-9) & (contact.points[:, 0] < 0.99)
    drag, pressure = solution.contact_force[under].sum(axis=0)
    assert drag == pytest.approx(mu * pressure, rel=1e-6) and drag > 0
    assert solution.contact_force.sum(axis=0) == pytest.approx([0, 5], abs=1e-7)


@pytest.mark.parametrize("dim", [2, 3])
def test_roads_that_turn_and_move_carry_what_sticks_to_them(dim):
    centre = np.array([1.0, 2.0, 3.0])[:dim]
    road = MovingRoad(
        RoundRoad(np.zeros(dim), np.eye(dim)[-1], 2.0),
        lambda t: t * np.ones(dim),
        turn=lambda t: 0.3 * t,
        centre=centre,
        axis=None if dim == 2 else (0.0, 0.0, 1.0),
    )
    points = random.uniform(-3, 3, (20, dim))
    carried = road.carried(points, 0.0, 2.0)
    start, end = road.road.closest(points), road.at(2.0).closest(carried)
    np.testing.assert_allclose(start[0], end[0], atol=1e-13)
    np.testing.assert_allclose(road.carried(start[2], 0.0, 2.0), end[2], atol=1e-13)
    np.testing.assert_allclose(end[2] + end[0][:, None] * end[1], carried, atol=1e-13)
    np.testing.assert_allclose(road.carried(carried, 2.0, 0.0), points, atol=1e-13)
    distance = np.linalg.norm(points - centre, axis=1)
    np.testing.assert_allclose(np.linalg.norm(carried - centre - 2, axis=1), distance)


def test_a_block_on_a_table_that_tilts_slides_beyond_the_angle_of_friction():
    """Weight on a table that turns slowly: held at tan(angle) < mu, pulled along beyond it."""
    body = Body.from_grid(rectangle(2.0, 0.5, 8, 2, corner=(-1.0, 0.0)))
    elasticity = Elasticity(body, Isotropic(1e4, 0.3))
    table = MovingRoad(Plane(), turn=lambda t: t)
    system = elasticity.system(elasticity.body_force((0.0, -1.0)))
    contact = BodyOnRoad(system, "bottom", table, friction=0.05)
    for angle, solution in zip((0.02, 0.04), follow(contact, [0.02, 0.04])):
        force = solution.contact_force.sum(axis=0)
        assert force == pytest.approx([0, 1], abs=1e-7)
        normal = np.array([-np.sin(angle), np.cos(angle)])
        along = np.array([np.cos(angle), np.sin(angle)])
        assert abs(force @ along) / (force @ normal) == pytest.approx(np.tan(angle))


def test_a_list_of_roads_is_told_what_to_do():
    body = Body.from_grid(rectangle(1.0, 1.0, 2, 2))
    system = Elasticity(body, Isotropic(1.0, 0.3)).system(np.zeros((9, 2)))
    with pytest.raises(ValueError, match="of type list; .*SeveralRoads"):
        BodyOnRoad(system, "bottom", [Plane(), Plane()])
    with pytest.raises(ValueError, match="no roads"):
        SeveralRoads([])
    with pytest.raises(ValueError, match="does not move"):
        MovingRoad(Plane())


def quarter(refinements):
    """The right half of a half disc of radius 10, its lowest point at the origin, with "axis" and "arc"."""
    whole = half_cylinder_nested(10.0, refinements)
    cells = whole.cells[whole.points[whole.cells, 0].mean(axis=1) > 0]
    used, number = np.unique(cells, return_inverse=True)
    body = Body.from_grid(Grid(whole.points[used], number.reshape(cells.shape), "quadrilateral"))
    body.mark("axis", lambda x: x[0] < 1e-9).mark("top", lambda x: x[1] > 10 - 1e-9)
    return body.mark("arc", lambda x: np.abs(np.hypot(x[0], x[1] - 10) - 10) < 1e-9)


def test_hertzs_sphere_as_a_body_of_revolution():
    """R = 10, F = 15 kN: Hertz's shape fitted to the pressure has his p0 within 0.5 per cent."""
    body = quarter(3)
    elasticity = Elasticity(body, Isotropic(210e3, 0.3), "axisymmetric")
    load = elasticity.total_force("top", (0.0, -15e3))
    contact = BodyOnRoad(elasticity.system(load, Support(body).fix("axis", x=0.0)), "arc", Plane())
    solution = solve(contact)
    hertz = HertzSphere(15e3, 10.0, 210e3, 0.3)
    pressure, r = contact.pressure(solution), contact.points[:, 0]
    shape = np.sqrt(np.maximum(1 - (r / hertz.a) ** 2, 0))
    assert solution.pressure_force.sum() == pytest.approx(15e3)
    assert contact.area @ (pressure * shape) / (contact.area @ shape**2) == pytest.approx(hertz.p0, rel=5e-3)
    inner = (r > 0.1) & (r < 0.7)
    np.testing.assert_allclose(pressure[inner], hertz.p0 * shape[inner], rtol=6e-3)
    spacing = np.diff(np.sort(r[r < 1])).max()
    assert r[pressure > 0].max() - spacing < hertz.a < r[(pressure == 0)].min() + spacing


def test_lames_tube_as_a_body_of_revolution():
    """The ring on the shaft again: 76.197 on every node, and the stress around as Lame's."""
    body = Body.from_grid(rectangle(10.0, 2.0, 24, 4, corner=(20.0, 0.0)))
    elasticity = Elasticity(body, Isotropic(210e3, 0.3), "axisymmetric")
    support = Support(body).fix(["bottom", "top"], y=0.0)
    system = elasticity.system(np.zeros(body.coordinates.shape), support)
    contact = BodyOnRoad(system, "left", Plane((20.02, 0.0), (1.0, 0.0)), interference=True)
    solution = solve(contact)
    np.testing.assert_allclose(contact.pressure(solution), 76.197, rtol=1e-3)
    r = body.coordinates[body.cells, 0].mean(axis=1)
    around = 76.197 * 400 / 500 * (1 + 900 / r**2)
    np.testing.assert_allclose(elasticity.stress(contact.displacement(solution))[:, 2, 2], around, rtol=2e-3)
    across = Body.from_grid(rectangle(1.0, 1.0, 2, 2, corner=(-0.5, 0.0)))
    with pytest.raises(ValueError, match="must have x >= 0"):
        Elasticity(across, Isotropic(1, 0.3), "axisymmetric")


@pytest.mark.parametrize("pull, slides", [(0.98, False), (1.02, True)])
def test_a_slider_pulled_by_a_spring_slips_when_the_spring_pulls_more_than_friction(pull, slides):
    body = Body.from_grid(rectangle(1.0, 0.5, 8, 4))
    elasticity = Elasticity(body, Isotropic(1e4, 0.3))
    mu, weight, k = 0.3, 4.0, 20.0
    support = Support(body).spring("right", x=k, end=lambda t: (t * mu * weight / k, 0.0))
    system = elasticity.system(elasticity.body_force((0.0, -2 * weight)), support)
    contact = BodyOnRoad(system, "bottom", Plane(), friction=mu)
    solution = list(follow(contact, np.linspace(0.2, 1, 5) * pull))[-1]
    sheet = contact.reactions(solution)
    spring = sheet.force["ground"][0] + sheet.force["loads"][0]
    assert spring == pytest.approx(mu * weight * min(pull, 1), rel=1e-8 if slides else 5e-3)
    assert sheet.force["contact"] == pytest.approx([-spring, weight])
    least = contact.displacement(solution)[:, 0].min()
    assert (least > 5e-4) == slides and abs(least) < 1.2e-3


def test_springs_bear_what_hangs_on_them_and_dashpots_end_the_swing():
    """A stiff block on springs of stiffness k: it sinks by weight / k; with dashpots the swing dies out."""
    body = Body.from_grid(box(1.0, 1.0, 1.0, 2, 2, 2, corner=(0.0, 0.0, 5.0)))
    elasticity = Elasticity(body, Isotropic(1e6, 0.3))
    support = Support(body).spring("bottom", z=40.0).spring(["left", "right"], x=1.0, y=1.0)
    support.dashpot("top", z=12.0).dashpot(body.nearest_node((0, 0, 5)), x=1.0)
    system = elasticity.system(elasticity.body_force((0.0, 0.0, -3.0)), support, density=1.0)
    contact = BodyOnRoad(system, "bottom", Plane())
    solution = solve(contact)
    assert contact.displacement(solution)[:, 2].mean() == pytest.approx(-3 / 40, rel=1e-3)
    scheme = Newmark(MovingBody.from_contact(contact), 0.02)
    state = scheme.run(scheme.start(), 200)
    assert state.displacement[:, 2].mean() == pytest.approx(-3 / 40, rel=2e-2)


@pytest.mark.parametrize(
    "add, words",
    [
        (lambda s: s.spring("bottom", x=-1.0), "finite number >= 0"),
        (lambda s: s.spring("bottom"), "give some along x, y"),
        (lambda s: s.spring("bottom", z=1.0), "give some along x, y"),
        (lambda s: s.spring("floor", x=1.0), "no boundary 'floor'"),
        (lambda s: s.dashpot(99, x=1.0), "no node 99"),
    ],
)
def test_bad_springs_are_refused(add, words):
    with pytest.raises(ValueError, match=words):
        add(Support(Body.from_grid(rectangle(1.0, 1.0, 2, 2))))
