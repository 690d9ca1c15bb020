"""Coulomb's law in the loop: laws, sliding, the cone, node order, and an independent solver."""

import warnings

import numpy as np
import pytest
from scipy.sparse import bmat, csr_array, eye_array
from scipy.sparse.linalg import spsolve

from forms import Elasticity, Isotropic, Support
from geometry import Body, Plane, box, half_cylinder_nested, rectangle
from model import (
    BodyOnRoad,
    ContactProblem,
    ContactSolver,
    FrictionLeftOut,
    MassRedistribution,
    MovingBody,
    Status,
    coulomb,
    follow,
    friction_law,
    solve,
    static_kinetic,
    stribeck,
    viscous,
)


def test_laws_by_their_formulas():
    assert coulomb(0.4)(10.0, 1.0, 0.0) == 4.0
    law = static_kinetic(0.5, 0.3)
    assert [law(10.0, 0.0, 0.0), law(10.0, 1.0, 0.0), law(10.0, 0.0, 1.0)] == [
        5.0,
        3.0,
        3.0,
    ]
    assert viscous(0.1, 2.0)(10.0, 3.0, 0.0) == pytest.approx(7.0)
    law = stribeck(0.5, 0.3, 2.0, 0.1)
    assert law(10.0, 1.0, 0.0) == pytest.approx(10 * (0.3 + 0.2 * np.exp(-0.25)) + 0.1)


@pytest.mark.parametrize("correction", ["none", "direct", "algebraic"])
@pytest.mark.parametrize("part", [0.0, 0.3, 0.9, 1.0])
@pytest.mark.parametrize("slip", [(1.2,), (1.2, -0.7)])
def test_a_film_that_would_lift_a_node_has_as_much_as_leaves_no_pressure(slip, part, correction):
    """One node whose slip presses it to the road less: by its film it would fly, without it press."""
    d, film = len(slip) + 1, 0.8
    n, t = np.eye(d)[-1], np.array([*slip, 0.0]) / np.linalg.norm(slip)
    A = 2.0 * np.eye(d) + np.outer(n, t) + np.outer(t, n)
    u = np.array([*slip, 0.0])
    friction = -part * film * u
    problem = ContactProblem(
        csr_array(A),
        (A @ u - friction)[None],
        np.zeros((1, d)),
        [0],
        n[None],
        np.zeros(1),
        viscous(0.0, film),
    )
    solution = solve(problem, correction, tolerance=1e-12)
    assert solution.displacement[0] == pytest.approx(u, abs=1e-10)
    assert solution.contact_force[0] == pytest.approx(friction, abs=1e-10)


@pytest.mark.parametrize(
    "make",
    [
        lambda: coulomb(-0.1),
        lambda: coulomb(np.nan),
        lambda: static_kinetic(0.3, 0.5),
        lambda: viscous(0.1, -1.0),
        lambda: stribeck(0.5, 0.3, 0.0),
    ],
)
def test_laws_refuse_what_makes_no_sense(make):
    with pytest.raises(ValueError, match="but"):
        make()


def block(friction):
    """A block on the road under a platen, and its loads P = 1 down and Q = 1 along."""
    body = Body.from_grid(rectangle(2.0, 1.0, 8, 4))
    elasticity = Elasticity(body, Isotropic(100.0, 0.3))
    support = Support(body).platen("top")
    system = elasticity.system(elasticity.total_force("top", (0.0, -1.0)), support)
    pull = system.reduce(elasticity.total_force("top", (1.0, 0.0)))
    return BodyOnRoad(system, "bottom", Plane(), friction=friction), system.load, pull


def test_a_block_starts_to_slide_at_mu_p_and_not_before():
    mu = 0.3
    pressed, push, pull = block(mu)
    last = list(
        follow(
            ContactSolver(pressed.problem, "direct"), [push, push + 0.9 * mu * pull, push + 0.999 * mu * pull]
        )
    )[-1]
    assert np.any(last.status == Status.STICK)
    with pytest.raises((RuntimeError, ValueError)):
        list(follow(ContactSolver(pressed.problem, "direct"), [push, push + 1.01 * mu * pull], limit=300))


def pressed_cylinder(mu, refinements=1):
    body = Body.from_grid(half_cylinder_nested(10.0), refinements)
    elasticity = Elasticity(body, Isotropic(210e3, 0.3))
    support = Support(body).platen("top").fix("top", x=0.0)
    system = elasticity.system(elasticity.total_force("top", (0.0, -1e4)), support)
    return BodyOnRoad(system, "arc", Plane(), friction=mu)


@pytest.mark.parametrize("steps", [1, 2, 5])
@pytest.mark.parametrize("mu", [0.01, 0.1, 0.3, 0.5, 1.0, 3.0])
def test_the_cone_holds_and_slip_never_helps(mu, steps):
    problem = pressed_cylinder(mu).problem
    before = np.zeros_like(problem.tangential_reference)
    for step in follow(
        ContactSolver(problem, "multigrid"), [problem.b * k / steps for k in range(1, steps + 1)]
    ):
        tangential = np.abs(step.contact_force[:, 0])
        assert np.max(tangential - mu * step.pressure_force) < 1e-12 * step.pressure_force.max()
        here = step.displacement[problem.contact_nodes]
        assert np.max(step.contact_force[:, 0] * (here - before)[:, 0] * (step.status == Status.SLIP)) <= 0.0
        before = here


def semi_smooth_newton(file):
    """Solve a saved 2-D problem with normals +y from nearby, by multipliers and projections."""
    A = csr_array((file["data"], file["indices"], file["indptr"]))
    b, mu, gap, s = (
        file["load"],
        float(file["friction_coefficient"]),
        file["gap"],
        file["tangential_reference"][:, 0],
    )
    x, y = 2 * file["contact_nodes"], 2 * file["contact_nodes"] + 1
    n, N, r = x.size, b.size, np.abs(A.diagonal()).max()
    eye = eye_array(N, format="csr")
    u, p, t = file["displacement"].ravel() * (1 + 1e-5), np.zeros(n), np.zeros(n)
    lone = np.diff(A.indptr) == 1
    u[lone] = (b / A.diagonal())[lone]
    p, t = (A @ u - b)[y], (A @ u - b)[x]
    for _ in range(60):
        force = np.zeros(N)
        force[y], force[x] = p, t
        touch = p - r * (gap + u[y]) > 0
        trial = t - r * (u[x] - s)
        slide = np.abs(trial) > mu * np.maximum(p, 0)
        sign = np.sign(trial)
        equilibrium = A @ u - b - force
        normal = np.where(touch, gap + u[y], p)
        along = np.where(touch, np.where(slide, t - mu * sign * p, u[x] - s), t)
        missing = np.concatenate([equilibrium, normal, along])
        if np.abs(missing[:N]).max() < 1e-9 * np.abs(b).max() and np.abs(missing[N:]).max() < 1e-9:
            break
        D = lambda d: csr_array((d, (np.arange(n), np.arange(n))), shape=(n, n))  # noqa: E731
        stick = touch & ~slide
        J = bmat(
            [
                [A, -eye[:, y], -eye[:, x]],
                [D(touch * 1.0) @ eye[y], D(~touch * 1.0), None],
                [D(stick * 1.0) @ eye[x], D((touch & slide) * (-mu) * sign), D((~stick) * 1.0)],
            ],
            format="csc",
        )
        step = spsolve(J, -missing)
        u, p, t = u + step[:N], p + step[N : N + n], t + step[N + n :]
    return u.reshape(-1, 2), np.column_stack([t, p])


def test_an_independent_solver_agrees(tmp_path):
    problem = pressed_cylinder(0.3).problem
    solution = solve(problem, "direct", tolerance=1e-12)
    problem.save(tmp_path / "problem.npz", solution)
    with np.load(tmp_path / "problem.npz") as file:
        u, force = semi_smooth_newton(dict(file))
    assert np.abs(u - solution.displacement).max() < 1e-8 * np.abs(u).max()
    assert np.abs(force - solution.contact_force).max() < 1e-8 * np.abs(force).max()


def test_node_order_does_not_matter_with_friction():
    body = Body.from_grid(rectangle(1.0, 0.5, 6, 3))
    elasticity = Elasticity(body, Isotropic(1.0, 0.3))
    system = elasticity.system(np.zeros((28, 2)), Support(body).fix("top", x=0.02, y=-0.03))
    problem = BodyOnRoad(system, "bottom", Plane(), friction=0.2).problem
    first = solve(problem, "none", tolerance=1e-13)
    for order in (np.arange(28)[::-1], np.random.default_rng(5).permutation(28)):
        other = solve(problem, "none", tolerance=1e-13, order=order)
        assert np.abs(other.displacement - first.displacement).max() < 1e-8 * np.abs(first.displacement).max()
    assert {1, 2} <= set(first.status.tolist())


def test_a_users_own_law():
    def capped(pressure, slip, state):
        return min(0.5 * pressure, 0.02)

    pressed, push, pull = block(friction_law(capped, coefficient=0.5))
    last = list(follow(ContactSolver(pressed.problem, "direct"), [push, push + 0.1 * pull]))[-1]
    assert np.abs(last.contact_force[:, 0]).max() <= 0.02 * (1 + 1e-12)
    assert abs(last.contact_force[:, 0].sum() + 0.1) < 1e-9


def guided_block(dim):
    """A block whose left side is guided along y, or in space along the plane x = 0, under its weight."""
    grid = rectangle(2.0, 1.0, 8, 4) if dim == 2 else box(2.0, 1.0, 1.0, 4, 2, 2)
    elasticity = Elasticity(Body.from_grid(grid), Isotropic(E=1e3, nu=0.3))
    weight = elasticity.body_force((*np.zeros(dim - 1), -2.0))
    return elasticity.system(weight, Support(elasticity.body).fix("left", x=0.0))


@pytest.mark.parametrize("height", [0.0, 0.1])
def test_a_guided_node_rubs_against_its_way(height):
    slope = Plane((0.0, -height), (0.02, 1.0))
    pressed = BodyOnRoad(guided_block(2), "bottom", slope, friction=0.3)
    n = slope.normal
    with warnings.catch_warnings():
        warnings.simplefilter("error", FrictionLeftOut)
        solution = solve(pressed)
    corner = int(np.argmin(pressed.points[:, 0]))
    node = pressed.problem.contact_nodes[corner]
    assert solution.pressure_force[corner] > 0.0
    u = solution.displacement
    needed = (pressed.problem.A @ u.ravel()).reshape(u.shape)[node, 1] - pressed.problem.b[node, 1]
    f, p, s = solution.contact_force[corner], solution.pressure_force[corner], u[node] - (n @ u[node]) * n
    assert f[1] == pytest.approx(needed, rel=1e-6)
    way = s / np.linalg.norm(s) if height > 0.0 else np.zeros(2)  # it has not moved
    assert f == pytest.approx(p * (n - 0.3 * way), rel=1e-9)


def test_a_node_guided_across_the_road_rubs_where_its_support_moves_it():
    elasticity = Elasticity(Body.from_grid(rectangle(2.0, 1.0, 8, 4)), Isotropic(E=1e3, nu=0.3))
    support = Support(elasticity.body).fix("left", x=0.1)
    system = elasticity.system(elasticity.body_force((0.0, -2.0)), support)
    pressed = BodyOnRoad(system, "bottom", Plane(), friction=0.3)
    solution = solve(pressed)
    corner = int(np.argmin(pressed.points[:, 0]))
    p = solution.pressure_force[corner]
    assert p > 0.0
    assert solution.contact_force[corner] == pytest.approx(p * np.array([-0.3, 1.0]), rel=1e-9)


def test_a_guided_node_rubs_in_time_too_and_moving_supports_bear_it():
    elasticity = Elasticity(Body.from_grid(rectangle(2.0, 1.0, 8, 4)), Isotropic(E=1e3, nu=0.3))
    support = Support(elasticity.body).fix("left", x=lambda t: 0.1 * t)
    weight = elasticity.body_force((0.0, -2.0))
    system = elasticity.system(weight, support, density=1.0)
    road = Plane((0.0, 0.0), (0.02, 1.0))
    pressed = BodyOnRoad(system, "bottom", road, friction=0.3)
    scheme = MassRedistribution(MovingBody.from_contact(pressed), dt=0.05)
    corner, work = int(np.argmin(pressed.points[:, 0])), 0.0
    node, n = pressed.problem.contact_nodes[corner], road.normal
    state = scheme.start()
    for _ in range(20):
        before, state = state, scheme.step(state)
        f, s = state.mean_force[corner], (state.displacement - before.displacement)[node]
        p, way = n @ f, s - (n @ s) * n
        if p > 0.0:
            assert f == pytest.approx(p * (n - 0.3 * way / np.linalg.norm(way)), abs=1e-9)
            work += f @ s
    assert work < -1e-3


def test_friction_that_is_left_out_is_said():
    with pytest.warns(FrictionLeftOut, match="nodes that may touch, the first is node"):
        solve(BodyOnRoad(guided_block(3), "bottom", Plane((0, 0, 0), (0.02, 0.0, 1.0)), friction=0.3))
    with warnings.catch_warnings():
        warnings.simplefilter("error", FrictionLeftOut)
        for friction, normal in [(None, (0.02, 1.0)), (0.3, (0.0, 1.0))]:
            solve(BodyOnRoad(guided_block(2), "bottom", Plane((0.0, 0.0), normal), friction=friction))
