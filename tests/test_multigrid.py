"""Multigrid.

Mesh independence, agreement with the other corrections, and its parts against what they stand for.
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse import bsr_array, kron, random_array

from forms import Anisotropic, Elasticity, Isotropic, Support
from geometry import (
    Body,
    MovingRoad,
    Plane,
    SmoothRoad,
    box,
    half_ball,
    half_cylinder_gmsh,
    half_cylinder_nested,
    rectangle,
    tread_block,
)
from model import (
    ContactSolver,
    MassRedistribution,
    MovingBody,
    Newmark,
    NotConverged,
    Status,
    follow,
    solve,
    viscous,
)
from model.node_loop.blocks import (
    backward_sweep,
    block_matrix,
    defect,
    diagonal_positions,
    generalised_inverses,
    sweep_from_zero,
)
from model.node_loop.friction_tangent import friction_tangent
from model.node_loop.node_loop import NodeLoop
from model.problem.rigid_modes import RigidModes
from model.quasistatics.curved_contact import CurvedContact
from model.results.body_on_road import BodyOnRoad
from model.solvers.galerkin_coarsening import Level, coarsen, prolongation
from model.solvers.smoothed_aggregation import algebraic
from model.solvers.truncated_multigrid import Cycle, bsr


def cylinder(refinements, friction=None, platen=True):
    body = Body.from_grid(half_cylinder_nested(10.0), refinements)
    elasticity = Elasticity(body, Isotropic(210e3, 0.3))
    support = Support(body)
    if platen:
        support.platen("top").fix("top", x=0.0)
    else:
        support.fix_node(body.nearest_node((0.0, 10.0)), x=0.0)
    system = elasticity.system(elasticity.total_force("top", (0.0, -1e4)), support)
    return BodyOnRoad(system, "arc", Plane(), friction=friction).problem


def block_on_tilted_road(friction):
    """An anisotropic block, drawn to a tilted road from one side: like none of the demos."""
    body = Body.from_grid(rectangle(1.0, 1.0, 4, 3), 2)
    stiff = np.array([[5.0, 1.0, 0.3], [1.0, 2.0, 0.1], [0.3, 0.1, 1.5]])
    elasticity = Elasticity(body, Anisotropic(stiff), "plane strain")
    support = Support(body).fix("top", x=0.01, y=-0.1)
    system = elasticity.system(elasticity.body_force((0.05, -0.4)), support)
    return BodyOnRoad(system, "bottom", Plane((0.0, -0.31), (-0.3, 1.0)), friction=friction).problem


@pytest.mark.parametrize("platen", [True, False])
def test_cycles_do_not_depend_on_the_mesh(platen):
    cycles = [solve(cylinder(k, platen=platen), "multigrid", tolerance=1e-8).cycles for k in (2, 3, 4)]
    assert max(cycles) <= 16
    assert max(cycles) - min(cycles) <= 2


def test_cycles_with_friction_stay_within_twice_those_without():
    for k in (2, 3):
        without = solve(cylinder(k), "multigrid", tolerance=1e-8).cycles
        problem = cylinder(k, friction=0.5)
        solver = ContactSolver(problem, "multigrid")
        path = list(follow(solver, [problem.b * s / 5 for s in range(1, 6)], tolerance=1e-8))
        assert np.mean([step.cycles for step in path]) <= 2 * without


@pytest.mark.parametrize(("mu", "most"), [(0.01, 12), (0.1, 12), (1.0, 12), (3.0, 14)])
def test_cycles_with_little_and_much_friction(mu, most):
    """From pressing to where nearly all slips: coarse matrices know that friction follows pressure."""
    body = Body.from_grid(half_cylinder_nested(10.0), 3)
    elasticity = Elasticity(body, Isotropic(210e3, 0.3))
    pushes = [elasticity.total_force("top", np.array([Q * mu, -1.0]) * 1e4) for Q in (0.0, 0.5, 0.95)]
    system = elasticity.system(pushes[0], Support(body).platen("top"))
    problem = BodyOnRoad(system, "arc", Plane(), friction=mu, reach=3.0).problem
    solver = ContactSolver(problem, "multigrid")
    path = list(follow(solver, [system.reduce(push) for push in pushes], tolerance=1e-8))
    assert max(step.cycles for step in path) <= most


@pytest.mark.parametrize("friction", [None, 0.2])
@pytest.mark.parametrize("correction", ["none", "multigrid", "algebraic"])
def test_corrections_agree(correction, friction):
    problem = block_on_tilted_road(friction)
    exact = solve(problem, "direct", tolerance=1e-12)
    other = solve(problem, correction, tolerance=1e-12)
    size = np.abs(exact.displacement).max()
    assert np.abs(other.displacement - exact.displacement).max() < 1e-8 * size
    assert np.abs(other.contact_force - exact.contact_force).max() < 1e-8 * np.abs(exact.contact_force).max()
    assert 0 < np.sum(exact.status != Status.FREE) < exact.status.size
    assert other.gap.min() >= 0.0
    assert other.pressure_force.min() >= 0.0


@pytest.mark.parametrize(
    ("scheme", "friction"), [(Newmark, None), (MassRedistribution, None), (MassRedistribution, 0.3)]
)
def test_cycles_in_time(scheme, friction):
    """A quarter of a half ball of steel strikes a road at 10 m/s (mm, ms, N).

    In a step waves pass two cells of the contact.
    """
    body = Body.from_grid(half_ball(10.0, "quarter"), 2)
    elasticity = Elasticity(body, Isotropic(210e3, 0.3))
    support = Support(body).fix("x0", x=0.0).fix("y0", y=0.0)
    road = Plane((0, 0, body.coordinates[:, 2].min()), (0, 0, 1))
    rest = np.zeros_like(body.coordinates)
    moving = MovingBody.from_forms(elasticity, 7.85e-3, rest, road, "sphere", support, friction=friction)
    rest[:, 2] = -10.0
    ends = {}
    for correction in ("direct", "multigrid"):
        integrator = scheme(moving, dt=5e-5, correction=correction, tolerance=1e-8)
        state, cycles = integrator.start(velocity=rest), []
        for _ in range(12):
            state = integrator.step(state)
            cycles.append(state.cycles)
        ends[correction] = state
    assert np.median(cycles) <= 4
    assert max(cycles) <= 6
    assert state.count > 1
    assert np.array_equal(state.status, ends["direct"].status)
    moved = ends["direct"].displacement
    assert np.abs(state.displacement - moved).max() < 1e-8 * np.abs(moved).max()


def test_multigrid_in_three_dimensions():
    body = Body.from_grid(box(1.0, 1.0, 1.0, 2, 2, 2), 2)
    elasticity = Elasticity(body, Isotropic(1.0, 0.3))
    load = elasticity.total_force("top", (0.02, 0.01, -0.1))
    system = elasticity.system(load, Support(body).platen("top"))
    problem = BodyOnRoad(system, "bottom", Plane((0, 0, 0), (0, 0, 1)), friction=0.5).problem
    exact = solve(problem, "direct", tolerance=1e-11)
    other = solve(problem, "multigrid", tolerance=1e-11)
    assert np.abs(other.displacement - exact.displacement).max() < 1e-8 * np.abs(exact.displacement).max()


def test_cycles_on_a_rough_road():
    """Planes that still turn are not worth an exact answer; the last ones are."""
    body = Body.from_grid(tread_block((2,), (8.0,), (2.0,), 6.0, 4.0, 2.0), 2)
    elasticity = Elasticity(body, Isotropic(5.0, 0.3))
    support = Support(body).platen("top").fix("top", x=0.0)
    system = elasticity.system(elasticity.total_force("top", (0.0, -4.0)), support)
    x = np.linspace(-25.0, 25.0, 60)
    road = SmoothRoad.through(x, 0.05 * np.cos(x) - 0.05)
    pressed = BodyOnRoad(system, "bottom", road, friction=0.8)
    steps = [(0.1 * k, pressed.problem.b) for k in range(5)]
    moving, paths, rounds = MovingRoad(road, (-1.0, 0.0)), {}, []
    for correction in ("direct", "multigrid"):
        contact = CurvedContact(ContactSolver(pressed.problem, correction), pressed.points)
        paths[correction] = []
        for solution in contact.follow(moving, steps, tolerance=1e-8):
            paths[correction].append(solution)
            rounds.append(len(contact.distances))
    cycles = [solution.cycles for solution in paths["multigrid"]]
    assert max(solution.residual for solution in paths["multigrid"]) <= 1e-8
    assert max(rounds) >= 4
    assert max(cycles) <= 16
    for one, other in zip(paths["direct"], paths["multigrid"], strict=True):
        size = np.abs(one.displacement).max()
        assert np.abs(one.displacement - other.displacement).max() < 1e-6 * size


def test_repaired_coarse_matrices_equal_products():
    """As scipy multiplies them, where nodes are held and what is missing at them is tested otherwise."""
    problem = cylinder(2)
    d, N = 2, problem.coordinates.shape[0]
    loop = NodeLoop(block_matrix(problem.A), problem.contact_nodes, problem.normal, None)
    levels = [Level(loop.A, loop.inverse, diagonal_positions(loop.A))]
    for weights in problem.prolongations:
        levels.append(coarsen(levels[-1], prolongation(weights), weights.shape[1]))
    cycle = Cycle(levels)
    held = problem.contact_nodes[:7]
    T, L = (np.tile(np.eye(d), (N, 1, 1)) for _ in range(2))
    T[held], L[held] = np.diag([1.0, 0.0]), [[1.0, 0.7], [0.0, 0.0]]
    cycle.truncate(held, T[held], L[held])
    L, T = (bsr_array((blocks, np.arange(N), np.arange(N + 1))) for blocks in (L, T))
    product = L @ problem.A @ T
    for repaired, weights in zip(cycle.levels[1:], problem.prolongations, strict=True):
        P = kron(weights, np.eye(d))
        product = P.T @ product @ P
        assert np.allclose(bsr(repaired.A).toarray(), product.toarray(), rtol=0, atol=1e-12 * product.max())


def test_cycle_is_symmetric_and_positive():
    problem = cylinder(2)
    solver = ContactSolver(problem, "multigrid")
    rng = np.random.default_rng(1)
    x, y = rng.normal(size=(2, *problem.b.shape))
    x[solver.loop.uncoupled] = y[solver.loop.uncoupled] = 0.0
    cycle = solver.correction.cycle
    of_x, of_y = cycle(x).copy(), cycle(y).copy()
    assert np.sum(of_x * y) == pytest.approx(np.sum(of_y * x), rel=1e-9)
    assert np.sum(of_x * x) > 0.0


@pytest.mark.parametrize("size", [2, 3, 6])
def test_sweeps_solve_with_a_triangle_of_the_matrix(size):
    rng = np.random.default_rng(2)
    n = 20
    M = random_array((n * size, n * size), density=0.2, rng=rng).toarray()
    full = bsr_array(M + M.T + 9 * np.eye(n * size), blocksize=(size, size))
    full.sort_indices()
    A = block_matrix(full)
    diagonal = np.stack([A.data[k] for k in diagonal_positions(A)])
    inverse = np.empty_like(diagonal)
    generalised_inverses(diagonal, np.arange(n), inverse)
    r = rng.normal(size=(n, size))
    z, rest, other, left = (np.zeros((n, size)) for _ in range(4))
    sweep_from_zero(size)(A, diagonal_positions(A), inverse, r, z, rest)
    lower = np.kron(np.tril(np.ones((n, n))), np.ones((size, size)))
    other[:] = np.linalg.solve(lower * full.toarray(), r.ravel()).reshape(n, size)
    defect(size)(A, r, other, left)
    assert np.allclose(z, other, rtol=0, atol=1e-13)
    assert np.allclose(rest, left, rtol=0, atol=1e-12)
    again = z.copy()
    backward_sweep(size, False)(A, None, inverse, r, z, None)
    backward_sweep(size, True)(A, diagonal_positions(A), inverse, r, again, rest)
    assert np.allclose(again, z, rtol=0, atol=1e-13)
    assert np.allclose(rest.ravel(), r.ravel() - full @ z.ravel(), rtol=0, atol=1e-12)
    upper = np.kron(np.triu(np.ones((n, n))), np.ones((size, size)))
    other += np.linalg.solve(upper * full.toarray(), left.ravel()).reshape(n, size)
    assert np.allclose(z, other, rtol=0, atol=1e-13)


def test_algebraic_coarse_spaces_hold_rigid_motions():
    problem = cylinder(3)
    loop = NodeLoop(block_matrix(problem.A), problem.contact_nodes, problem.normal, None)
    multigrid = algebraic(problem.A, loop, RigidModes(problem.A, problem.coordinates, problem.contact_nodes))
    assert len(multigrid.cycle.levels) >= 2
    assert multigrid.cycle.levels[1].A.data.shape[1] == 3  # two translations and a rotation an aggregate


def test_a_limit_on_the_work_is_an_error_with_its_history():
    with pytest.raises(NotConverged, match="sweeps") as caught:
        solve(cylinder(2), "none", tolerance=1e-10, limit=20)
    assert caught.value.history.size >= 20
    assert caught.value.residual > 1e-10
    assert caught.value.sweeps > 0


def test_multigrid_without_nested_meshes_is_refused():
    problem = replace(block_on_tilted_road(None), prolongations=())
    with pytest.raises(ValueError, match="prolongations"):
        solve(problem, "multigrid")


def test_cycles_with_friction_in_space():
    """Partial slip of a sphere: the friction turns with the slip all round the patch."""
    R, F, mu, half = 10.0, 15e3, 0.5, 0.5
    body = Body.from_grid(half_ball(R, "half"), 1)
    elasticity = Elasticity(body, Isotropic(210e3, 0.3))
    support = Support(body).platen("top").fix("y0", y=0.0)
    pushes = [
        elasticity.total_force("top", half * F * np.array([Q * mu, 0.0, -1.0]))
        for Q in (0.0, 0.25, 0.5, 0.75, 0.95)
    ]
    system = elasticity.system(pushes[0], support)
    loads = [np.where(system.fixed, 0.0, system.reduce(push)) for push in pushes]
    problem = BodyOnRoad(system, "sphere", Plane((0, 0, 0), (0, 0, 1)), friction=mu, reach=1.5).problem
    path = list(follow(ContactSolver(problem, "multigrid"), loads, tolerance=1e-8))
    assert all({Status.SLIP, Status.STICK} <= set(step.status) for step in path[1:])
    assert max(step.cycles for step in path) <= 16


def test_coarser_meshes_know_what_only_the_contact_holds():
    """A tread of rubber: its platen is free to sink, whatever the Galerkin products round."""
    body = Body.from_grid(tread_block((3, 2), (8.0, 8.0), (2.0, 2.0), 6.0, 4.0, 4.0), 2)
    elasticity = Elasticity(body, Isotropic(5.0, 0.45), mean_dilatation=True)
    support = Support(body).platen("top").fix("top", x=0.0, y=0.0)
    system = elasticity.system(elasticity.total_force("top", (0.0, 0.0, -10.0)), support)
    problem = BodyOnRoad(system, "bottom", Plane((0, 0, 0), (0, 0, 1))).problem
    solution = solve(problem, "multigrid", tolerance=1e-8)
    assert np.all(solution.status != Status.FREE)
    assert solution.sweeps <= 4
    assert solution.cycles <= 24


@pytest.mark.parametrize(("nu", "without"), [(0.3, 10), (0.45, 20)])
def test_cycles_on_rubber_with_friction(nu, without):
    """Pressed and drawn until nearly all slips, which takes at most twice the cycles without friction."""
    mu, force = 0.8, 4.0
    body = Body.from_grid(tread_block((3,), (8.0,), (2.0,), 6.0, 4.0, 4.0), 3)
    elasticity = Elasticity(body, Isotropic(5.0, nu), mean_dilatation=True)
    parts = (0.0, 0.25, 0.5, 0.75, 0.95)
    pushes = [elasticity.total_force("top", force * np.array([part * mu, -1.0])) for part in parts]
    system = elasticity.system(pushes[0], Support(body).platen("top"))
    problem = BodyOnRoad(system, "bottom", Plane(), friction=mu).problem
    solver = ContactSolver(problem, "multigrid")
    path = list(follow(solver, [system.reduce(push) for push in pushes], tolerance=1e-8))
    assert Status.FREE in path[-1].status
    assert max(step.cycles for step in path) <= 2 * without
    assert not any(step.steps for step in path)


@pytest.mark.parametrize("dim", [2, 3])
def test_friction_tangent_is_the_derivative_of_friction(dim):
    """Of a law that grows with pressure and slip, by central differences."""
    rng = np.random.default_rng(3)
    n = 4
    M = rng.normal(size=(n * dim, n * dim))
    A = block_matrix(bsr_array(M @ M.T + np.eye(n * dim), blocksize=(dim, dim)))
    normal = rng.normal(size=(n, dim))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    law = viscous(0.4, 0.3)
    loop = NodeLoop(A, np.arange(n), normal, law)
    loop.set_load(np.zeros((n, dim)), np.zeros(n))
    status = np.array([1, 1, 1, 2], dtype=np.int8)

    def friction(u, pressure):
        R, force = np.zeros((n, dim)), pressure[:, None] * normal
        by_pressure, support = np.zeros((n, dim)), np.zeros((n, dim, dim))
        friction_tangent(loop.contact, u, R, force, status, law.address, loop.slip_rate, by_pressure, support)
        assert np.array_equal(R, force - pressure[:, None] * normal)
        return R, by_pressure, support

    u, pressure, h = rng.normal(size=(n, dim)), rng.uniform(1, 2, n), 1e-6
    _, by_pressure, support = friction(u, pressure)
    change = (friction(u, pressure + h)[0] - friction(u, pressure - h)[0]) / (2 * h)
    assert np.allclose(change, by_pressure, atol=1e-6)
    for move in np.eye(dim):
        change = (friction(u + h * move, pressure)[0] - friction(u - h * move, pressure)[0]) / (2 * h)
        assert np.allclose(change, -support @ move, atol=1e-5)
    assert not by_pressure[3].any()
    assert not support[3].any()


def test_cycles_on_triangles_of_any_mesh():
    cycles = []
    for spacing in (0.16, 0.04):
        grid = half_cylinder_gmsh(10.0, spacing=spacing, largest=10 * spacing, cell="triangle")
        body = Body.from_grid(grid)
        elasticity = Elasticity(body, Isotropic(210e3, 0.3))
        support = Support(body).fix_node(body.nearest_node((0.0, 10.0)), x=0.0)
        system = elasticity.system(elasticity.total_force("top", (0.0, -1e4)), support)
        problem = BodyOnRoad(system, "arc", Plane(), reach=2.0).problem
        cycles.append(solve(problem, "algebraic", tolerance=1e-8).cycles)
    assert max(cycles) <= 25


@pytest.mark.parametrize("nu", [0.3, 0.45])
def test_cycles_on_tetrahedra(nu):
    cycles = []
    for cells in (6, 12):
        body = Body.from_grid(box(1.0, 1.0, 1.0, cells, cells, cells, cell="tetrahedron"))
        elasticity = Elasticity(body, Isotropic(5.0, nu))
        support = Support(body).platen("top").fix("top", x=0.0, y=0.0)
        system = elasticity.system(elasticity.total_force("top", (0.0, 0.0, -0.3)), support)
        problem = BodyOnRoad(system, "bottom", Plane((0, 0, 0), (0, 0, 1))).problem
        cycles.append(solve(problem, "algebraic", tolerance=1e-8).cycles)
    assert max(cycles) <= 25
    assert max(cycles) - min(cycles) <= 4


@pytest.mark.parametrize(("Q", "slides"), [(0.999, False), (1.0, False), (1.001, True)])
def test_at_the_onset_of_sliding(Q, slides):
    """Nothing but friction holds the body along the road: it converges, or says that it slides."""
    body = Body.from_grid(half_cylinder_nested(10.0), 2)
    elasticity = Elasticity(body, Isotropic(210e3, 0.3))
    support = Support(body).platen("top")
    pushes = [elasticity.total_force("top", np.array([part * 0.5, -1.0]) * 1e4) for part in (0.0, 0.5, Q)]
    system = elasticity.system(pushes[0], support)
    problem = BodyOnRoad(system, "arc", Plane(), friction=0.5, reach=2.0).problem
    solver = ContactSolver(problem, "multigrid")
    steps = follow(solver, [system.reduce(push) for push in pushes], tolerance=1e-8)
    if slides:
        with pytest.raises(ValueError, match=r"translation along \(1, 0\)"):
            list(steps)
        return
    path = list(steps)
    assert max(step.cycles for step in path) <= 16
    assert -path[-1].contact_force[:, 0].sum() == pytest.approx(Q * 0.5e4, rel=1e-7)


@pytest.mark.parametrize(("Q", "slides"), [(0.99, False), (0.999, False), (1.001, True)])
def test_at_the_onset_of_sliding_in_space(Q, slides):
    """All nodes slip, their friction turned round the patch by what the sphere spreads."""
    half, mu, F = 0.5, 0.5, 15e3
    body = Body.from_grid(half_ball(10.0, "half"), 1)
    elasticity = Elasticity(body, Isotropic(210e3, 0.3))
    support = Support(body).platen("top").fix("y0", y=0.0)
    pushes = [
        elasticity.total_force("top", half * F * np.array([part * mu, 0.0, -1.0]))
        for part in (0.0, 0.5, 0.9, Q)
    ]
    system = elasticity.system(pushes[0], support)
    problem = BodyOnRoad(system, "sphere", Plane((0, 0, 0), (0, 0, 1)), mu, reach=1.5).problem
    steps = follow(
        ContactSolver(problem, "multigrid"), [system.reduce(push) for push in pushes], tolerance=1e-8
    )
    if slides:
        with pytest.raises(ValueError, match=r"translation along \(1, 0, 0\)"):
            list(steps)
        return
    last = list(steps)[-1]
    assert Status.STICK not in last.status
    assert last.cycles <= 32
    assert -last.contact_force[:, 0].sum() == pytest.approx(Q * half * mu * F, rel=1e-7)
