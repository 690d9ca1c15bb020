"""Contact and friction of moving bodies: exact in every step, however it is solved and wherever it starts."""

from dataclasses import replace

import numpy as np
import pytest
from bodies_in_motion import (
    NEVER_GAIN,
    SCHEMES,
    block,
    bouncing_ring,
    energy,
    momentum,
    pressures,
    rod,
    steps,
)

from forms import Elasticity, Isotropic
from geometry import Body, Plane, rectangle
from model import (
    CentralDifferences,
    ContactProblem,
    GeneralisedAlpha,
    MassRedistribution,
    MovingBody,
    Newmark,
    Status,
    UnresolvedWaves,
    friction_law,
    solve,
    stribeck,
    viscous,
)
from model.dynamics.step_problem import save_step
from model.recording.history import History
from model.recording.time_loop import integrate


@pytest.mark.parametrize("scheme", [*SCHEMES, CentralDifferences])
@pytest.mark.parametrize("friction", [None, 0.1, 1.0])
def test_no_overlap_no_tension_and_inside_the_cone(scheme, friction):
    moving, velocity = bouncing_ring(friction)
    scheme = scheme(moving, 0.001 if scheme is CentralDifferences else 0.01)
    flying = scheme.run(scheme.start(velocity=velocity), round(0.3 / scheme.dt))
    for _, after in steps(scheme, flying, round(0.2 / scheme.dt)):
        p, tau = pressures(scheme, after)
        assert after.gap.min() >= 0.0
        assert np.all(after.gap[after.status != Status.FREE] == 0.0)
        assert p.min() >= 0.0
        assert np.all(p[after.status == Status.FREE] == 0.0)
        assert (tau - (friction or 0.0) * p).max() <= 1e-14 * max(p.max(), 1.0)
        assert moving.gaps(after.displacement)[0].min() > -1e-15
        assert after.residual < 1e-10


def test_friction_at_its_limit_does_no_work_by_itself():
    """A block at rest whose ends are about to slip: what steps leave unbalanced would pump the noise up."""
    moving = block(0.3)
    gap, normal = moving.gaps(np.zeros_like(moving.coordinates))
    load, nodes = moving.load_at(0.0), moving.contact_nodes
    problem = ContactProblem(moving.K, load, moving.coordinates, nodes, normal, gap, 0.3)
    u = solve(problem, "direct", tolerance=1e-13).displacement
    noise = 1e-11 * np.random.default_rng(0).standard_normal(u.shape)
    noise[nodes] = 0.0
    scheme = Newmark(moving, 0.01)
    assert max(after.residual for _, after in steps(scheme, scheme.start(u * (1.0 + noise)), 20)) < 1e-14


@pytest.mark.parametrize("scheme", SCHEMES)
def test_what_slides_through_a_step_slips(scheme):
    """Massless nodes too, which rest once the step has moved them, their friction at its limit."""
    moving, velocity = bouncing_ring(0.1)
    scheme = scheme(moving, 0.01)
    flying, slid = scheme.run(scheme.start(velocity=velocity), 30), 0
    for before, after in steps(scheme, flying, 20):
        touches = (before.status != Status.FREE) & (after.status != Status.FREE)
        change = np.abs((after.displacement - before.displacement)[moving.contact_nodes, 0])
        slides = touches & (change > 0.01)
        slid += np.count_nonzero(slides)
        assert np.all(after.status[slides] == Status.SLIP)
    assert slid > 20


def test_first_touch_within_the_step():
    moving, velocity = bouncing_ring()
    scheme = Newmark(moving, 0.01)
    first = scheme.start(velocity=velocity)
    history = History(scheme, first, {"A": int(np.argmin(moving.coordinates[:, 1]))})
    for _ in integrate(scheme, first, 33, history):
        pass
    assert abs(history.touches("A")[0] - np.sqrt(2 * 0.5 / 9.81)) < 1e-12
    assert history["time"][np.argmax(history["contacts"] > 0)] == pytest.approx(0.32)


@pytest.mark.parametrize("correction", ["none", "multigrid"])
def test_corrections_agree(correction):
    moving, velocity = bouncing_ring(0.1, around=24, across=2, nested=1)
    direct, other = Newmark(moving, 0.01), Newmark(moving, 0.01, correction=correction, tolerance=1e-12)
    state = direct.run(direct.start(velocity=velocity), 30)
    twin = state
    for _ in range(6):
        state, twin = direct.step(state), other.step(twin)
    assert state.count > 2
    assert np.array_equal(state.status, twin.status)
    assert np.abs(state.displacement - twin.displacement).max() < 1e-9


@pytest.mark.parametrize("scheme", SCHEMES)
def test_a_block_at_rest_stays_at_rest(scheme):
    scheme = scheme(block(friction=0.3), 0.05)
    damped = replace(scheme.body, C=block(damping=(20.0, 1e-3)).C)
    settling = GeneralisedAlpha(damped, 0.01, rho=0.5)
    at_rest = settling.run(settling.start(), 1000).displacement
    first = scheme.start(at_rest)
    assert np.all(first.status != Status.FREE)
    assert np.abs(first.contact_force.sum(axis=0) - [0.0, 20.0]).max() < 1e-9
    state = scheme.run(first, 500)
    assert np.abs(state.displacement - at_rest).max() < 1e-13
    assert np.abs(state.velocity).max() < 1e-10
    assert np.abs(state.contact_force - first.contact_force).max() < 1e-9


def test_start_sliding_on_the_road():
    moving = block(friction=0.3, E=1e9)
    velocity = np.zeros_like(moving.coordinates)
    velocity[:, 0] = 2.0
    first = Newmark(moving, 0.001).start(velocity=velocity)
    p, tau = pressures(Newmark(moving, 0.001), first)
    touching = p > 0.0
    assert np.allclose(tau[touching], 0.3 * p[touching], rtol=1e-12)
    assert np.all(first.contact_force[touching, 0] < 0.0)


def test_start_leaving_the_road():
    moving = block()
    velocity = np.zeros_like(moving.coordinates)
    velocity[:, 1] = 1.0
    first = Newmark(moving, 0.01).start(velocity=velocity)
    assert not first.contact_force.any()
    assert np.abs(first.acceleration - [0.0, -10.0]).max() < 1e-10


def settled(**options):
    """A stiff, damped block at rest on a road."""
    moving = block(E=1e5, damping=(0.0, 2e-3), **options)
    scheme = Newmark(moving, 0.01)
    return moving, scheme.run(scheme.start(), 300).displacement


@pytest.mark.parametrize("scheme", NEVER_GAIN)
def test_a_sliding_block_stops_after_v_over_mu_g(scheme):
    mu, v = 0.25, 1.0
    moving, rest = settled(friction=mu)
    velocity = np.zeros_like(moving.coordinates)
    velocity[:, 0] = v
    scheme = scheme(moving, 0.002)
    state = scheme.run(scheme.start(rest, velocity), round(0.5 / 0.002))
    way = np.mean(state.displacement[:, 0] - rest[:, 0])
    assert way == pytest.approx(v**2 / (2 * mu * 10.0), rel=0.01)
    assert np.abs(state.velocity[:, 0].mean()) < 0.01


def test_laws_get_the_slip_speed():
    film = viscous(0.0, 0.4)  # 0.4 N per m/s at each of the 5 nodes, mass 2: v' = -v
    moving, rest = settled(friction=film)
    velocity = np.zeros_like(moving.coordinates)
    velocity[:, 0] = 1.0
    scheme = Newmark(moving, 0.005)
    state = scheme.run(scheme.start(rest, velocity), 200)
    assert state.velocity[:, 0].mean() == pytest.approx(np.exp(-1.0), rel=0.02)

    seen = friction_law(lambda pressure, slip, state: 0.1 * pressure if slip > 100.0 else 0.0)
    moving = block(friction=seen, E=1e5)
    scheme = Newmark(moving, 0.005)
    state = scheme.run(scheme.start(rest, velocity), 20)
    assert np.abs(state.contact_force[:, 0]).max() == 0.0


@pytest.mark.parametrize("dt", [1e-2, 1e-3])
@pytest.mark.parametrize("scheme", NEVER_GAIN)
@pytest.mark.parametrize(
    "columns, law", [(6, stribeck(0.5, 0.2, speed=0.05, viscosity=2.0)), (12, viscous(0.3, viscosity=10.0))]
)
def test_a_block_thrown_along_a_film_balances_forces_and_loses_energy(scheme, dt, columns, law):
    body = Body.from_grid(rectangle(1.0, 0.5, columns, columns // 2))
    elasticity = Elasticity(body, Isotropic(1e6, 0.3))
    weight = elasticity.body_force((400.0, -1000.0))
    scheme = scheme(MovingBody.from_forms(elasticity, 100.0, weight, Plane(), "bottom", friction=law), dt)
    first = scheme.start(velocity=np.tile([12.0 / columns, 0.0], (len(body.coordinates), 1)))
    energies, grazed = [energy(scheme, first)], 0
    for before, after in steps(scheme, first, round(1.0 / dt)):
        gained = momentum(scheme, after) - momentum(scheme, before)
        assert gained == pytest.approx(dt * weight.sum(axis=0) + after.work.impulse, abs=1e-9)
        tau, p = after.mean_force.T
        assert p.min() >= 0.0
        grazed += np.sum((p == 0.0) & (tau != 0.0))
        energies.append(energy(scheme, after))
    assert grazed > 0
    assert np.diff(energies).max() <= 1e-9 * energies[0]


@pytest.mark.parametrize("scheme", SCHEMES)
def test_the_problem_of_a_step_can_be_handed_on(scheme, tmp_path):
    moving, velocity = bouncing_ring(0.1)
    scheme = scheme(moving, 0.01)
    before = scheme.run(scheme.start(velocity=velocity), 36)
    assert before.count > 2
    save_step(tmp_path / "problem.npz", scheme, before)
    with np.load(tmp_path / "problem.npz") as file:
        displacement, force = file["displacement"], file["contact_force"]
    again = solve(ContactProblem.load(tmp_path / "problem.npz"), "direct", tolerance=1e-12)
    assert np.abs(again.displacement - displacement).max() < 1e-10
    assert np.abs(again.contact_force - force).max() < 1e-8
    assert force.any()


def test_a_tilted_scene_gives_the_tilted_answer():
    moving, velocity = bouncing_ring(0.1)
    angle = 0.7
    Q = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])

    def turned(A):
        blocks = A.copy()
        blocks.data = np.einsum("ab,kbc,dc->kad", Q, A.data, Q)
        return blocks

    tilted = MovingBody(
        turned(moving.M),
        turned(moving.K),
        moving.load_at(0.0) @ Q.T,
        moving.coordinates @ Q.T,
        moving.contact_nodes,
        Plane((0.0, 0.0), Q @ [0.0, 1.0]),
        friction=0.1,
    )
    scheme, twin = Newmark(moving, 0.01), Newmark(tilted, 0.01)
    state = scheme.run(scheme.start(velocity=velocity), 40)
    other = twin.run(twin.start(velocity=velocity @ Q.T), 40)
    assert np.array_equal(state.status, other.status)
    assert np.abs(state.displacement @ Q.T - other.displacement).max() < 1e-10


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("dt", [1e-9, 1e-5, 1.0, 10.0])
@pytest.mark.parametrize("friction", [None, 0.1])
def test_no_step_is_too_small_or_too_large(scheme, dt, friction):
    moving, velocity = bouncing_ring(friction)
    scheme = scheme(moving, dt)
    start = np.zeros_like(velocity)
    start[:, 1] = -0.5 + 1e-12
    velocity[:, 1] = -3.0
    state = scheme.start(start, velocity)
    for _, after in steps(scheme, state, 20):
        p, tau = pressures(scheme, after)
        assert np.isfinite(after.displacement).all()
        assert p.min() >= 0.0
        assert after.gap.min() >= 0.0
        assert (tau - (friction or 0.0) * p).max() <= 1e-12 * max(p.max(), 1.0)


def test_a_step_that_does_not_resolve_the_waves_is_named():
    moving, velocity = bouncing_ring()
    scheme = Newmark(moving, 0.01)
    first = scheme.start(velocity=velocity)
    history = History(scheme, first)
    with pytest.warns(UnresolvedWaves, match=r"dt = 0.01 does not resolve .* take dt = 0.00"):
        for _ in integrate(scheme, first, 40, history):
            pass
    assert history.resolution.fewest < 5


def test_what_is_refused():
    moving, velocity = bouncing_ring()
    with pytest.raises(ValueError, match="dt is 0.0"):
        Newmark(moving, 0.0)
    with pytest.raises(ValueError, match="2 beta >= gamma"):
        Newmark(moving, 0.01, beta=0.1)
    with pytest.raises(ValueError, match="central differences are stable to"):
        CentralDifferences(moving, 0.1)
    scheme = Newmark(moving, 0.01)
    with pytest.raises(ValueError, match="below the road"):
        scheme.start(np.full_like(velocity, -1.0))
    with pytest.raises(ValueError, match="velocity holds nan"):
        scheme.start(velocity=np.full_like(velocity, np.nan))
    everywhere = MovingBody(
        moving.M, moving.K, moving.load, moving.coordinates, np.arange(len(velocity)), moving.road
    )
    with pytest.raises(ValueError, match="none is left to carry the mass"):
        NEVER_GAIN[1](everywhere, 0.01)


def test_supports_and_loads_that_change():
    moving, _ = rod(20)
    frequency = np.pi / 2
    push = np.zeros_like(moving.coordinates)
    push[moving.contact_nodes, 0] = 0.05
    moving = MovingBody(
        moving.M,
        moving.K,
        lambda t: push * np.sin(frequency * t),
        moving.coordinates,
        moving.contact_nodes,
        Plane((-1.0, 0.0), (1.0, 0.0)),
    )
    for scheme in SCHEMES:
        scheme = scheme(moving, 0.02)
        first = scheme.start()
        history = History(scheme, first)
        for state in integrate(scheme, first, 100, history):
            assert np.abs(state.displacement[moving.prescribed]).max() == 0.0
        if np.isfinite(history["numerical"]).all():  # no closed form: HHT and generalised alpha
            assert np.abs(history["gain"] - history["numerical"]).max() < 1e-15
            assert history["gain"].max() < 1e-15
        assert history["load_work"][-1] != 0.0


def test_mass_that_finds_no_place_inside_is_refused():
    moving, _ = bouncing_ring(around=24, across=2)
    with pytest.raises(ValueError, match="finds no place in the other 48"):
        MassRedistribution(moving, 0.01)
