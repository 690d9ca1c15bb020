"""Energy and momentum of moving bodies: identities that hold in every step."""

import numpy as np
import pytest
from bodies_in_motion import NEVER_GAIN, SCHEMES, bouncing_ring, cube, energy, momentum, pressures, steps

from forms import Elasticity, Isotropic, Support
from geometry import Body, Plane, half_ball, rectangle
from model import CentralDifferences, History, MassRedistribution, MovingBody, Newmark, integrate
from model.problem.rigid_modes import rigid_motions

KINETIC = 33.0  # of the ring at the start


@pytest.mark.parametrize("friction", [None, 0.1])
@pytest.mark.parametrize("damping", [None, (0.2, 1e-3)])
def test_newmark_changes_the_energy_by_the_work_of_the_mean_contact_forces(friction, damping):
    moving, velocity = bouncing_ring(friction, damping=damping)
    scheme = Newmark(moving, 0.01)
    contacts = 0
    for before, after in steps(scheme, scheme.start(velocity=velocity), 60):
        p0, p1 = pressures(scheme, before)[0], pressures(scheme, after)[0]
        change = after.displacement - before.displacement
        expected = 0.5 * np.sum((p0 + p1) * (after.gap - before.gap))
        mean = 0.5 * (before.contact_force + after.contact_force)
        expected += np.sum(mean[:, 0] * change[moving.contact_nodes, 0])
        if damping:
            speed = 0.5 * (before.velocity + after.velocity)
            expected -= change.ravel() @ (moving.C @ speed.ravel())
        assert abs(energy(scheme, after) - energy(scheme, before) - expected) < 1e-12 * KINETIC
        contacts += after.count
    assert contacts > 20


@pytest.mark.parametrize("scheme", NEVER_GAIN)
@pytest.mark.parametrize("friction", [None, 0.1, 2.0])
@pytest.mark.parametrize("dt", [0.02, 0.003])
def test_stabilised_schemes_never_gain_energy(scheme, friction, dt):
    moving, velocity = bouncing_ring(friction)
    scheme = scheme(moving, dt)
    first = scheme.start(velocity=velocity)
    first_touch = scheme.run(first, int(0.3 / dt))
    for before, after in steps(scheme, first_touch, int(0.25 / dt)):
        assert energy(scheme, after) - energy(scheme, before) < 1e-12 * KINETIC


@pytest.mark.parametrize("scheme", NEVER_GAIN)
def test_stabilised_schemes_know_what_they_lose(scheme):
    moving, velocity = bouncing_ring(0.1, damping=(0.0, 1e-3))
    scheme = scheme(moving, 0.01)
    state = scheme.start(velocity=velocity)
    history = History(scheme, state)
    for _ in integrate(scheme, state, 60, history):
        pass
    assert np.abs(history["gain"] - history["numerical"]).max() < 1e-12 * KINETIC
    assert history["gain"].max() < 1e-12 * KINETIC
    assert history["friction"][-1] > 1.0
    assert np.diff(history["friction"]).min() > -1e-12
    assert history["damping"][-1] > 0.1


@pytest.mark.parametrize("scheme", SCHEMES)
def test_free_flight_is_rigid_and_keeps_energy_and_momentum(scheme):
    moving, velocity = bouncing_ring()
    scheme = scheme(moving, 0.01)
    first = scheme.start(velocity=velocity)
    for before, after in steps(scheme, first, 31):
        fall = np.array([10.0 * after.time, -0.5 * 9.81 * after.time**2])
        assert np.abs(after.displacement - fall).max() < 1e-12
        assert np.abs(after.velocity - [10.0, -9.81 * after.time]).max() < 1e-11
        assert abs(energy(scheme, after) - energy(scheme, before)) < 1e-12 * KINETIC
        weight = moving.load_at(0.0).sum(axis=0)
        assert np.abs(momentum(scheme, after) - momentum(scheme, before) - 0.01 * weight).max() < 1e-12


@pytest.mark.parametrize("scheme", [*SCHEMES, CentralDifferences])
@pytest.mark.parametrize("friction", [None, 0.1])
def test_the_impulse_of_the_road_accounts_for_the_momentum(scheme, friction):
    moving, velocity = bouncing_ring(friction)
    scheme = scheme(moving, 0.001 if scheme is CentralDifferences else 0.01)
    state = scheme.start(velocity=velocity)
    weight = moving.load_at(0.0).sum(axis=0)
    touched = 0
    for before, after in steps(scheme, state, round(0.5 / scheme.dt)):
        impulse = scheme.dt * (weight + after.mean_force.sum(axis=0))
        assert np.abs(momentum(scheme, after) - momentum(scheme, before) - impulse).max() < 1e-10
        touched += after.count
    assert touched > 10


def test_redistribution_keeps_mass_centre_and_inertia():
    moving, _ = bouncing_ring()
    M = MassRedistribution(moving, 0.01).M
    dense = M.toarray()
    assert np.abs(dense[2 * moving.contact_nodes]).max() == 0.0
    assert np.linalg.eigvalsh(dense).min() > -1e-16
    x = moving.coordinates
    turning = np.stack([-x[:, 1], x[:, 0]], axis=1).ravel()
    fields = [np.tile([1.0, 0.0], len(x)), np.tile([0.0, 1.0], len(x)), turning]
    for u in fields:
        for v in fields:
            assert abs(u @ (M @ v) - u @ (moving.M @ v)) < 1e-13


@pytest.mark.parametrize("part", ["half", "quarter"])
def test_redistribution_on_a_body_cut_by_planes_of_symmetry(part):
    body = Body.from_grid(half_ball(0.5, part))
    elasticity = Elasticity(body, Isotropic(1e3, 0.3))
    support = Support(body).fix("y0", y=0.0)
    if part == "quarter":
        support.fix("x0", x=0.0)
    weight = elasticity.body_force((0.0, 0.0, -10.0))
    road = Plane((0.0, 0.0, -0.1), (0.0, 0.0, 1.0))
    moving = MovingBody.from_forms(elasticity, 1.0, weight, road, "sphere", support)
    scheme = MassRedistribution(moving, 0.01)
    state = scheme.start()
    kept = [u for u in np.moveaxis(rigid_motions(moving.coordinates), 2, 0) if not u[moving.prescribed].any()]
    assert len(kept) == {"half": 3, "quarter": 1}[part]  # along z and, cut once, along x and about y
    for u in kept:
        assert u.ravel() @ (scheme.M @ u.ravel()) == pytest.approx(
            u.ravel() @ (moving.M @ u.ravel()), rel=1e-12
        )
    touched, start = 0, energy(scheme, state)
    for before, after in steps(scheme, state, 40):
        assert energy(scheme, after) <= energy(scheme, before) + 1e-13
        touched += after.count
    assert touched > 10
    assert energy(scheme, after) > start - 0.02


def test_redistribution_on_a_clamped_body():
    body = Body.from_grid(rectangle(1.0, 1.0, 4, 4))
    elasticity = Elasticity(body, Isotropic(1e3, 0.3))
    support = Support(body).fix("top", x=0.0, y=0.0)
    moving = MovingBody.from_forms(
        elasticity, 1.0, elasticity.body_force((0.0, -1.0)), Plane((0.0, -1e-3)), "bottom", support
    )
    along = np.where(moving.prescribed, 0.0, [0.0, 1.0]).ravel()
    M = MassRedistribution(moving, 0.01).M
    assert along @ (M @ along) == pytest.approx(along @ (moving.M @ along), rel=1e-12)


def test_in_three_dimensions_too():
    moving = cube(friction=0.3)
    scheme = Newmark(moving, 0.01)
    velocity = np.zeros_like(moving.coordinates)
    velocity[:] = 1.0, 0.5, -2.0
    touched = 0
    for before, after in steps(scheme, scheme.start(velocity=velocity), 20):
        expected = after.work.normal + after.work.friction
        assert abs(energy(scheme, after) - energy(scheme, before) - expected) < 1e-12 * 3.0
        p, tau = pressures(scheme, after)
        assert after.gap.min() >= 0.0
        assert p.min() >= 0.0
        assert (tau - 0.3 * p).max() < 1e-13 * max(p.max(), 1.0)
        touched += after.count
    assert touched > 5
