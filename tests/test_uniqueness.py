"""Answers that are one of several, and unstable balances: closed forms, enumeration, differences."""

import warnings
from itertools import product

import numpy as np
import pytest
from scipy.optimize import brentq, root
from scipy.sparse import csr_array

from forms import Elasticity, Isotropic, Support
from geometry import Body, RoundRoad, ring
from model import (
    BodyOnRoad,
    ContactProblem,
    ContactSolver,
    CurvedContact,
    SeveralAnswers,
    Status,
    UnstableBalance,
    follow,
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


def zeros(f, places):
    """Where a function changes its sign between neighbours among places, and whether it rises there."""
    values = np.array([f(x) for x in places])
    for k in np.flatnonzero(values[1:] * values[:-1] < 0.0):
        yield brentq(f, *places[k : k + 2], xtol=1e-14), values[k] < 0.0


def test_the_road_turns_the_friction_of_a_node_that_slips_over_a_hill():
    """On a disc of radius 1 the balance along the road is a function of the angle; its slope has the sign."""
    random, seen, mu = np.random.default_rng(0), [], 0.6
    road = RoundRoad([0.0, 1.0], [0.0, 1.0], 1.0)
    here = np.array([-0.3, 1.2])  # where the springs are at rest; the node would stick below it
    stuck = np.arctan2(*here)
    for _ in range(30):
        K, b = stiff_in_a_few_ways(random, 2, 1)
        K, b = random.choice([1.0, 20.0]) * K, b - np.array([0.0, 3.0])

        def force(angle, K=K, b=b):
            f = K @ (np.array([np.sin(angle), np.cos(angle)]) - here) - b
            return f @ (np.cos(angle), -np.sin(angle)), f @ (np.sin(angle), np.cos(angle))

        for side in (1, -1):
            slips = stuck + side * np.linspace(1e-3, 1.4, 400)
            for angle, rises in zeros(lambda a, side=side: force(a) @ np.array([1.0, mu * side]), slips):
                if force(angle)[1] <= 0.0:
                    continue
                u = np.zeros((3, 2))
                u[0] = (np.sin(angle), np.cos(angle)) - here
                u[1:] = 0.5 * u[0]
                problem = one_node_held(K, b, here, 0.2, mu)
                curved = CurvedContact(ContactSolver(problem, "direct"), here[None])
                curved.pressure = np.array([force(angle)[1]])
                solution = curved.solve(road, start=u, start_status=np.array([Status.SLIP]))
                if np.allclose(solution.displacement, u, atol=1e-7):
                    said = warned(look_for_others, curved.solver, solution, curved.turning)[0]
                    assert said == (rises == (side < 0))
                    seen.append(said)
    assert sum(seen) > 3 and len(seen) - sum(seen) > 3


def resting(road):
    """A ring of weight 1 that nothing holds."""
    elasticity = Elasticity(Body.from_grid(ring(0.5, 0.2, 32, 2)), Isotropic(1e6, 0.3))
    weight = elasticity.body_force((0.0, -1.0))
    system = elasticity.system(weight / -weight.sum(), Support(elasticity.body))
    return warned(solve, BodyOnRoad(system, "outer", road), "direct")


def test_a_ring_on_a_crest_is_unstable_and_in_a_hollow_it_is_not():
    solution, said = resting(RoundRoad(radius=2.0))
    assert [w.category for w in said] == [UnstableBalance]
    assert solution.pressure_force.sum() == pytest.approx(1.0)
    assert "nodes touching it" in str(said[0].message) and said[0].filename == __file__
    assert resting(RoundRoad(radius=-2.0))[1] == []
