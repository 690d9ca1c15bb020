"""Answers that are one of several, and unstable balances: closed forms, enumeration, differences."""

import warnings
from itertools import product

import numpy as np
import pytest
from scipy.optimize import root
from scipy.sparse import csr_array

from forms import Elasticity, Isotropic, Support
from geometry import Body, Plane, RoundRoad, rectangle, ring
from model import (
    BodyOnRoad,
    ContactProblem,
    ContactSolver,
    CurvedContact,
    NotConverged,
    SeveralAnswers,
    Status,
    UnstableBalance,
    follow,
    other_answers,
    solve,
    viscous,
)
from model.solvers.uniqueness import look_for_others

SIDES = {0: Status.FREE, 2: Status.STICK, 1: Status.SLIP, -1: Status.SLIP}  # of slip too


def nodes_on(K, b, gap, friction, d=2):
    """Nodes above a plane, coupled by any matrix."""
    n = len(gap)
    normal, coordinates = np.zeros((n, d)), np.zeros((n, d))
    normal[:, -1], coordinates[:, 0], coordinates[:, 1] = 1.0, np.arange(n), np.arange(n) ** 2
    return ContactProblem(
        csr_array(K), np.reshape(b, (n, d)), coordinates, np.arange(n), normal, np.asarray(gap), friction
    )


@pytest.mark.parametrize("held", [True, False])
def test_a_failure_says_whether_there_is_an_answer(held):
    """Where supports or planes hold the body without friction, there is one for any friction."""
    elasticity = Elasticity(Body.from_grid(rectangle(1.0, 1.0, 4, 4)), Isotropic(1e6, 0.3))
    support = Support(elasticity.body).fix("top", x=0.0) if held else Support(elasticity.body)
    system = elasticity.system(elasticity.body_force((0.3, -1.0)), support)
    contact = BodyOnRoad(system, "bottom", Plane(), friction=0.5)
    with pytest.raises(NotConverged) as failed:
        solve(contact, "none", limit=1, progress=False)
    assert ("for there is an answer, since supports and planes hold" in str(failed.value)) == held
    assert ("for there may be none, since not even supports" in str(failed.value)) != held


def warned(run, *arguments, **options):
    """What a call returns, and the warnings of several answers and of balances that it gives."""
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        result = run(*arguments, **options)
    return result, [w for w in said if w.category in (SeveralAnswers, UnstableBalance)]


def answers(K, b, gap, mu):
    """All answers of nodes in the plane, by trying every status: status, u, index."""
    found, n = [], len(gap)
    for sides in product(SIDES, repeat=n):
        M, r = K.copy(), b.copy()
        for c, side in enumerate(sides):
            t, up = 2 * c, 2 * c + 1
            if side:
                M[t] += mu * side * K[up]
                r[t] += mu * side * b[up]
                M[up], r[up] = np.eye(2 * n)[up], -gap[c]
            if side == 2:
                M[t], r[t] = np.eye(2 * n)[t], 0.0
        if np.linalg.cond(M) > 1e12:  # nothing holds the body
            continue
        u = np.linalg.solve(M, r)
        f, tangent = (K @ u - b).reshape(n, 2), u.reshape(n, 2)
        side, apart = np.array(sides), np.array(sides) == 0
        fits = np.where(apart, gap + tangent[:, 1] > 0.0, f[:, 1] > 0.0)
        fits &= (side != 2) | (np.abs(f[:, 0]) < mu * f[:, 1])
        fits &= (np.abs(side) != 1) | (side * tangent[:, 0] > 0.0)
        if fits.all():
            found.append(([SIDES[s] for s in sides], u.reshape(n, 2), np.sign(np.linalg.det(M))))
    return found


def test_one_node_beyond_the_critical_coefficient():
    """With k_t / |k_nt| = 0.5 < pull / weight = 0.7 < mu it may stick, slip, or be lifted: three answers."""
    K, b = np.array([[1.0, -2.0], [-2.0, 5.0]]), np.array([0.7, -1.0])
    assert len(answers(K, b, [0.0], 0.8)) == 3
    for status, u, index in answers(K, b, [0.0], 0.8):
        start = {"start": u, "start_status": np.array(status)}
        solution, said = warned(solve, nodes_on(K, b, [0.0], 0.8), "direct", **start)
        assert np.allclose(solution.displacement, u) and list(solution.status) == status
        assert [w.category for w in said] == ([SeveralAnswers] if status == [Status.SLIP] else [])
        assert (index < 0.0) == (status == [Status.SLIP])
        assert all("mu = 0.8 and 1 of 1 nodes that touch in slip" in str(w.message) for w in said)


def test_the_warning_points_to_the_caller_and_is_said_once_on_a_path():
    K, b = np.array([[1.0, -2.0], [-2.0, 5.0]]), np.array([0.7, -1.0])
    ((_, u, _),) = (each for each in answers(K, b, [0.0], 0.8) if each[2] < 0.0)
    start = {"start": u, "start_status": np.array([Status.SLIP])}
    path = follow(nodes_on(K, b, [0.0], 0.8), [b, b], "direct", **start)
    solutions, said = warned(list, path)
    assert len(solutions) == 2 and len(said) == 1
    assert said[0].filename == __file__


def stiff_in_a_few_ways(random, size, ways):
    """A matrix whose soft motions couple pressing with sliding, and a load that presses on the plane."""
    X = random.normal(size=(size, ways))
    return X @ X.T + 0.1 * np.eye(size), random.normal(size=size)


@pytest.mark.parametrize("n", [1, 2, 3])
def test_indices_add_up_to_one_and_every_negative_one_is_said(n):
    random, negative = np.random.default_rng(n), 0
    for _ in range(80):
        K, b = stiff_in_a_few_ways(random, 2 * n, n)
        gap, mu = 0.1 * np.abs(random.normal(size=n)), float(random.uniform(1.0, 5.0))
        found = answers(K, b, gap, mu)
        assert sum(index for *_, index in found) == 1.0
        solver = ContactSolver(nodes_on(K, b, gap, mu), "direct")
        for status, u, index in found if len(found) > 1 else []:
            solution = solver.solve(start=u, start_status=np.array(status))
            assert np.allclose(solution.displacement, u, atol=1e-9)
            assert warned(look_for_others, solver, solution)[0] == (index < 0.0)
            negative += index < 0.0
    assert negative > 1


def test_a_wedge_between_two_walls():
    """One cell that nothing but two walls holds: large friction lets it jam in up to nine ways.

    Where only friction balances the load, the sum is not known to be 1, though it is, and nothing is said.
    """
    random, counts, seen, negative = np.random.default_rng(7), [], [], 0
    for _ in range(25):
        elasticity = Elasticity(Body.from_grid(rectangle(1.0, 0.3, 1, 1)), Isotropic(1.0, 0.45))
        X, slope, mu = elasticity.body.coordinates, random.uniform(0.5, 1.2), random.uniform(2.0, 5.0)
        b = np.column_stack([0.02 * random.normal(size=4), -0.05 * random.uniform(0.2, 1.0, 4)])
        K, gap = elasticity.stiffness(), random.uniform(0.0, 0.02, 4)
        normal = np.where(X[:, :1] < 0.5, 1.0, -1.0) * (np.cos(slope), 0.0) + (0.0, np.sin(slope))
        frame = np.zeros((4, 2, 4, 2))
        frame[range(4), :, range(4)] = np.stack([normal @ [[0, -1], [1, 0]], normal], axis=1)
        Q = frame.reshape(8, 8)
        found = answers(Q @ K.toarray() @ Q.T, Q @ b.ravel(), gap, mu)
        counts.append(len(found))
        assert sum(index for *_, index in found) == 1.0
        problem = ContactProblem(K, b, X, np.arange(4), normal, gap, mu)
        seen.append(len(other_answers(problem, solve(problem, "direct"), correction="direct")))
        assert seen[-1] < len(found)
        solver = ContactSolver(problem, "direct")
        for status, u, index in found if len(found) > 1 else []:
            there = (Q.T @ u.ravel()).reshape(4, 2)
            solution = solver.solve(start=there, start_status=np.array(status))
            assert np.allclose(solution.displacement, there, atol=1e-9)
            held = not solver.rigid.held_by_friction(b, normal)
            assert warned(look_for_others, solver, solution)[0] == (held and index < 0.0)
            negative += held and index < 0.0
    assert sum(seen) > 5
    assert max(counts) == 9 and set(np.mod(counts, 2)) == {1} and negative > 3


def natural_map(K, b, mu, viscosity, d):
    """What is missing at u (n d,) with the nearest admissible forces, nodes on a plane z = 0."""

    def missing(u):
        r, x = (K @ u - b).reshape(-1, d), u.reshape(-1, d)
        p = np.maximum(r[:, -1] - x[:, -1], 0.0)
        tau, slip = r[:, :-1] - x[:, :-1], np.linalg.norm(x[:, :-1], axis=1)
        most = mu * p + viscosity * slip * (p > 0.0)
        size = np.linalg.norm(tau, axis=1)
        tau *= np.minimum(1.0, most / np.maximum(size, 1e-300))[:, None]
        return (r - np.column_stack([tau, p])).ravel()

    return missing


@pytest.mark.parametrize("viscosity", [0.0, 0.02])
def test_in_space_the_index_is_that_of_the_natural_map(viscosity):
    """The sign of the determinant by differences, at answers found from random starts."""
    random, seen = np.random.default_rng(3), []
    for _ in range(120):
        (K, b), mu = stiff_in_a_few_ways(random, 9, 3), float(random.uniform(1.0, 5.0))
        missing = natural_map(K, b, mu, viscosity, 3)
        solver = ContactSolver(nodes_on(K, b, [0.0] * 3, viscous(mu, viscosity), 3), "direct")
        for _ in range(3):
            at = root(missing, random.normal(size=9))
            if not at.success or np.linalg.norm(at.fun) > 1e-9:
                continue
            u, r = at.x.reshape(3, 3), (K @ at.x - b).reshape(3, 3)
            slip = np.linalg.norm(u[:, :2], axis=1)
            touches = r[:, 2] > 1e-6
            status = np.where(touches, np.where(slip > 1e-6, Status.SLIP, Status.STICK), Status.FREE)
            if not (status == Status.SLIP).any():
                continue
            solution = solver.solve(start=u, start_status=status)
            if not np.allclose(solution.displacement, u, atol=1e-6):
                continue
            u, h = solution.displacement.ravel(), 1e-6
            J = np.column_stack([(missing(u + h * e) - missing(u - h * e)) / (2 * h) for e in np.eye(9)])
            if abs(np.linalg.det(J)) < 1e-3:
                continue
            said = warned(look_for_others, solver, solution)[0]
            assert said == (np.linalg.det(J) < 0.0)
            seen.append(said)
    assert any(seen) and len(seen) > 50


def one_node_held(K, b, at, gap, friction):
    """A node that feels K, by chains of two springs through others that cannot touch."""
    d, one, none = len(b), np.eye(len(b)), np.zeros((len(b), len(b)))
    A = np.block([[K + one, -one, -one], [-one, 2.0 * one, none], [-one, none, 2.0 * one]])
    at = np.array([at, at + one[-1], at + one[-1] + one[0]])
    load = np.array([b, np.zeros(d), np.zeros(d)])
    return ContactProblem(csr_array(A), load, at, np.array([0]), one[-1:], np.array([gap]), friction)


@pytest.mark.parametrize(("stiffness", "unstable"), [(0.99, True), (1.01, False)])
@pytest.mark.parametrize("dim", [2, 3])
def test_a_node_on_a_hill_is_held_by_a_spring_stiffer_than_load_over_radius(dim, stiffness, unstable):
    """J = k x^2 / 2 - p x^2 / (2 R): a balance that a push leaves in place where k > p / R."""
    R, p, up = 3.0, 2.0, 7.0
    K = np.diag([*[1.5 * p / R] * (dim - 2), stiffness * p / R, up])
    problem = one_node_held(K, [*[0.0] * (dim - 1), -p - 0.1 * up], 0.1 * np.eye(dim)[-1], 0.1, None)
    curved = CurvedContact(ContactSolver(problem, "direct"), np.eye(dim)[-1:] * 0.1)
    solution = curved.solve(RoundRoad(np.zeros(dim), np.eye(dim)[-1], R))
    assert solution.pressure_force == pytest.approx([p])
    _, said = warned(look_for_others, curved.solver, solution, curved.turning)
    assert [w.category for w in said] == ([UnstableBalance] if unstable else [])


def slipping_on_ball(K, b, mu, here, anchor, top):
    """What a node on a unit ball misses along it, at x = (top + c e) / |.| for c (d - 1,), and x, p, slip."""
    e = np.linalg.svd(top[None])[2][1:]

    def missing(c):
        n = top + c @ e
        n /= np.linalg.norm(n)
        f, s = K @ (n - here) - b, n - anchor
        s = s - (s @ n) * n
        found = f - (f @ n) * n + mu * (f @ n) * s / np.linalg.norm(s)
        return e @ found, n, f @ n, np.linalg.norm(s)

    return missing


@pytest.mark.parametrize("dim", [2, 3])
def test_the_road_turns_pressure_and_friction_of_a_node_that_slips_over_a_hill(dim):
    """The sign of the determinant by differences along a ball of radius 1, at answers in slip."""
    random, seen, mu, h = np.random.default_rng(dim), [], 0.6, 1e-6
    road = RoundRoad(np.eye(dim)[-1], np.eye(dim)[-1], 1.0)
    here = np.array([-0.3, 0.1, 1.2])[-dim:]  # where the springs are at rest; the node sticks below it
    anchor = here / np.linalg.norm(here)
    for _ in range(100):
        K, b = stiff_in_a_few_ways(random, dim, dim - 1)
        K, b = random.choice([1.0, 20.0]) * K, b - 3.0 * np.eye(dim)[-1]
        start = anchor + 0.7 * random.normal(size=dim)
        missing = slipping_on_ball(K, b, mu, here, anchor, start / np.linalg.norm(start))
        at = root(lambda c, missing=missing: missing(c)[0], np.zeros(dim - 1), tol=1e-13)
        _, x, p, slip = missing(at.x)
        if np.abs(missing(at.x)[0]).max() > 1e-9 or p < 1e-3 or slip < 1e-3 or x @ anchor < 0.2:
            continue
        missing = slipping_on_ball(K, b, mu, here, anchor, x)
        turns = np.eye(dim - 1) * h
        J = np.array([(missing(c)[0] - missing(-c)[0]) / (2 * h) for c in turns])
        u = np.array([x - here, 0.5 * (x - here), 0.5 * (x - here)])
        curved = CurvedContact(ContactSolver(one_node_held(K, b, here, 0.2, mu), "direct"), here[None])
        curved.pressure = np.array([p])
        solution = curved.solve(road, start=u, start_status=np.array([Status.SLIP]))
        if np.allclose(solution.displacement, u, atol=1e-7) and abs(np.linalg.det(J)) > 1e-3:
            said = warned(look_for_others, curved.solver, solution, curved.turning)[0]
            assert said == (np.linalg.det(J) < 0.0)
            seen.append(said)
    assert sum(seen) > 3 and len(seen) - sum(seen) > 3


def resting(road, **fixed):
    """A ring of weight 1 that nothing holds, or whose touching nodes are guided."""
    elasticity = Elasticity(Body.from_grid(ring(0.5, 0.2, 32, 2)), Isotropic(1e6, 0.3))
    weight = elasticity.body_force((0.0, -1.0))
    support = Support(elasticity.body)
    if fixed:
        support.fix("outer", **fixed)
    system = elasticity.system(weight / -weight.sum(), support)
    return warned(solve, BodyOnRoad(system, "outer", road), "direct")


def test_a_ring_on_a_crest_is_unstable_and_in_a_hollow_it_is_not():
    solution, said = resting(RoundRoad(radius=2.0))
    assert [w.category for w in said] == [UnstableBalance]
    assert solution.pressure_force.sum() == pytest.approx(1.0)
    assert "nodes touching it" in str(said[0].message) and said[0].filename == __file__
    assert resting(RoundRoad(radius=-2.0))[1] == []


def test_a_ring_on_a_crest_whose_nodes_are_guided_is_not():
    assert resting(RoundRoad(radius=2.0), x=0.0)[1] == []
