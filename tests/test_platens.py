"""Platens that tilt, and platens that touch: rigid plates and rigid feet."""

import numpy as np
import pytest

from forms import Elasticity, Hyperelasticity, Isotropic, NeoHookean, Support
from geometry import Body, MovingRoad, Plane, RoundRoad, box, rectangle
from model import BodyOnRoad, MassRedistribution, MovingBody, follow, solve

E = 1e3


def block(dim, n=8):
    grid = rectangle(2.0, 1.0, 2 * n, n) if dim == 2 else box(2.0, 1.5, 1.0, 6, 5, 4)
    return Elasticity(Body.from_grid(grid), Isotropic(E, nu=0.0))


def eccentric(elasticity, place, P=5.0):
    load = np.zeros_like(elasticity.body.coordinates)
    load[elasticity.body.nearest_node(place), -1] = -P
    return load


@pytest.mark.parametrize("correction", ["direct", "algebraic", "none"])
def test_a_plate_under_an_eccentric_force_tilts_as_a_beam_bends(correction):
    """p = P/b (1 + 12 e x / b^2), and the angle P e h / (E I), I = b^3 / 12, exact for nu = 0."""
    elasticity, P, e, b, h = block(2, 8 if correction != "none" else 4), 5.0, 0.25, 2.0, 1.0
    support = Support(elasticity.body).platen("top", tilt=True).fix("top", x=0.0)
    contact = BodyOnRoad(elasticity.system(eccentric(elasticity, (1.0 + e, h)), support), "bottom", Plane())
    solution = solve(contact, correction)
    x = contact.points[:, 0] - 1.0
    assert solution.pressure_force.sum() == pytest.approx(P)
    assert x @ solution.pressure_force == pytest.approx(P * e, rel=1e-8)
    top = elasticity.body.nodes("top")
    slope, _ = np.polyfit(elasticity.body.coordinates[top, 0], contact.displacement(solution)[top, 1], 1)
    assert slope == pytest.approx(-P * e * h / (E * b**3 / 12), rel=0.02 if correction != "none" else 0.1)
    if correction != "none":
        expected = P / b * (1 + 12 * e * x / b**2)
        assert contact.pressure(solution)[1:-1] == pytest.approx(expected[1:-1], rel=0.02)
    sheet = contact.reactions(solution, about=(1.0, h))
    assert sheet.remainder < 1e-9 and abs(sum(sheet.moment.values())[0]) < 1e-8


def test_a_plate_in_space_tilts_both_ways():
    elasticity, P = block(3), 5.0
    place = np.array([4 / 3, 0.9, 1.0])
    support = Support(elasticity.body).platen("top", tilt=(True, True, False)).fix("top", x=0.0, y=0.0)
    load = eccentric(elasticity, place) + elasticity.total_force("top", (0.0, 0.0, -10.0))
    contact = BodyOnRoad(elasticity.system(load, support), "bottom", Plane())
    solution = solve(contact)
    moment = (contact.points[:, :2] - [1.0, 0.75]).T @ solution.pressure_force
    assert solution.pressure_force.min() > 0.0
    assert moment == pytest.approx(P * (place[:2] - [1.0, 0.75]), rel=1e-8)
    top = elasticity.body.nodes("top")
    x, uz = elasticity.body.coordinates[top, :2], contact.displacement(solution)[top, 2]
    plane = np.linalg.lstsq(np.column_stack([x, np.ones(len(x))]), uz)[0]
    np.testing.assert_allclose(np.column_stack([x, np.ones(len(x))]) @ plane, uz, atol=1e-12)
    inertia = np.array([1.5 * 2.0**3, 2.0 * 1.5**3]) / 12
    assert plane[:2] == pytest.approx(-P * (place[:2] - [1.0, 0.75]) / (E * inertia), rel=0.1)


@pytest.mark.parametrize("dim", [2, 3])
def test_a_plate_that_is_turned_is_where_its_nodes_would_be_put_one_by_one(dim):
    elasticity = block(dim, 3)
    body = elasticity.body
    top = body.nodes("top")
    arm = body.coordinates[top] - body.coordinates[top].mean(axis=0)
    angle = np.array([0.0, 0.0, 2e-3]) if dim == 2 else np.array([1e-3, -2e-3, 1e-3])
    turned = np.cross(angle, np.pad(arm, ((0, 0), (0, 3 - dim))))[:, :dim]
    turned[:, -1] -= 0.005
    down = {"x": 0.0, "y": -0.005} if dim == 2 else {"x": 0.0, "y": 0.0, "z": -0.005}
    tilt = (lambda t: t * angle[2]) if dim == 2 else [lambda t, a=a: t * a for a in angle]
    plate = Support(body).platen("top", tilt=tilt).fix("top", **down)
    nodes = Support(body)
    for node, u in zip(top, turned):
        nodes.fix_node(node, *u)
    zero = np.zeros_like(body.coordinates)
    found, reactions = [], []
    for support in (plate, nodes):
        contact = BodyOnRoad(elasticity.system(zero, support), "bottom", Plane(), friction=0.3)
        solution = solve(contact, time=1.0)
        found.append(contact.displacement(solution))
        sheet = contact.reactions(solution)
        reactions.append(np.concatenate([*sheet.at(top)]))
    np.testing.assert_allclose(found[0], found[1], atol=1e-11)
    np.testing.assert_allclose(reactions[0], reactions[1], rtol=1e-7, atol=1e-9)


def test_two_plates_of_which_one_tilts_and_a_path_of_angles():
    elasticity = block(2, 4)
    support = Support(elasticity.body).platen("left").platen("right", tilt=lambda t: 1e-3 * t)
    support.fix("left", x=0.0, y=-0.01).fix("right", x=0.0, y=-0.01)
    system = elasticity.system(elasticity.body_force((0.0, 0.0)), support)
    contact = BodyOnRoad(system, "bottom", Plane())
    right = elasticity.body.nodes("right")
    for solution in follow(contact, [0.5, 1.0]):
        u = contact.displacement(solution)[right]
        y = elasticity.body.coordinates[right, 1]
        assert np.polyfit(y, u[:, 0], 1)[0] == pytest.approx(-1e-3 * solution.time)
        assert u[:, 1] == pytest.approx(-0.01)


def test_tilts_that_make_no_sense_are_refused():
    flat, solid = block(2, 2), block(3)
    with pytest.raises(ValueError, match="give True, or one angle"):
        Support(flat.body).platen("top", tilt=[1.0, 2.0])
    with pytest.raises(ValueError, match="three angles, about x, y and z"):
        Support(solid.body).platen("top", tilt=0.1)
    with pytest.raises(ValueError, match="tilt is nan"):
        Support(flat.body).platen("top", tilt=np.nan)
    support = Support(flat.body).platen("top", tilt=True).fix("left", x=0.0)
    with pytest.raises(ValueError, match="prescribed by another boundary"):
        flat.system(flat.body_force((0.0, 0.0)), support)
    support = Support(flat.body).platen("top", tilt=True)
    system = flat.system(flat.body_force((0.0, 0.0)), support, density=1.0)
    with pytest.raises(ValueError, match="at rest only"):
        MovingBody.from_contact(BodyOnRoad(system, "bottom", Plane()))
    rubber = Hyperelasticity(flat.body, NeoHookean(E=E, nu=0.3))
    with pytest.raises(ValueError, match="for linear strain only"):
        rubber.system(np.zeros_like(flat.body.coordinates), Support(flat.body).platen("top", tilt=True))


def on_feet(dim, n=2):
    """A block on two feet at the ends of its bottom."""
    elasticity = block(dim, n) if dim == 3 else block(dim, 4)
    body = elasticity.body
    body.mark("left foot", lambda x: (x[dim - 1] < 1e-9) & (x[0] < 0.51))
    body.mark("right foot", lambda x: (x[dim - 1] < 1e-9) & (x[0] > 1.49))
    return elasticity


@pytest.mark.parametrize("dim", [2, 3])
def test_rigid_feet_bear_the_weight_by_the_lever(dim):
    elasticity = on_feet(dim)
    body = elasticity.body
    support = Support(body).platen("left foot").platen("right foot")
    load = elasticity.total_force("right", (0.0,) * (dim - 1) + (-4.0,))
    load += elasticity.body_force((0.0,) * (dim - 1) + (-1.0,))
    contact = BodyOnRoad(elasticity.system(load, support), ["left foot", "right foot"], Plane(), friction=0.5)
    assert contact.nodes.size == 2
    solution = solve(contact)
    sheet = contact.reactions(solution)
    assert solution.pressure_force.sum() == pytest.approx(-load[:, -1].sum())
    assert sheet.remainder < 1e-9
    width = 1.0 if dim == 2 else 1.5
    assert contact.area == pytest.approx(0.5 * width, rel=0.35)
    assert contact.pressure(solution) == pytest.approx(solution.pressure_force / contact.area)
    u = contact.displacement(solution)
    for foot in ("left foot", "right foot"):
        assert (
            np.ptp(u[body.nodes(foot)], axis=0).max() < 1e-15 and abs(u[body.nodes(foot), -1]).max() < 1e-15
        )


def test_a_foot_on_a_slope_touches_with_its_lower_end_and_sticks_up_to_mu():
    """Incline: it holds while tan(theta) < mu, to 1e-6, the force being the whole weight's."""
    mu, weight = 0.3, 2.0
    for slope, holds in ((mu * (1 - 1e-6), True), (mu * (1 + 1e-6), False)):
        elasticity = on_feet(2)
        body = elasticity.body
        support = Support(body).platen("bottom")
        system = elasticity.system(elasticity.body_force((0.0, -weight / 2)), support)
        contact = BodyOnRoad(system, "bottom", Plane((2.0, 0.0), (-slope, 1.0)), friction=mu)
        assert contact.points[0] == pytest.approx([2.0, 0.0])
        if holds:
            solution = solve(contact)
            assert solution.contact_force.sum(axis=0) == pytest.approx([0.0, weight], abs=1e-9)
        else:
            with pytest.raises(ValueError, match="drives the body into a translation"):
                solve(contact)


def test_a_rigid_foot_slides_as_far_as_friction_lets_it():
    """v^2 / (2 mu g)."""
    mu, g, v = 0.4, 10.0, 1.0
    elasticity = on_feet(2)
    support = Support(elasticity.body).platen("bottom")
    weight = elasticity.body_force((0.0, -g))
    system = elasticity.system(weight, support, density=1.0, damping=(0.0, 1e-2))
    contact = BodyOnRoad(system, "bottom", Plane(), friction=mu)
    scheme = MassRedistribution(MovingBody.from_contact(contact), 2e-3)
    thrown = np.tile([v, 0.0], (len(system.coordinates), 1))
    state = scheme.run(scheme.start(solve(contact).displacement, thrown), 250)
    foot = contact.problem.contact_nodes[0]
    assert np.abs(state.velocity[foot]).max() == 0.0 and state.count == 1
    assert state.displacement[foot, 0] == pytest.approx(v**2 / (2 * mu * g), rel=0.04)


def test_feet_that_cannot_be_solved_say_why():
    elasticity = on_feet(2)
    zero = elasticity.body_force((0.0, -1.0))
    system = elasticity.system(zero, Support(elasticity.body).platen("bottom", tilt=True))
    with pytest.raises(ValueError, match="rigid face presses on a rigid road is not determined"):
        BodyOnRoad(system, "bottom", Plane())
    system = elasticity.system(zero, Support(elasticity.body).platen("bottom"))
    for road in (RoundRoad((1.0, 0.0), (0.0, 1.0), 9.0), MovingRoad(Plane(), turn=lambda t: t)):
        with pytest.raises(ValueError, match="a rigid foot; it needs a plane as a road"):
            BodyOnRoad(system, "bottom", road)
