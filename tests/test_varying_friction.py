"""Friction that varies: by node, boundary, road and place; along load paths, in time, on moving roads."""

from pathlib import Path

import numpy as np
import pytest

from forms import Elasticity, Isotropic, Support
from geometry import Body, LinearRoad, MovingRoad, Plane, SeveralRoads, half_cylinder_nested, rectangle
from model import (
    BodyOnRoad,
    ContactProblem,
    MassRedistribution,
    MovingBody,
    Status,
    coulomb,
    follow,
    friction_law,
    solve,
    static_kinetic,
)


def pushed(road, friction, boundary="bottom", **motion):
    """A block on a road, pressed on it and pushed far along it by its top."""
    body = Body.from_grid(rectangle(2.0, 1.0, 8, 4))
    body.mark("left half", lambda x: (x[1] < 1e-9) & (x[0] <= 1.0))
    body.mark("right half", lambda x: (x[1] < 1e-9) & (x[0] >= 1.0))
    support = Support(body).fix("top", **({"x": 0.2, "y": -0.01} | motion))
    elasticity = Elasticity(body, Isotropic(E=1e3, nu=0.3))
    system = elasticity.system(elasticity.body_force((0.0, 0.0)), support)
    return BodyOnRoad(system, boundary, road, friction=friction)


def coefficients(contact, solution):
    """Ratios of friction to pressure where nodes slip, and where these nodes were."""
    slips = solution.status == Status.SLIP
    force, pressure = solution.contact_force[slips], solution.pressure_force[slips]
    normal = contact.road.closest(
        contact.points[slips] + contact.displacement(solution)[contact.nodes][slips]
    )[1]
    along = force - pressure[:, None] * normal
    return np.linalg.norm(along, axis=1) / pressure, contact.points[slips]


@pytest.mark.parametrize("correction", ["none", "direct", "algebraic"])
def test_each_node_has_its_own_coefficient(correction):
    mu = np.linspace(0.05, 0.45, 9)
    contact = pushed(Plane(), mu)
    found, at = coefficients(contact, solve(contact, correction))
    assert len(at) == 9 and found == pytest.approx(np.interp(at[:, 0], [0, 2], [0.05, 0.45]), rel=1e-7)


def test_coefficients_by_boundary_a_shared_node_having_the_first():
    contact = pushed(Plane(), {"left half": 0.1, "right half": 0.4}, ["left half", "right half"])
    found, at = coefficients(contact, solve(contact))
    assert found == pytest.approx(np.where(at[:, 0] <= 1.0, 0.1, 0.4))


def test_coefficients_by_road():
    """A floor, and a wall that the block is pushed against and slides down."""
    roads = SeveralRoads([Plane((0.0, 0.0), (0.0, 1.0)), Plane((-0.01, 0.0), (1.0, 0.0))])
    contact = pushed(roads, [0.3, 0.1], ["bottom", "left"], x=-0.0099, y=-0.08)
    found, at = coefficients(contact, solve(contact))
    inside = (at[:, 0] > 0.0) | (at[:, 1] > 0.0)  # both hold the corner
    assert found[inside] == pytest.approx(np.where(at[inside, 0] > 0.0, 0.3, 0.1), rel=1e-6)
    assert np.unique(found[inside].round(6)).tolist() == [0.1, 0.3]


def test_a_coefficient_that_is_a_function_of_place_is_read_anew_each_step():
    contact = pushed(Plane(), lambda x: 0.1 + 0.1 * (x[:, 0] > 2.05), x=lambda t: 0.2 * t)
    first, *_, last = follow(contact, [0.5, 1.0, 1.5])
    assert coefficients(contact, first)[0] == pytest.approx(0.1)
    found, at = coefficients(contact, last)
    assert found[at[:, 0] == 2.0] == pytest.approx(0.2) and found[at[:, 0] < 1.0] == pytest.approx(0.1)


def test_places_on_a_road_that_moves_go_with_it():
    belt = MovingRoad(Plane(), (-1.0, 0.0))
    contact = pushed(belt, lambda x: 0.1 + 0.2 * (x[:, 0] > 2.5), x=0.0)
    *_, last = follow(contact, [0.5, 1.0, 1.5])
    force, pressure = last.contact_force, last.pressure_force
    expected = np.where(contact.points[:, 0] + last.displacement[contact.nodes, 0] + 1.0 > 2.5, 0.3, 0.1)
    clear = np.abs(contact.points[:, 0] + 1.0 - 2.5) > 0.1  # of the edge, as the step began
    assert np.abs(force[clear, 0]) == pytest.approx((expected * pressure)[clear], rel=1e-6)


def test_all_corrections_agree_on_nested_meshes():
    body = Body.from_grid(half_cylinder_nested(10.0), 1)
    elasticity = Elasticity(body, Isotropic(E=210e3, nu=0.3))
    support = Support(body).platen("top")
    load = elasticity.total_force("top", (400.0, -3e3))
    contact = BodyOnRoad(
        elasticity.system(load, support), "arc", Plane(), friction=lambda x: 0.3 + 0.2 * np.sin(9 * x[:, 0])
    )
    one, other = (solve(contact, correction) for correction in ("direct", "multigrid"))
    assert one.displacement == pytest.approx(other.displacement, abs=1e-8 * np.abs(one.displacement).max())


def test_other_laws_vary_as_well():
    law = static_kinetic(lambda x: 0.2 + 0.0 * x[:, 0], np.linspace(0.05, 0.15, 9))
    contact = pushed(Plane(), law)
    found, at = coefficients(contact, solve(contact))
    assert found == pytest.approx(np.interp(at[:, 0], [0, 2], [0.05, 0.15]), rel=1e-7)
    contact = pushed(Plane(), friction_law(lambda p, slip, state, mu: 0.5 * mu * p, np.linspace(0.1, 0.3, 9)))
    found, at = coefficients(contact, solve(contact))
    assert found == pytest.approx(np.interp(at[:, 0], [0, 2], [0.05, 0.15]), rel=1e-7)


@pytest.mark.parametrize("road", [Plane(), LinearRoad([-50.0, 50.0], [0.0, 0.0])])
def test_a_block_slides_onto_ice_as_far_as_its_energy_lasts(road):
    """Distance v^2 / (2 mu g) on one ground; what is left over at the edge goes further on the next."""
    mu, ice, edge, g, v = 0.4, 0.1, 0.5, 10.0, 2.2
    body = Body.from_grid(rectangle(0.1, 0.01, 6, 4))
    elasticity = Elasticity(body, Isotropic(E=1e6, nu=0.0))
    weight = elasticity.body_force((0.0, -g))
    friction = lambda x: np.where(x[:, 0] < edge, mu, ice)  # noqa: E731
    moving = MovingBody.from_forms(elasticity, 1.0, weight, road, "bottom", friction=friction)
    scheme = MassRedistribution(moving, dt=2e-3)
    state = scheme.start(velocity=np.tile([v, 0.0], (len(body.coordinates), 1)))
    state = scheme.run(state, 750)
    assert np.abs(state.velocity[:, 0]).max() < 1e-3
    # each half of the weight passes the edge with its own end of the block
    left = v**2 / (2 * g) - mu * (edge - 0.05)
    expected = edge - 0.05 + left / ice
    assert state.displacement[:, 0].mean() == pytest.approx(expected, rel=0.01)


def test_problems_keep_their_coefficients(tmp_path: Path):
    contact = pushed(Plane(), np.linspace(0.05, 0.45, 9))
    contact.problem.save(tmp_path / "problem.npz")
    read = ContactProblem.load(tmp_path / "problem.npz")
    assert np.array_equal(read.friction_coefficient, contact.problem.friction_coefficient)
    assert np.array_equal(solve(read).displacement, solve(contact.problem).displacement)


@pytest.mark.parametrize(
    ("friction", "words"),
    [
        (np.ones(4), "9 nodes may touch"),
        ({"left half": 0.2}, "4 nodes that may touch lie on none"),
        ({"under": 0.2}, "under"),
        ([0.2, 0.3], "2 values, one a road, but there are 1 roads"),
        (lambda x: -1.0 + 0.0 * x[:, 0], "finite number >= 0"),
        (lambda x: 0.2 + x, "shape"),
        ({"left half": -0.2, "right half": 0.1}, "finite number >= 0"),
    ],
)
def test_friction_that_makes_no_sense_is_refused(friction, words):
    with pytest.raises((ValueError, KeyError), match=words):
        solve(pushed(Plane(), friction))


def test_laws_by_boundary_need_a_body():
    with pytest.raises(ValueError, match="by boundaries or by roads"):
        coulomb({"arc": 0.2}).nodes(np.zeros(3))
    with pytest.raises(ValueError, match="0 parameters after its coefficient, but 1"):
        friction_law(lambda p, slip, state: 0.1 * p, 0.1, 0.2)
