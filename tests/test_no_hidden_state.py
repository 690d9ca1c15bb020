"""A solver remembers nothing that a solution depends on; prescribed displacements are what they are."""

from dataclasses import FrozenInstanceError

import numpy as np
import pytest

from forms import Elasticity, Hyperelasticity, Isotropic, NeoHookean, Support
from geometry import Body, MovingRoad, Plane, rectangle
from model import (
    BodyOnRoad,
    ContactSolver,
    ContactStabilised,
    EnergyMomentum,
    FiniteBody,
    FiniteContact,
    LosslessContact,
    MassRedistribution,
    MovingBody,
    Newmark,
    Status,
    coulomb,
    follow,
    friction_law,
    solve,
    static_kinetic,
    stribeck,
    viscous,
)

ELASTICITY = Elasticity(Body.from_grid(rectangle(1.0, 0.5, 4, 2), refinements=1), Isotropic(1.0, 0.3))


def limited(pressure, slip, state, mu, most):
    """A user's own law: after slip less holds, and never more than the material bears."""
    return min((0.8 if state else 1.0) * mu * pressure, most)


LAWS = {
    "none": None,
    "coulomb": coulomb(0.4),
    "static_kinetic": static_kinetic(0.5, 0.2),
    "stribeck": stribeck(0.5, 0.2, 1e-3),
    "viscous": viscous(0.3, 0.1),
    "by place": coulomb(lambda x: 0.2 + 0.3 * x[:, 0]),
    "own": friction_law(limited, 0.4, 0.01),
}


CORRECTIONS = ["none", "direct", "algebraic", "multigrid"]


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("correction", CORRECTIONS)
def test_two_runs_with_one_solver_are_two_runs_with_two(law, correction):
    push, pull = (ELASTICITY.body_force(force) for force in ((0.0, -0.05), (0.03, 0.0)))
    system = ELASTICITY.system(push, Support(ELASTICITY.body).fix("top", x=0.0, y=0.0))
    problem = BodyOnRoad(system, "bottom", Plane(), friction=LAWS[law]).problem
    held = ELASTICITY.body.nodes("top")
    push[held], pull[held] = 0.0, 0.0
    loads = [push, push + pull, push + 1.2 * pull, push - pull]
    one = ContactSolver(problem, correction, progress=False)
    runs = [list(follow(one, loads, tolerance=1e-9)) for _ in range(2)]
    runs.append(list(follow(ContactSolver(problem, correction, progress=False), loads, tolerance=1e-9)))
    assert np.any(runs[0][1].status == Status.SLIP)
    for other in runs[1:]:
        for a, b in zip(runs[0], other, strict=True):
            assert np.array_equal(a.displacement, b.displacement)
            assert np.array_equal(a.contact_force, b.contact_force)
            assert np.array_equal(a.state, b.state)


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("correction", CORRECTIONS)
def test_two_runs_in_time_with_one_scheme_are_two_runs_with_two(law, correction):
    support = Support(ELASTICITY.body).fix("top", x=lambda t: 0.02 * t, y=lambda t: -0.01 * t)
    system = ELASTICITY.system(np.zeros_like(ELASTICITY.body.coordinates), support, density=1.0)
    body = MovingBody.from_contact(BodyOnRoad(system, "bottom", Plane((0.0, -0.001)), friction=LAWS[law]))
    one, other = (Newmark(body, 0.1, correction=correction) for _ in range(2))
    ends = [[scheme.run(scheme.start(), steps) for steps in (6, 10)] for scheme in (one, one, other)]
    assert ends[0][0].count and np.any(ends[0][1].status == Status.SLIP)
    for again in ends[1:]:
        for a, b in zip(ends[0], again, strict=True):
            for name in ("displacement", "velocity", "acceleration", "contact_force", "status", "memory"):
                assert np.array_equal(getattr(a, name), getattr(b, name)), name


def test_a_problem_is_frozen():
    problem = solve_block(x=0.0)[0]
    with pytest.raises(FrozenInstanceError):
        problem.gap = problem.gap + 1.0


def solve_block(**left):
    """A block on the road, its left side prescribed."""
    support = Support(ELASTICITY.body).fix("top", x=0.0, y=-0.01).fix("left", **left)
    system = ELASTICITY.system(np.zeros_like(ELASTICITY.body.coordinates), support)
    return BodyOnRoad(system, "bottom", Plane()).problem, system


def test_a_node_prescribed_below_the_road_is_refused():
    with pytest.raises(ValueError, match=r"Node \d+ is prescribed .*-0.01\).* 0.01 below the road"):
        solve(solve_block(x=0.0, y=-0.01)[0])


def drawn_down(t):
    return -0.1 * t


@pytest.mark.parametrize(
    ("scheme", "finite", "end"),
    [
        (Newmark, False, drawn_down),
        (MassRedistribution, False, drawn_down),
        (ContactStabilised, False, drawn_down),
        (Newmark, False, 0.0),
        (MassRedistribution, False, 0.0),
        (EnergyMomentum, True, drawn_down),
        (LosslessContact, True, drawn_down),
    ],
)
def test_supports_do_not_lead_a_node_below_the_road_in_time(scheme, finite, end):
    """Its support goes down, or the road comes up."""
    body = Body.from_grid(rectangle(2.0, 1.0, 8, 4))
    law = Hyperelasticity(body, NeoHookean(1e3, 0.3)) if finite else Elasticity(body, Isotropic(1e3, 0.3))
    support = Support(body).fix("left", x=0.0, y=end)
    system = law.system(law.body_force((0.0, -1.0)), support, density=1.0)
    road = Plane((0.0, -0.01))
    if end == 0.0:
        road = MovingRoad(road, lambda t: (0.0, 0.1 * t))
    contact = BodyOnRoad(system, "bottom", road)
    moving = FiniteBody.from_contact(contact) if finite else MovingBody.from_contact(contact)
    motion = scheme(moving, dt=0.03)
    with pytest.raises(ValueError, match=r"Node 0 is prescribed .* at time 0.12, which is 0.002 below"):
        motion.run(motion.start(), 8)


def test_a_node_that_is_led_below_the_road_is_refused_at_finite_strain():
    body = Body.from_grid(rectangle(2.0, 1.0, 4, 2))
    elasticity = Hyperelasticity(body, NeoHookean(E=1e3, nu=0.3))
    support = Support(body).fix("left", x=0.0, y=lambda t: -0.1 * t)
    system = elasticity.system(elasticity.body_force((0.0, -1.0)), support)
    contact = FiniteContact(BodyOnRoad(system, "bottom", Plane((0.0, -0.05))))
    with pytest.raises(ValueError, match=r"Node 0 is prescribed .*-0.06\) at time 0.6, which is 0.01 below"):
        list(contact.follow([0.3, 0.6]))


@pytest.mark.parametrize("correction", ["none", "direct", "algebraic"])
@pytest.mark.parametrize("tilt", [0.0, 0.2])
@pytest.mark.parametrize("friction", [None, 0.3])
def test_prescribed_components_stay_where_nodes_touch(correction, tilt, friction):
    support = Support(ELASTICITY.body).fix("top", y=-0.03).fix("left", x=0.004)
    system = ELASTICITY.system(np.zeros_like(ELASTICITY.body.coordinates), support)
    road = Plane((0.0, 0.0), (tilt, 1.0))
    problem = BodyOnRoad(system, "bottom", road, friction=friction, reach=1.0).problem
    solution = solve(problem, correction, tolerance=1e-9)
    left = ELASTICITY.body.nodes("left")
    assert np.abs(solution.displacement[left, 0] - 0.004).max() < 1e-14
    force = problem.A @ solution.displacement.ravel() - problem.b.ravel()
    force = force.reshape(-1, 2)
    force[problem.contact_nodes] -= solution.contact_force
    force[left, 0] = 0.0  # what the support does beyond its row
    force[ELASTICITY.body.nodes("top"), 1] = 0.0
    assert np.abs(force).max() < 1e-8 * np.abs(solution.contact_force).max()
    at = problem.gap + np.einsum("ca,ca->c", problem.normal, solution.displacement[problem.contact_nodes])
    assert np.abs(np.where(solution.status == Status.FREE, at - solution.gap, at)).max() < 1e-12


def test_a_body_that_may_tip_says_that_its_place_is_one_of_many():
    body = ELASTICITY.body
    load = np.zeros_like(body.coordinates)
    load[body.nearest_node((0.0, 0.5))] = (0.0, -1e-6)
    support = Support(body).fix_node(body.nearest_node((0.0, 0.5)), x=0.0)
    system = ELASTICITY.system(load, support)
    corner = BodyOnRoad(system, "bottom", Plane()).problem
    solution = solve(corner, "direct")
    assert np.count_nonzero(solution.pressure_force > 1e-18) == 1  # the load is 1e-6
    assert not solution.unique
    held = solve(solve_block(x=0.0)[0], "direct")
    assert held.unique
