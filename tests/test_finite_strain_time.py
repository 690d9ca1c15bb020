"""Time steps of finite strain: what is kept and lost, the paper's ring, linear limit, restart, refusals."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse import bsr_array

from forms import Elasticity, Hyperelasticity, Isotropic, NeoHookean, StVenantKirchhoff, Support
from geometry import Body, Plane, box, rectangle, ring
from model import (
    EnergyMomentum,
    FiniteBody,
    History,
    LosslessContact,
    MassRedistribution,
    MovingBody,
    Newmark,
    NotConverged,
    integrate,
    load_checkpoint,
    save_checkpoint,
)
from model.finite_strain.definite import indefinite, shifted
from model.finite_strain.local_rotations import LocalRotations
from model.solvers.convergence_record import Record

pytestmark = pytest.mark.filterwarnings("ignore::model.UnresolvedWaves")


def ring_above_road(mu=None, height=0.5, around=48, across=4, energy=None, weight=-9.81):
    body = Body.from_grid(ring(0.5, 0.2, around, across, lowest=(0.0, height)))
    elastic = Hyperelasticity(body, energy or NeoHookean(E=1000.0, nu=0.3))
    load = elastic.body_force((0.0, weight))
    return FiniteBody.from_forms(elastic, 1.0, load, Plane(), "outer", friction=mu)


def spin(scheme, state):
    """Angular momentum about the centre of mass, and about the origin."""
    x = scheme.body.coordinates + state.displacement
    p = (scheme.M @ state.velocity.ravel()).reshape(x.shape)
    mass = scheme.M @ np.tile([1.0, 0.0], len(x))
    centre = mass.reshape(x.shape)[:, 0] @ x / mass.sum()
    arm = x - centre
    return float(arm[:, 0] @ p[:, 1] - arm[:, 1] @ p[:, 0])


def angle(body, before, after):
    """Mean rotation (-pi to pi) of the nodes between two displacements."""
    a, b = (body.coordinates + u - (body.coordinates + u).mean(axis=0) for u in (before, after))
    return np.arctan2(np.sum(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]), np.sum(a * b))


def test_flight_with_spin_keeps_energy_spin_and_momentum():
    body = ring_above_road()
    scheme = EnergyMomentum(body, 0.01)
    centre = np.array([0.0, 1.0])
    arm = body.coordinates - centre
    state = scheme.start(velocity=6.0 * np.stack([-arm[:, 1], arm[:, 0]], axis=1) + [3.0, 1.0])
    history, begin = History(scheme, state), spin(scheme, state)
    turned = 0.0
    for after in integrate(scheme, state, 30, history, progress=False):
        assert spin(scheme, after) == pytest.approx(begin, rel=1e-12)
        turned += angle(body, state.displacement, after.displacement)
        state = after
    assert np.abs(history["gain"]).max() < 1e-11 * history["kinetic"][0]
    assert history["momentum_error"].max() < 1e-11
    assert turned == pytest.approx(6.0 * 0.3, rel=0.03)  # the ring widens, and slows, by centrifugal force
    outer = (body.coordinates + state.displacement)[body.contact_nodes]
    radius = np.linalg.norm(outer - outer.mean(axis=0), axis=1)
    assert 0.5 < radius.mean() < 0.51  # linear strain: 0.5 sqrt(1 + 1.8^2)


@pytest.mark.parametrize("mu", [None, 0.3])
def test_bounce_gains_nothing_and_keeps_contact_exact(mu):
    body = ring_above_road(mu, height=0.02)
    scheme = EnergyMomentum(body, 0.005)
    velocity = np.zeros_like(body.coordinates) + [3.0, -2.0]
    begin = scheme.start(velocity=velocity)
    history = History(scheme, begin)
    for state in integrate(scheme, begin, 50, history, progress=False):
        assert np.array_equal(state.gap == 0.0, state.status != 0)
        assert body.gaps(state.displacement)[0].min() > -1e-14
    kinetic = history["kinetic"][0]
    assert history["contacts"].max() >= 3 and history["contacts"][-1] == 0
    assert history["gain"].max() < 1e-10 * kinetic
    assert np.abs(history["gain"] - history["numerical"]).max() < 1e-9 * kinetic
    assert history["lowest_gap"].min() == 0.0 and history["lowest_pressure"].min() >= 0.0
    assert history["cone"].max() < 1e-12 * np.abs(history["force_y"]).max()
    assert np.all(np.diff(history["friction"]) >= -1e-12 * kinetic)
    assert history["momentum_error"].max() < 1e-9


def test_rolls_backwards_spin_by_friction():
    """Friction turns a ring thrown along the road forwards, clockwise, and only friction does."""
    for mu, turns in ((None, False), (0.3, True)):
        body = ring_above_road(mu, height=0.0)
        scheme = EnergyMomentum(body, 0.005)
        state = scheme.start(velocity=np.zeros_like(body.coordinates) + [2.0, 0.0])
        end = scheme.run(state, 20)
        found = angle(body, state.displacement, end.displacement)
        assert found < -0.01 if turns else abs(found) < 1e-12


def test_linear_limit():
    """Drops at 0.1 and 0.01 m/s: the difference to linear strain falls faster than the motion itself."""
    off = {}
    for speed in (0.1, 0.01):
        body = Body.from_grid(ring(0.5, 0.2, 48, 4, lowest=(0.0, 1e-3 * speed)))
        elastic = Hyperelasticity(body, NeoHookean(E=1000.0, nu=0.3))
        linear = Elasticity(body, Isotropic(E=1000.0, nu=0.3))
        heights = []
        for made, scheme in ((FiniteBody, EnergyMomentum), (MovingBody, MassRedistribution)):
            forms = elastic if made is FiniteBody else linear
            moving = made.from_forms(forms, 1.0, np.zeros_like(body.coordinates), Plane(), "outer")
            run = scheme(moving, 0.005)
            state = run.start(velocity=np.zeros_like(body.coordinates) + [0.0, -speed])
            for _ in range(20):
                state = run.step(state)
                heights.append(state.displacement[:, 1].mean())
        found, wanted = np.split(np.array(heights), 2)
        off[speed] = np.abs(found - wanted).max() / speed
    assert off[0.1] < 3e-4 and off[0.01] < 0.15 * off[0.1]


def test_restart_goes_on_to_the_last_bit(tmp_path):
    made = [EnergyMomentum(ring_above_road(0.3, height=0.0), 0.005) for _ in range(2)]
    begin = made[0].start(velocity=np.zeros_like(made[0].body.coordinates) + [3.0, -2.0])
    middle = made[0].run(begin, 6)
    save_checkpoint(tmp_path / "run.npz", made[0], middle)
    wanted = made[0].run(middle, 4)
    found = made[1].run(load_checkpoint(tmp_path / "run.npz", made[1]), 4)
    assert np.array_equal(found.displacement, wanted.displacement)
    assert np.array_equal(found.contact_force, wanted.contact_force)


def test_a_block_in_space_bounces_with_friction():
    body = Body.from_grid(box(0.4, 0.3, 0.3, 3, 3, 3, corner=(0.0, 0.0, 0.001)))
    elastic = Hyperelasticity(body, NeoHookean(E=1e4, nu=0.4))
    moving = FiniteBody.from_forms(
        elastic, 1.0, elastic.body_force((0, 0, -9.81)), Plane((0, 0, 0), (0, 0, 1)), "bottom", friction=0.4
    )
    scheme = EnergyMomentum(moving, 1e-3)
    state = scheme.start(velocity=np.zeros_like(body.coordinates) + [1.0, 0.5, -1.0])
    history = History(scheme, state)
    for _ in integrate(scheme, state, 15, history, progress=False):
        pass
    assert history["contacts"].max() > 0
    assert history["gain"].max() < 1e-10 * history["kinetic"][0]
    assert history["cone"].max() < 1e-10 * np.abs(history["force_z"]).max()


def test_multigrid_in_space_on_a_matrix_that_turns():
    """One hierarchy, built at rest, serves a block that spins and touches: as one factorisation does."""
    body = Body.from_grid(box(0.4, 0.3, 0.3, 3, 3, 3, corner=(0.0, 0.0, 0.001)), refinements=1)
    elastic = Hyperelasticity(body, NeoHookean(E=1e4, nu=0.4))
    X, load = body.coordinates, elastic.body_force((0, 0, -9.81))
    road = Plane((0, 0, 0), (0, 0, 1))
    ends = {}
    for correction in ("direct", "multigrid"):
        moving = FiniteBody.from_forms(elastic, 1.0, load, road, "bottom", friction=0.4)
        scheme = EnergyMomentum(moving, 1e-3, correction=correction)
        state = scheme.start(velocity=np.cross([1.0, 2.0, 3.0], X - X.mean(axis=0)) + [1.0, 0.5, -3.0])
        ends[correction] = scheme.run(state, 3)
    assert ends["direct"].count > 2 and np.array_equal(ends["direct"].status, ends["multigrid"].status)
    for name, size in (("displacement", 1.0), ("contact_force", np.abs(ends["direct"].contact_force).max())):
        found, wanted = (getattr(ends[correction], name) for correction in ("multigrid", "direct"))
        assert np.abs(found - wanted).max() < 1e-8 * size


def test_supports_hold_and_platens_move_as_one():
    body = Body.from_grid(rectangle(1.0, 0.5, 6, 4, corner=(0.0, 0.01)))
    elastic = Hyperelasticity(body, NeoHookean(E=1000.0, nu=0.3))
    moving = FiniteBody.from_forms(
        elastic,
        1.0,
        elastic.body_force((0.0, -9.81)),
        Plane(),
        "bottom",
        support=Support(body).platen("top").fix("left", x=0.0),
        friction=0.2,
    )
    scheme = EnergyMomentum(moving, 0.002)
    begin = scheme.start(velocity=np.where(moving.prescribed, 0.0, [0.0, -1.0]))
    history = History(scheme, begin)
    for state in integrate(scheme, begin, 20, history, progress=False):
        u = moving.expand(state.displacement)
        assert np.ptp(u[body.nodes("top")], axis=0).max() == 0.0
        assert np.abs(u[body.nodes("left"), 0]).max() == 0.0
    assert history["contacts"].max() > 2
    assert history["gain"].max() < 1e-10 * history["kinetic"][0]


def test_a_support_that_moves_presses_the_block():
    """A block pressed slowly by its top ends where statics would, and the top where it is told to be."""

    def pressed(t):
        return -0.1 * np.sin(0.5 * np.pi * min(t, 1.0)) ** 2

    body = Body.from_grid(rectangle(1.0, 0.5, 6, 4))
    elastic = Hyperelasticity(body, NeoHookean(E=1000.0, nu=0.0))
    moving = FiniteBody.from_forms(
        elastic,
        0.01,
        elastic.body_force((0.0, 0.0)),
        Plane(),
        "bottom",
        support=Support(body).fix("top", y=pressed).fix("left", x=0.0),
    )
    scheme = EnergyMomentum(moving, 0.05)
    state = scheme.run(scheme.start(), 24)
    assert np.abs(state.displacement[body.nodes("top"), 1] + 0.1).max() < 1e-12
    stretch = 0.8  # nu = 0: sigma = mu (stretch - 1 / stretch), with mu = E / 2
    assert state.contact_force[:, 1].sum() == pytest.approx(-500.0 * (stretch - 1 / stretch), rel=0.01)


def test_a_step_that_does_not_converge_is_halved_then_said(monkeypatch):
    body = ring_above_road(height=0.0)
    scheme = EnergyMomentum(body, 0.01, halvings=1)
    state = scheme.start(velocity=np.zeros_like(body.coordinates) + [0.0, -2.0])
    tried = []
    iterate = EnergyMomentum._iterate

    def stubborn(self, before, *arguments, **options):
        tried.append(self.dt)
        if self.dt == 0.01:
            raise NotConverged("stubborn", Record(1.0, 1, lambda: 0, progress=False, history=[1.0]))
        return iterate(self, before, *arguments, **options)

    monkeypatch.setattr(EnergyMomentum, "_iterate", stubborn)
    after = scheme.step(state)
    assert (after.step, after.time) == (1, 0.01) and tried == [0.01, 0.01, 0.005, 0.005]
    by_hand = EnergyMomentum(body, 0.005).run(state, 2)
    assert (
        np.abs(after.displacement - by_hand.displacement).max() < 1e-9
    )  # massless nodes come to rest to 1e-8
    scheme = EnergyMomentum(body, 0.01, halvings=0)
    with pytest.raises(NotConverged, match="even with dt = 0.01"):
        scheme.step(state)


def test_refusals():
    finite = ring_above_road(around=24, across=3)
    with pytest.raises(ValueError, match="FiniteBody takes EnergyMomentum"):
        Newmark(finite, 0.01)
    body = Body.from_grid(ring(0.5, 0.2, 24, 3))
    linear = Elasticity(body, Isotropic(E=1000.0, nu=0.3))
    moving = MovingBody.from_forms(linear, 1.0, linear.body_force((0.0, -9.81)), Plane(), "outer")
    with pytest.raises(ValueError, match="MassRedistribution"):
        EnergyMomentum(moving, 0.01)
    scheme = EnergyMomentum(finite, 0.01)
    with pytest.raises(ValueError, match="turned inside out"):
        scheme.start(
            displacement=np.stack([-2.0 * finite.coordinates[:, 0], 0 * finite.coordinates[:, 0]], axis=1)
        )
    with pytest.raises(ValueError, match=r"displacement is an array of shape \(3, 2\)"):
        scheme.start(displacement=np.zeros((3, 2)))
    kirchhoff = EnergyMomentum(
        ring_above_road(around=24, across=3, energy=StVenantKirchhoff(1000.0, 0.3)), 0.01
    )
    with pytest.raises(ValueError, match="NeoHookean"):
        kirchhoff.start(
            displacement=np.stack([-2.0 * finite.coordinates[:, 0], 0 * finite.coordinates[:, 0]], axis=1)
        )
    elastic = Hyperelasticity(body, NeoHookean(1000.0, 0.3))
    with pytest.raises(ValueError, match="resist rotation"):
        FiniteBody.from_forms(elastic, 1.0, elastic.body_force((0, -1)), Plane(), "outer", damping=(0.1, 0.0))
    assert replace(finite, friction=0.2).elastic is finite.elastic


def test_the_exact_tangent_finds_what_the_constant_matrix_finds(monkeypatch):
    ends = []
    for constant in (True, False):
        scheme = EnergyMomentum(ring_above_road(0.3, height=0.0), 0.005, tolerance=1e-12)
        if not constant:
            monkeypatch.setattr("model.finite_strain.energy_momentum.CONSTANT", 0)
        ends.append(
            scheme.run(scheme.start(velocity=np.zeros_like(scheme.body.coordinates) + [3.0, -2.0]), 4)
        )
    assert ends[0].count > 2
    assert np.abs(ends[0].displacement - ends[1].displacement).max() < 1e-10
    assert np.abs(ends[0].contact_force - ends[1].contact_force).max() < 1e-8


def test_a_shift_makes_a_matrix_definite_and_leaves_a_definite_one_alone():
    A = bsr_array(np.diag([2.0, -1.0, 3.0, 1.0]), blocksize=(2, 2))
    assert indefinite(A) and not indefinite(shifted(A, np.ones(4)))
    free = bsr_array(np.kron(np.array([[1.0, -1.0], [-1.0, 1.0]]), np.eye(2)), blocksize=(2, 2))
    assert not indefinite(free) and indefinite(bsr_array(free - np.diag([3.0, 0, 0, 0]), blocksize=(2, 2)))
    assert shifted(A @ A, np.ones(4)).toarray() == pytest.approx((A @ A).toarray())


@pytest.mark.parametrize("seen", [False, True])
def test_a_body_above_the_road_that_a_force_brings_down(seen):
    """Nobody is below the road where the step is guessed to end; forces bring the lowest nodes there."""
    scheme = EnergyMomentum(ring_above_road(0.5, height=0.001), 0.01)
    body, solver = scheme.body, scheme.solvers["step"]
    state = scheme.start()
    gap, normal = body.gaps(state.displacement)
    back = np.zeros_like(normal)
    if seen:  # a problem of many nodes has been solved before
        solver.solve(np.zeros_like(body.coordinates), gap - 0.05, normal, back, state)
    weight = body.load_at(0.0) * 100.0
    touch = solver.solve(weight, gap, normal, back, state)
    assert touch.count >= 1 and touch.gap.min() == 0.0 and touch.residual < 1e-10
    assert np.einsum("ca,ca->c", normal, touch.force).min() > -1e-12 * np.abs(touch.force).max()


@pytest.mark.parametrize("dim", [2, 3])
def test_rotations_at_the_nodes_of_a_body_that_turns_and_stretches(dim):
    grid = rectangle(2.0, 1.0, 6, 3) if dim == 2 else box(2.0, 1.0, 1.0, 4, 2, 2)
    elastic = Hyperelasticity(Body.from_grid(grid), NeoHookean(E=1.0, nu=0.3))
    X = elastic.body.coordinates
    turn = np.linalg.qr(np.random.default_rng(5).normal(size=(dim, dim)))[0]
    turn[:, 0] *= np.linalg.det(turn)
    stretch = np.eye(dim) + 0.1 * np.diag(np.arange(dim) - 1.0)
    name = "bottom"
    moving = FiniteBody.from_forms(elastic, 1.0, 0.0 * X, Plane(np.zeros(dim), np.eye(dim)[-1]), name)
    R = LocalRotations(moving)(X @ (turn @ stretch).T - X)
    assert np.abs(R - turn).max() < 1e-12


@pytest.mark.parametrize("scheme", [EnergyMomentum, LosslessContact])
@pytest.mark.parametrize("normal", [(0.1, 1.0), (0.2, -0.1, 1.0)])
def test_nodes_that_supports_hold_in_part_meet_a_slanted_wall(normal, scheme):
    """What the wall pushes along axes that are held, the supports bear: it is not missing of equilibrium."""
    if len(normal) == 2:
        body, deep, at = Body.from_grid(ring(0.5, 0.2, 96, 6, lowest=(0.0, 0.0))), (0.0, -0.01), "outer"
        support = Support(body)
        for y in (0.0, 1.0):
            support.fix_node(body.nearest_node((0.0, y)), x=0.0)
    else:
        body, deep, at = Body.from_grid(box(1.0, 1.0, 0.5, 3, 3, 2)), (0.0, 0.0, -0.22), "bottom"
        support = Support(body).fix("left", x=0.0).fix("front", y=0.0)
    elastic = Hyperelasticity(body, NeoHookean(1e3, 0.3))
    down = np.zeros(len(normal))
    down[-1] = -10.0
    road = Plane(deep, normal)
    moving = FiniteBody.from_forms(elastic, 1.0, elastic.body_force(down), road, at, support=support)
    scheme = scheme(moving, 0.005)
    begin = scheme.start()
    history, iterations, touched = History(scheme, begin), [], 0
    for state in integrate(scheme, begin, 40, history, progress=False):
        iterations.append(scheme.iterations)
        touched += state.count
        pressure = state.contact_force @ road.normal
        assert state.contact_force == pytest.approx(np.outer(pressure, road.normal), abs=1e-9)
        assert np.array_equal(state.gap == 0.0, state.status != 0)
    assert touched > 10 and np.median(iterations) < 15
    assert history["gain"].max() < 1e-9 * history["kinetic"].max()
    if isinstance(scheme, LosslessContact):
        assert abs(history["total"][-1] - history["total"][0]) < 1e-9 * history["kinetic"].max()
