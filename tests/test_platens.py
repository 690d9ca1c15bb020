"""Platens that tilt, and platens that touch: rigid plates and rigid feet."""

import numpy as np
import pytest

from forms import Elasticity, Hyperelasticity, Isotropic, NeoHookean, Support
from geometry import Body, Plane, box, rectangle
from model import BodyOnRoad, MovingBody, follow, solve

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
    with pytest.raises(ValueError, match="tilt by nan"):
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
