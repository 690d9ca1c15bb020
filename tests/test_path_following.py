"""Small contact problems by following a path, with and without supports, and everyday scenes that need it."""

import numpy as np
import pytest
from everyday.scenes import drawn
from everyday.trial import tried
from hypothesis import given, settings
from hypothesis import strategies as st

from model.node_loop.contact_sweep import SLIP, Candidates
from model.node_loop.friction_laws import coulomb
from model.solvers.path_following import follow_path
from model.solvers.semismooth_newton import newton_step
from model.solvers.small_problem import SmallProblem

BOTH_WAYS = np.array([[1.0], [-1.0]])
ANGLES = np.arange(8) * np.pi / 4


def violation(S, b, gap, reference, mu, u, status):
    """Largest violation of any condition, forces over the largest, lengths over the longest."""
    force = (S @ u.ravel()).reshape(b.shape) - b
    F, L = max(np.abs(force).max(), np.abs(b).max()), np.abs(u).max()
    p, tau = force[:, 0], np.linalg.norm(force[:, 1:], axis=1)
    open_, slip = gap + u[:, 0], u[:, 1:] - reference
    return max(
        -p.min() / F,
        -open_.min() / L,
        np.abs(force[status == 0]).max(initial=0.0) / F,
        np.abs(open_[status > 0]).max(initial=0.0) / L,
        (tau - mu * p).max() / F,
        np.abs(slip[status == 2]).max(initial=0.0) / L,
        np.abs(tau - mu * p)[status == 1].max(initial=0.0) / F,
        (np.sum(slip * force[:, 1:], axis=1) / (F * L)).max(),
    )


def pressed_to_the_road(S, b, gap, reference, mu, ways):
    """The displacement (k, d) to which the path from all nodes pressed to the road leads."""
    u, force, status = np.zeros_like(b), np.zeros_like(b), np.zeros(len(b), dtype=np.int8)
    everybody = np.ones(len(b), dtype=bool)
    found, _ = follow_path(S, b, gap, reference, mu, ways, u, force, status, everybody)
    return u, status, found


def stiffness(random, k, d, modes):
    """A random stiffness (k d, k d), and orthonormal motions (k d, m) that it does not resist."""
    G = np.linalg.qr(random.normal(size=(k * d, modes)))[0] if modes else np.zeros((k * d, 0))
    V = random.normal(size=(k * d, k * d))
    V -= G @ (G.T @ V)
    return V @ V.T, G


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10**6), st.integers(1, 8), st.floats(0.0, 3.0))
def test_there_is_an_answer_for_any_friction_where_supports_hold(seed, k, mu):
    random = np.random.default_rng(seed)
    S, _ = stiffness(random, k, 2, 0)
    S += 1e-2 * np.eye(2 * k)
    b, gap = random.normal(size=(k, 2)), random.uniform(-0.1, 1.0, k)
    reference, mu = 0.1 * random.normal(size=(k, 1)), np.full(k, mu)
    u, status, found = pressed_to_the_road(S, b, gap, reference, mu, np.tile(BOTH_WAYS, (k, 1, 1)))
    assert found
    assert violation(S, b, gap, reference, mu, u, status) < 1e-6


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10**6), st.integers(3, 8), st.floats(0.0, 1.0))
def test_contact_alone_holds_a_body_that_the_load_presses_to_the_road(seed, k, mu):
    random = np.random.default_rng(seed)
    S, G = stiffness(random, k, 2, 2)
    inside = np.zeros((k, 2))  # a load that normal forces of 1 would balance on the modes
    inside[:, 0] = -random.uniform(0.5, 1.5, k)
    b = inside + (S @ random.normal(size=2 * k)).reshape(k, 2)
    gap, reference, mu = random.uniform(0.0, 1.0, k), np.zeros((k, 1)), np.full(k, mu)
    u, status, found = pressed_to_the_road(S, b, gap, reference, mu, np.tile(BOTH_WAYS, (k, 1, 1)))
    assert found
    assert violation(S, b, gap, reference, mu, u, status) < 1e-6


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10**6), st.integers(1, 8), st.integers(2, 3), st.floats(0.0, 0.2))
def test_any_start_leads_to_the_answer_where_friction_is_small(seed, k, d, mu):
    random = np.random.default_rng(seed)
    S = np.eye(k * d) + 0.1 / k * stiffness(random, k, d, 0)[0]
    b, gap = random.normal(size=(k, d)), random.uniform(-0.1, 1.0, k)
    reference, mu = 0.1 * random.normal(size=(k, d - 1)), np.full(k, mu)
    ways = BOTH_WAYS if d == 2 else np.stack([np.cos(ANGLES), np.sin(ANGLES)], axis=1)
    ways = np.tile(ways, (k, 1, 1))
    expected, _, _ = pressed_to_the_road(S, b, gap, reference, mu, ways)
    u, force = random.normal(size=(k, d)), random.normal(size=(k, d))
    status = random.integers(0, 3, k).astype(np.int8)
    nobody = np.zeros(k, dtype=bool)
    found, _ = follow_path(S, b, gap, reference, mu, ways, u, force, status, nobody)
    assert found
    np.testing.assert_allclose(u, expected, atol=1e-9 * np.abs(u).max())


def test_without_friction_the_path_ends_where_the_energy_is_least():
    random = np.random.default_rng(3)
    k, d = 6, 3
    S = stiffness(random, k, d, 0)[0] + 1e-2 * np.eye(k * d)
    b, gap = random.normal(size=(k, d)), random.uniform(-0.1, 1.0, k)
    u, status, found = pressed_to_the_road(
        S, b, gap, np.zeros((k, d - 1)), np.zeros(k), np.zeros((k, 0, d - 1))
    )
    force = (S @ u.ravel()).reshape(k, d) - b
    assert found
    np.testing.assert_allclose(force[:, 1:], 0.0, atol=1e-9)
    assert np.all(force[status == 0, 0] < 1e-9) and np.all(force[status > 0, 0] > 0.0)
    assert np.all((gap + u[:, 0])[status == 0] > 0.0)


def test_in_space_the_polygon_that_faces_the_slip_is_the_disc():
    S, mu, angle = np.diag([3.0, 2.0, 2.0]), 0.3, 0.7
    b = np.array([[-2.0, 4.0 * np.cos(angle), 4.0 * np.sin(angle)]])
    ways = np.stack([np.cos(ANGLES + angle), np.sin(ANGLES + angle)], axis=1)[None]
    u, status, found = pressed_to_the_road(S, b, np.zeros(1), np.zeros((1, 2)), np.array([mu]), ways)
    slip = (4.0 - mu * 2.0) / 2.0
    assert found
    assert status[0] == 1
    np.testing.assert_allclose(u, [[0.0, slip * np.cos(angle), slip * np.sin(angle)]], atol=1e-12)


@pytest.mark.parametrize("edges", [6, 24, 96])
def test_the_finer_the_polygon_the_nearer_its_answer_to_that_with_the_disc(edges):
    """It goes around the disc: by so much the friction of nodes that slip is more, however it is turned."""
    random = np.random.default_rng(edges)
    k, mu = 6, 0.4
    S = stiffness(random, k, 3, 0)[0] + np.eye(3 * k)
    b, gap = 10.0 * random.normal(size=(k, 3)), random.uniform(0.0, 0.05, k)
    angle = random.uniform(0.0, 7.0, (k, 1)) + 2.0 * np.pi * np.arange(edges) / edges
    ways = np.stack([np.cos(angle), np.sin(angle)], axis=2)
    u, status, found = pressed_to_the_road(S, b, gap, np.zeros((k, 2)), np.full(k, mu), ways)
    p, *tau = ((S @ u.ravel()).reshape(b.shape) - b)[status == SLIP].T
    assert found and p.size > 0
    part = np.hypot(*tau) / (mu * p)
    assert np.all(part > 1.0 - 1e-9) and np.all(part < 1.0 / np.cos(np.pi / edges) + 1e-9)


@pytest.mark.parametrize("number", [9642, 9739, 30059, 4000815])
def test_friction_that_turns_far_from_the_start_stops_a_body(number):
    """Bodies so stiff that they turn as one about a node; they creep steadily until all slips have turned."""
    outcome = tried(drawn(number))
    assert outcome["outcome"] == "solved", outcome["said"]


def test_a_load_that_lifts_the_body_off_has_no_answer():
    S = np.array([[0.0, 0.0], [0.0, 1.0]])
    ways = BOTH_WAYS[None]
    _, _, found = pressed_to_the_road(
        S, np.array([[1.0, 0.0]]), np.zeros(1), np.zeros((1, 1)), np.ones(1), ways
    )
    assert not found


@pytest.mark.parametrize("number", [362, 479, 574, 1542, 1560, 2010, 2016, 2250, 720920, 3300495, 3301466])
def test_bodies_that_roll_or_fall_far_to_where_they_rest(number):
    """By 0.1 to 12 times their size, under loads that hardly bend them; one lets go of the road."""
    outcome = tried(drawn(number))
    assert outcome["outcome"] == "solved", outcome["said"]


def test_what_friction_alone_could_hold_is_said_to_turn():
    """A tower pinned above the one node that touches, mu = 0.01: that does not keep it from turning."""
    outcome = tried(drawn(3000495))
    assert outcome["outcome"] == "none exists, proved"
    assert "friction, which alone could hold the body against a rotation about" in outcome["said"]


@pytest.mark.parametrize("number", [949, 1408, 1595, 1625, 4000645, 5263, 7000656, 8242])
def test_bodies_that_roll_or_fall_take_few_steps(number):
    """Once up to 1325 in a solve, whose small problems all began where the body had begun."""
    outcome = tried(drawn(number))
    assert outcome["outcome"] == "solved", outcome["said"]
    assert outcome["steps"] <= 80


@pytest.mark.parametrize("number", [163, 2413, 2864])
def test_a_motion_without_end_is_told_at_once(number):
    """Two spin about a pin above them, mu = 0.01 and 0.1, and one falls from an overhang."""
    said = tried(drawn(number))["said"]
    assert "the load moves the body on and on" in said
    assert "as far as springs ever softer let it go there is no equilibrium" in said


def test_slips_without_a_unique_answer_raise_nothing():
    """A node that nothing resists along the road, in a motion that is not known to be rigid."""
    S, one, mu = np.diag([1.0, 0.0]), np.zeros(1, dtype=np.int64), coulomb(1.0)
    none = np.zeros((2, 0))
    small = SmallProblem(np.eye(2), none, np.zeros((0, 0)), None, 2, mu, np.zeros(2, dtype=np.int64))
    frame, gap, state = np.eye(2)[None], np.zeros(1), mu.nodes(np.ones(1))
    contact = Candidates(one, one, frame, small.arrays.block, gap, np.zeros((1, 1)), state)
    for way in (-1.0, 1.0):
        u, R, force = np.array([[0.0, way]]), np.ones((1, 2)), np.array([[1.0, -way]])
        status = np.array([SLIP], dtype=np.int8)
        step, driven = newton_step(
            small.arrays._replace(S=S), contact, u, status, R, force, small._bound, 1.0, 0.0
        )
        assert np.isfinite(step).all() and not driven


@pytest.mark.parametrize("number", [3141, 6252, 8295, 8463])
def test_soft_bodies_on_one_node_that_next_to_nothing_turns(number):
    """Rounding turns them; what it would take at free nodes to stop that bends them far."""
    outcome = tried(drawn(number))
    assert outcome["outcome"] == "solved", outcome["said"]
    assert outcome["cycles"] <= 4
