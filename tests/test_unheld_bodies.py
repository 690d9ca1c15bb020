"""Bodies that nothing but the contact holds, met from outside: light and heavy, near and far."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.sparse import bsr_array, csr_array
from scipy.sparse.csgraph import connected_components

from forms import Elasticity, Isotropic, Support
from geometry import Body, LinearRoad, MovingRoad, Plane, box, half_ball, half_cylinder, rectangle, ring
from model import BodyOnRoad, ContactSolver, coulomb, follow, solve, static_kinetic
from model.problem.rigid_modes import bodies
from model.quasistatics.curved_contact import CurvedContact

CYLINDER = Elasticity(Body.from_grid(half_cylinder(10.0)), Isotropic(210e3, 0.3))


def cylinder(P, height=0.0):
    body = CYLINDER.body
    support = Support(body).fix_node(body.nearest_node((0.0, 10.0)), x=0.0)
    system = CYLINDER.system(CYLINDER.total_force("top", (0.0, -P)), support)
    return BodyOnRoad(system, "arc", Plane((0.0, -height))).problem


@pytest.mark.parametrize(("P", "count"), [(1e4, 21), (3e3, 11), (1e3, 7), (1.0, 1), (1e-4, 1)])
def test_a_cylinder_under_any_load(P, count):
    solution = solve(cylinder(P), "direct")
    assert np.count_nonzero(solution.status) == count
    assert solution.residual < 1e-10
    assert np.abs(solution.contact_force.sum(axis=0) - (0.0, P)).max() < 1e-8 * P


@pytest.mark.parametrize("height", [1e-3, 1.0, 100.0])
def test_a_cylinder_from_any_height(height):
    near, far = solve(cylinder(1e3), "direct"), solve(cylinder(1e3, height), "direct")
    assert np.abs(far.contact_force - near.contact_force).max() < 1e-8 * 1e3
    assert np.abs(far.displacement + (0.0, height) - near.displacement).max() < 1e-10 * max(height, 1.0)


def test_a_ring_falls_into_a_groove_and_leans_on_both_walls():
    body = Body.from_grid(ring(1.0, 0.3, 16, 2))
    elasticity = Elasticity(body, Isotropic(1e6, 0.3))
    support = Support(body).fix_node(body.nearest_node((0.0, 2.0)), x=0.0)
    system = elasticity.system(elasticity.body_force((0.0, -1.0)), support)
    slope = np.array([-5.0, 0.0, 5.0])
    pressed = BodyOnRoad(system, "outer", LinearRoad(slope, np.abs(slope) - 0.6))
    solution = CurvedContact(ContactSolver(pressed.problem, "direct"), pressed.points).solve(pressed.road)
    weight = -system.load.sum()
    forces = solution.contact_force[solution.status > 0]
    assert np.abs(forces - 0.5 * weight * np.sign(forces)).max() < 1e-9 * weight
    assert np.abs(forces.sum(axis=0) - (0.0, weight)).max() < 1e-9 * weight


def test_a_half_ball_lies_on_one_node():
    body = Body.from_grid(half_ball(10.0))
    elasticity = Elasticity(body, Isotropic(210e3, 0.3))
    load = elasticity.body_force((0.0, 0.0, -100.0 / (2 / 3 * np.pi * 1e3)))
    system = elasticity.system(load, Support(body).fix("top", x=0.0, y=0.0))
    solution = solve(BodyOnRoad(system, "sphere", Plane((0, 0, 0), (0, 0, 1))).problem, "direct")
    assert np.abs(solution.contact_force.sum(axis=0) + system.load.sum(axis=0) * (0, 0, 1)).max() < 1e-8
    assert np.count_nonzero(solution.status) == 1


BLOCK = Elasticity(Body.from_grid(rectangle(1.0, 1.0, 4, 4)), Isotropic(1e6, 0.3))


def block(direction, road, friction=None):
    load = BLOCK.body_force(direction)
    return BodyOnRoad(BLOCK.system(load), "bottom", road, friction=friction).problem


def test_who_would_slide_is_told_whereto():
    tilted = Plane((0.0, -0.2), (0.34, 0.94))
    with pytest.raises(
        ValueError, match=r"drives .* translation along \(0.94, -0.34\) that .* force of 0.34"
    ):
        solve(block((0.0, -1.0), tilted))
    with pytest.raises(
        ValueError, match=r"drives .* translation along \(0.94, -0.34\) that .* force of 0.34"
    ):
        solve(block((0.0, -1.0), tilted, 0.1))
    assert solve(block((0.0, -1.0), tilted, 0.5), "direct").residual < 1e-10


def test_who_would_topple_is_told_about_which_point():
    load = np.zeros_like(BLOCK.body.coordinates)
    load[BLOCK.body.nearest_node((1.0, 1.0))] = (0.0, -1.0)
    load[BLOCK.body.nearest_node((0.0, 1.0))] = (0.0, -1.0)
    system = BLOCK.system(load)
    bottom = BodyOnRoad(system, "bottom", Plane(), friction=0.5, reach=1.0).problem
    assert solve(bottom, "direct").residual < 1e-10
    load[BLOCK.body.nearest_node((0.0, 1.0))] = (0.0, 1.0)
    with pytest.raises(ValueError, match=r"a rotation about \("):
        solve(BodyOnRoad(BLOCK.system(load), "bottom", Plane(), friction=0.5).problem)


@pytest.mark.parametrize("reach", [0.05, None])
def test_candidates_far_from_the_road_do_no_harm(reach):
    body = BLOCK.body
    support = Support(body).fix_node(body.nearest_node((0.0, 1.0)), x=0.0)
    system = BLOCK.system(BLOCK.body_force((0.0, -1.0)), support)
    sides = ["bottom", "left", "right", "top"]
    solution = solve(BodyOnRoad(system, sides, Plane(), reach=reach).problem, "direct")
    assert np.abs(solution.contact_force.sum(axis=0) - (0.0, 1.0)).max() < 1e-9


@pytest.mark.parametrize("correction", ["direct", "algebraic"])
def test_a_body_that_no_force_moves_along_the_road_stays_there_and_says_so(correction):
    # rounding in A times the free motion leaves 1.4e-10 with some libraries
    solution = solve(block((0.0, -1.0), Plane((0.0, -0.1))), correction, tolerance=1e-9)
    assert np.abs(solution.contact_force.sum(axis=0) - (0.0, 1.0)).max() < 1e-8
    if correction == "direct":  # the others drift as their rounding goes
        assert np.abs(solution.displacement[:, 0].mean()) < 1e-6
    assert not solution.unique


@pytest.mark.parametrize("correction", ["direct", "algebraic", "multigrid"])
@pytest.mark.parametrize("grid", [rectangle(2.0, 1.0, 4, 2), box(2.0, 1.0, 1.0, 4, 2, 2)], ids=["2-D", "3-D"])
def test_a_body_on_a_smooth_plane_may_be_free_to_go_along_it(grid, correction):
    body = Body.from_grid(grid, 1)
    elasticity = Elasticity(body, Isotropic(1000.0, 0.0))
    support = Support(body).fix("top", **{"xyz"[body.dim - 1]: -0.01})
    system = elasticity.system(np.zeros_like(body.coordinates), support)
    plane = Plane(np.zeros(body.dim), np.eye(body.dim)[-1])
    solution = solve(BodyOnRoad(system, "bottom", plane), correction)
    assert solution.contact_force[:, -1].sum() == pytest.approx(1000.0 * 0.01 * 2.0, rel=1e-9)
    assert np.abs(solution.displacement).max() == pytest.approx(0.01, rel=1e-9)


@given(st.integers(1, 30), st.data())
def test_bodies_are_coupled_nodes_in_the_order_of_their_first(N, data):
    node = st.integers(0, N - 1)
    i, j = np.array(data.draw(st.lists(st.tuples(node, node), max_size=60)), dtype=int).reshape(-1, 2).T
    coupled = np.eye(N)
    coupled[i, j] = coupled[j, i] = 1.0
    label = connected_components(csr_array(coupled), directed=False)[1]
    least = np.array([np.flatnonzero(label == k)[0] for k in label])
    firsts = [k for k in np.unique(least) if np.count_nonzero(least == k) > 1]
    wanted = [firsts.index(k) if k in firsts else -1 for k in least]
    assert np.array_equal(bodies(bsr_array(coupled, blocksize=(1, 1))), wanted)


@pytest.mark.parametrize("stiffness", [10.0, 1.0, 1e-2])
@pytest.mark.parametrize("law", [coulomb(0.4), static_kinetic(0.5, 0.3)])
def test_a_block_on_a_belt_that_a_soft_spring_holds(stiffness, law):
    """It goes with the belt until the spring, which bears what friction gives, pulls more; then it slides."""
    body = Body.from_grid(rectangle(2.0, 1.0, 8, 4))
    elasticity = Elasticity(body, Isotropic(E=1e5, nu=0.3))
    support = Support(body).spring("right", x=stiffness)
    system = elasticity.system(elasticity.total_force("top", (0.0, -20.0)), support)
    speed = 10.0 / stiffness
    contact = BodyOnRoad(system, "bottom", MovingRoad(Plane(), (speed, 0.0)), friction=law)
    held = [s.contact_force[:, 0].sum() for s in follow(contact, [0.2, 0.5, 1.5])]
    slides = 20.0 * law(1.0, 1.0)
    assert held == pytest.approx([2.0, 5.0, slides], rel=2e-3)  # the body itself yields a little


def test_a_hard_body_that_soft_springs_let_go_far_lands_at_once():
    """Its own strain is a ten thousand millionth of the way."""
    elasticity = Elasticity(Body.from_grid(ring(1.0, 0.3, 16, 2)), Isotropic(1e6, 0.3))
    load = 1e-6 * elasticity.body_force((0.0, -1.0))
    weight = -load.sum()
    system = elasticity.system(load, Support(elasticity.body))
    body = BodyOnRoad(system, "outer", Plane((0.0, -20.0), (0.0, 1.0)))
    solver = ContactSolver(body.problem, "direct", progress=False)
    springs = np.zeros((len(body.points), 2, 2))
    lowest, left = np.argmin(body.points[:, 1]), np.argmin(body.points[:, 0])
    springs[lowest] = springs[left] = 0.01 * weight * np.eye(2)
    solution = solver.solve(springs=springs)
    assert solution.steps <= 30  # 30,681 once; 1 or 11, as rounding has it
    way = solution.displacement[body.problem.contact_nodes]
    pulled = -np.einsum("cab,cb->ca", springs, way)
    assert (pulled + solution.contact_force).sum(axis=0) == pytest.approx([0.0, weight], abs=1e-9 * weight)
    assert solution.pressure_force.sum() > 0.5 * weight
    assert solution.gap.min() == 0.0


@pytest.mark.parametrize("share", [1e-12, 1e-9, 1e-7])
@pytest.mark.parametrize("P", [1.0, 1e3])
def test_a_light_body_that_hardly_anything_turns_about_its_pin(P, share):
    """It lies under the pin; what turns it is a tiny share of its load, at its edge, and goes far."""
    body = CYLINDER.body
    pin, edge = body.nearest_node((0.0, 10.0)), body.nearest_node((10.0, 10.0))
    load = CYLINDER.total_force("top", (0.0, -P))
    load[edge, 1] -= share * P
    system = CYLINDER.system(load, Support(body).fix_node(pin, x=0.0, y=0.0))
    pressed = BodyOnRoad(system, "arc", Plane((0.0, 0.0)))
    solution = solve(pressed.problem, "direct")
    arms = pressed.points[:, 0]
    assert abs(arms @ solution.contact_force[:, 1] - share * P * 10.0) < 1e-9 * P * 10.0
    assert solution.residual < 1e-10
