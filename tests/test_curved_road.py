"""Contact with curved roads: nodes end on them, forces along their normals; corners, sticking, sliding."""

import numpy as np
import pytest

from forms import Elasticity, Isotropic, Support
from geometry import (
    Body,
    LinearRoad,
    MovingRoad,
    Plane,
    RoundRoad,
    ShiftedRoad,
    SmoothRoad,
    half_cylinder,
    half_cylinder_nested,
    join,
    rectangle,
    shifted,
)
from model import ContactSolver, NotConverged, Status, solve
from model.closed_forms.hertz import HertzCylinder
from model.quasistatics.curved_contact import CurvedContact
from model.results.body_on_road import BodyOnRoad

P, R, E, NU = 1e4, 10.0, 210e3, 0.3


def cylinder(road, friction=None, refinements=None):
    grid = half_cylinder(R) if refinements is None else half_cylinder_nested(R)
    body = Body.from_grid(grid, refinements or 0)
    elasticity = Elasticity(body, Isotropic(E, NU))
    load = elasticity.total_force("top", (0, -P))
    system = elasticity.system(load, Support(body).platen("top").fix("top", x=0.0))
    return BodyOnRoad(system, "arc", road, friction=friction, reach=0.2 * R)


def rubber(road, friction=None, width=20.0, columns=40, load=10.0, holding=True):
    body = Body.from_grid(rectangle(width, 10.0, columns, 20, corner=(-width / 2, 0)))
    elasticity = Elasticity(body, Isotropic(5.0, NU))
    support = Support(body).platen("top")
    if holding:
        support.fix("top", x=0.0)
    system = elasticity.system(elasticity.total_force("top", (0, -load)), support)
    return BodyOnRoad(system, "bottom", road, friction=friction)


def settle(body, road, correction="direct", **options):
    contact = CurvedContact(ContactSolver(body.problem, correction), body.points)
    return contact.solve(road, **options), contact


def check(body, road, solution, contact, mu=0.0):
    """Touching nodes on the road, others above it, forces within the cone about the road's own normal."""
    at = body.points + solution.displacement[body.problem.contact_nodes]
    gap, _, _ = road.closest(at)
    touching = solution.status != Status.FREE
    size = np.ptp(body.problem.coordinates, axis=0).max()
    assert np.abs(gap[touching]).max() <= 1e-12 * size
    assert gap.min() >= -1e-12 * size
    assert np.all(solution.gap >= 0) and np.all(solution.gap[touching] == 0)
    assert np.all(solution.contact_force[~touching] == 0)
    pressure = np.sum(solution.contact_force * contact.normal, axis=1)
    traction = solution.contact_force - pressure[:, None] * contact.normal
    assert np.all(pressure >= -1e-12 * pressure.max())
    assert np.all(np.linalg.norm(traction, axis=1) <= mu * pressure + 1e-8 * pressure.max())
    assert solution.residual <= 1e-10


@pytest.mark.parametrize("friction", [None, 0.5])
def test_a_plane_given_as_a_profile_gives_the_answer_of_the_plane(friction):
    flat = solve(cylinder(Plane(), friction).problem, "direct")
    x = np.array([-9.0, -0.31, 0.02, 0.4, 9.0])
    for road in (LinearRoad(x, 0 * x), SmoothRoad.through(x, 0 * x)):
        body = cylinder(road, friction)
        solution, contact = settle(body, road)
        assert len(contact.distances) == 1
        scale = np.abs(flat.displacement).max()
        assert np.abs(solution.displacement - flat.displacement).max() <= 1e-12 * scale
        assert np.abs(solution.contact_force - flat.contact_force).max() <= 1e-10 * P


@pytest.mark.parametrize("radius", [15.0, 50.0, -50.0, -20.0])
def test_hertz_on_hills_and_in_hollows(radius):
    road = RoundRoad((0, 0), (0, 1), radius)
    hertz = HertzCylinder(P, 1 / (1 / R + 1 / radius), E, NU)
    body = cylinder(road)
    solution, contact = settle(body, road)
    check(body, road, solution, contact)
    assert body.pressure(solution).max() == pytest.approx(hertz.p0, rel=0.015)
    assert solution.contact_force.sum(axis=0) == pytest.approx([0, P], abs=1e-6 * P)
    assert len(contact.distances) <= 5  # the distance falls quadratically


@pytest.mark.parametrize("correction", ["none", "multigrid"])
def test_corrections_agree_on_a_curved_road(correction):
    road = RoundRoad((0.3, -0.1), (0.02, 1), -30.0)
    one, _ = settle(cylinder(road, 0.3, 1), road, tolerance=1e-11)
    other, _ = settle(cylinder(road, 0.3, 1), road, correction, tolerance=1e-11)
    scale = np.abs(one.displacement).max()
    assert np.abs(one.displacement - other.displacement).max() <= 1e-8 * scale


WAVES = SmoothRoad(lambda x: 0.3 * (np.cos(1.3 * x) - 1), np.linspace(-20, 20, 500))
SAW = LinearRoad([-12, -6.1, -3, 0.05, 3, 6, 12], [0.3, 0, 0.4, 0.0, 0.35, 0.1, 0.3])
random = np.random.default_rng(3)
RUBBLE = LinearRoad(np.sort(random.uniform(-12, 12, 60)), random.uniform(-0.5, 0, 60))


@pytest.mark.parametrize("friction", [None, 0.3, 0.8])
@pytest.mark.parametrize("road", [WAVES, SAW, RUBBLE], ids=["waves", "saw", "rubble"])
def test_rubber_on_rough_roads(road, friction):
    road = ShiftedRoad(road, (0, -1.3))
    body = rubber(road, friction)
    solution, contact = settle(body, road)
    check(body, road, solution, contact, friction or 0.0)
    assert solution.contact_force.sum(axis=0)[1] == pytest.approx(10.0, rel=1e-8)


@pytest.mark.parametrize("friction", [None, 0.2])
def test_a_node_in_a_sharp_hollow_is_held_by_both_slopes(friction):
    """A wedge that is pushed sideways: its tip stays in the corner, the force between the two normals."""
    road = LinearRoad([-5.0, 0, 5], [2.0, 0, 2.0])
    body = Body.from_grid(rectangle(0.4, 1.0, 2, 6, corner=(-0.2, 0.0)))
    body.coordinates[body.nodes("bottom"), 1] += 0.5 * np.abs(body.coordinates[body.nodes("bottom"), 0])
    body.mesh.geometry.x[:, :2] = body.coordinates
    elasticity = Elasticity(body, Isotropic(100.0, NU))
    load = elasticity.total_force("top", (0.1, -1.0))
    system = elasticity.system(load, Support(body).platen("top"))
    contact_body = BodyOnRoad(system, "bottom", road, friction=friction)
    solution, contact = settle(contact_body, road)
    check(contact_body, road, solution, contact, friction or 0.0)
    tip = np.argmin(np.abs(contact_body.points[:, 0]))
    at = contact_body.points + solution.displacement[contact_body.problem.contact_nodes]
    assert at[tip] == pytest.approx([0, 0], abs=1e-11)
    assert solution.contact_force.sum(axis=0) == pytest.approx([-0.1, 1.0], abs=1e-7)


def test_a_road_that_moves_under_a_sticking_body_takes_it_along():
    x = np.linspace(-60, 60, 200)
    moving = MovingRoad(SmoothRoad(lambda x: 0.2 * np.sin(1.1 * x) - 0.2, x), (3.0, 0.5))
    body = rubber(moving.at(0.0), 2.0, holding=False)
    solver = ContactSolver(body.problem, "direct")
    contact = CurvedContact(solver, body.points)
    pressed = contact.solve(moving.at(0.0))
    there = pressed.displacement[body.problem.contact_nodes]
    way = moving.displacement(0.7)
    moved = contact.solve(
        moving.at(0.7),
        tangential_reference=there + way,
        start=pressed.displacement + way,
        start_status=pressed.status,
    )
    np.testing.assert_allclose(moved.displacement, pressed.displacement + way, atol=1e-8)
    assert np.array_equal(moved.status == Status.STICK, pressed.status == Status.STICK)


def test_sliding_over_a_rough_road_comes_to_full_slip():
    mu, load = 0.4, 10.0
    moving = MovingRoad(ShiftedRoad(WAVES, (0, -0.1)), (-1.0, 0.0))
    body = rubber(moving.at(0.0), mu, columns=20, load=load)
    solver = ContactSolver(body.problem, "direct")
    contact = CurvedContact(solver, body.points)
    solution, there = contact.solve(moving.at(0.0)), body.problem.contact_nodes
    forces = []
    for step in range(1, 9):
        way = moving.displacement(0.8 * step) - moving.displacement(0.8 * (step - 1))
        solution = contact.solve(
            moving.at(0.8 * step),
            tangential_reference=solution.displacement[there] + way,
            start=solution.displacement,
            start_status=solution.status,
        )
        check(body, moving.at(0.8 * step), solution, contact, mu)
        forces.append(solution.contact_force.sum(axis=0))
    forces = np.array(forces)
    assert np.all(solution.status[solution.status != Status.FREE] == Status.SLIP)
    np.testing.assert_allclose(forces[:, 1], load, rtol=1e-6)
    assert -forces[-1, 0] / load == pytest.approx(mu, rel=0.6)  # friction, and the slopes of the road


def test_several_bodies_share_a_road_as_if_they_were_alone():
    road = ShiftedRoad(RoundRoad((0, 0), (0, 1), -400.0), (0, -1.0))
    wheel, block = shifted(half_cylinder_nested(R), (-15, 0)), rectangle(8.0, 8.0, 8, 8, corner=(8, 0.0))

    def alone(grid, material, top, touching, load):
        body = Body.from_grid(grid, 1)
        elasticity = Elasticity(body, material)
        system = elasticity.system(sum(elasticity.total_force(t, f) for t, f in zip(top, load)))
        pressed = BodyOnRoad(system, touching, road, friction=0.5)
        return pressed, settle(pressed, road)[0]

    steel, soft = Isotropic(1000.0, NU), Isotropic(10.0, 0.45)
    loads = [(0.0, -10.0), (0.0, -50.0)]
    one, left = alone(wheel, soft, ["top"], "arc", loads[:1])
    other, right = alone(block, steel, ["top"], "bottom", loads[1:])
    both, together = alone(
        join({"wheel": wheel, "block": block}),
        {"wheel": soft, "block": steel},
        ["wheel top", "block top"],
        ("wheel arc", "block bottom"),
        loads,
    )
    on_left = both.points[:, 0] < 0
    for alone_body, solution, here in ((one, left, on_left), (other, right, ~on_left)):
        at = {tuple(np.round(p, 9)): f for p, f in zip(alone_body.points, solution.contact_force)}
        expected = np.array([at[tuple(np.round(p, 9))] for p in both.points[here]])
        np.testing.assert_allclose(together.contact_force[here], expected, atol=1e-6)


def test_rounds_that_do_not_settle_say_so(monkeypatch):
    monkeypatch.setattr("model.quasistatics.sequential_programming.ITERATIONS", 2)
    road = ShiftedRoad(WAVES, (0, -1.3))
    with pytest.raises(
        NotConverged, match="after 2 iterations nodes are .* off it.*smaller load steps"
    ) as caught:
        settle(rubber(road), road)
    assert len(caught.value.history) == 2
