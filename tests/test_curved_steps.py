"""Time steps on roads that are not flat: nodes end on them, and such roads give no energy away either."""

import warnings

import numpy as np
import pytest

from forms import Elasticity, Isotropic
from geometry import Body, LinearRoad, Plane, RoadSeenFromAfar, RoundRoad, SmoothRoad, ring
from model import ContactStabilised, History, MassRedistribution, MovingBody, Newmark, NotConverged, Status
from model.curved.tangent_planes import _working
from model.dynamics.curved_steps import on_curved_road
from model.recording.wave_resolution import UnresolvedWaves

MU, DT = 0.1, 2e-3
SCHEMES = [ContactStabilised, MassRedistribution]
X = np.arange(-1.0, 5.0, 0.02)
HEIGHTS = 4e-3 * np.sin(2 * np.pi * X / 0.31) + 2e-3 * np.cos(2 * np.pi * X / 0.17) - 6e-3
ROUGH = SmoothRoad.through(X, HEIGHTS)
QUICK = RoadSeenFromAfar(ROUGH, HEIGHTS.max(), reach=0.03)


def thrown(road, friction=MU):
    """The ring of section 3.2, coarse, thrown on the road from just above it."""
    body = Body.from_grid(ring(0.5, 0.2, 48, 3, lowest=(0.0, 2e-3)))
    elasticity = Elasticity(body, Isotropic(E=1000.0, nu=0.3))
    weight = elasticity.body_force((0.0, -9.81))
    velocity = np.zeros_like(body.coordinates)
    velocity[:] = (10.0, -3.0)
    return MovingBody.from_forms(elasticity, 1.0, weight, road, "outer", friction=friction), velocity


def ride(scheme, road, steps=75, dt=DT, friction=MU, each=None):
    moving, velocity = thrown(road, friction)
    integrator = scheme(moving, dt)
    state = integrator.start(velocity=velocity)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UnresolvedWaves)
        history = History(integrator, state)
        for _ in range(steps):
            before, state = state, integrator.step(state)
            history.record(before, state)
            if each is not None:
                each(integrator, state)
    return state, history


@pytest.mark.parametrize("scheme", [*SCHEMES, Newmark])
def test_a_plane_given_as_a_profile_gives_the_steps_of_the_plane(scheme):
    steps = 10 if scheme is Newmark else 30  # it lets go and touches again, and rounding grows with that
    flat, _ = ride(scheme, Plane(), steps)
    assert flat.count > 0
    x = np.array([-9.0, -0.31, 0.02, 0.4, 9.0])
    for road in (LinearRoad(x, 0 * x), SmoothRoad.through(x, 0 * x)):
        state, _ = ride(on_curved_road(scheme), road, steps)
        scale = np.abs(flat.displacement).max()
        assert np.abs(state.displacement - flat.displacement).max() <= 1e-12 * scale
        assert np.abs(state.contact_force - flat.contact_force).max() <= 1e-9 * flat.contact_force.max()
        # a node whose friction lies on Coulomb's bound may be told either way by rounding, and no other node
        tangential, normal = np.abs(flat.contact_force.T)
        inside = np.abs(tangential - MU * normal) > 1e-9 * flat.contact_force.max()
        assert np.array_equal(state.status[inside], flat.status[inside])
        assert np.array_equal(state.status != Status.FREE, flat.status != Status.FREE)


@pytest.mark.parametrize(
    "scheme, friction", [(ContactStabilised, MU), (MassRedistribution, MU), (MassRedistribution, None)]
)
def test_nodes_end_on_the_road_which_gives_them_no_energy(scheme, friction):
    road, seen = QUICK, []

    def on_the_road(integrator, state):
        moving = integrator.body
        gap, normal, _ = road.closest(
            moving.coordinates[moving.contact_nodes] + state.displacement[moving.contact_nodes]
        )
        touching = state.status != Status.FREE
        assert np.abs(gap[touching]).max(initial=0.0) <= 1e-12
        assert gap.min() >= -1e-12
        assert np.all(state.gap >= 0.0) and np.all(state.gap[touching] == 0.0)
        force = state.contact_force
        assert np.all(force[~touching] == 0.0)
        pressure = np.einsum("ca,ca->c", normal, force)
        cosine = pressure[touching] / np.linalg.norm(force[touching], axis=1)
        assert np.all(cosine >= 0.9)  # along the road's normal, but for friction and what it turns in a step
        seen.append(state.count)

    _, history = ride(on_curved_road(scheme), road, friction=friction, each=on_the_road)
    assert max(seen) > 3 and seen[-1] == 0  # it has touched, and let go
    start = history["kinetic"][0]
    assert history["gain"].max() <= (1e-12 if scheme is MassRedistribution else 1e-4) * start
    assert history["total"][-1] < history["total"][0]
    assert history["lowest_pressure"].min() >= 0.0
    assert history["cone"].max() <= 1e-12
    assert history["momentum_error"].max() <= 1e-11


def test_on_a_tilted_plane_nothing_but_the_axes_has_changed():
    """A plane is a road that does not bend: rounds on it give what the plane itself gives."""
    slope = Plane((0, -0.02), (-0.1, 1.0))
    (one, _), (other, _) = (
        ride(ContactStabilised, slope, 60),
        ride(on_curved_road(ContactStabilised), slope, 60),
    )
    assert one.count > 3
    np.testing.assert_allclose(other.displacement, one.displacement, atol=1e-12)


@pytest.mark.parametrize("dim", [2, 3])
def test_normals_that_work_on_the_change_of_the_gap(dim):
    random = np.random.default_rng(2)
    road = RoundRoad(np.zeros(dim), np.eye(dim)[-1], 0.7)
    was = np.column_stack([random.uniform(-0.3, 0.3, (9, dim - 1)), random.uniform(0.0, 0.1, 9)])
    at = road.closest(was + random.uniform(-0.1, 0.1, (9, dim)))[2]
    gap, before, _ = road.closest(was)
    _, normal, foot = road.closest(at)
    working = _working(np.arange(9), gap, before, was, normal, foot, 1e-12)
    work, opened = np.einsum("ca,ca->c", working, foot - was), -gap
    assert np.all(np.sign(work) == np.sign(opened))
    np.testing.assert_allclose(work, opened, rtol=0.05)  # of unit length, they are a little shorter
    assert np.all(np.einsum("ca,ca->c", working, normal) > 0.97)
    still = _working(np.arange(9), 0 * gap, normal, foot, normal, foot, 1e-12)
    np.testing.assert_allclose(still, normal, atol=1e-15)


def test_far_off_a_road_only_its_summit_is_seen():
    road = RoadSeenFromAfar(ROUGH, HEIGHTS.max(), reach=0.1)
    points = np.array([[0.3, 0.05], [0.7, 2.0], [1.1, -0.01]])
    gap, normal, foot = road.closest(points)
    for mine, exact in zip((gap, normal, foot), ROUGH.closest(points)):
        assert np.array_equal(mine[[0, 2]], exact[[0, 2]])
    assert road.reach < gap[1] <= ROUGH.closest(points)[0][1]
    np.testing.assert_allclose(foot + gap[:, None] * normal, points, atol=1e-15)
    full, _ = ride(on_curved_road(ContactStabilised), ROUGH, 10)
    quick, _ = ride(on_curved_road(ContactStabilised), road, 10)
    assert np.array_equal(full.displacement, quick.displacement)
    with pytest.raises(ValueError, match="summit is nan"):
        RoadSeenFromAfar(ROUGH, np.nan, 0.1)


def test_rounds_that_do_not_settle_say_so(monkeypatch):
    monkeypatch.setattr("model.dynamics.curved_steps.ITERATIONS", 1)
    with pytest.raises(NotConverged, match="after 1 iterations nodes are .* off it.*smaller time steps"):
        ride(on_curved_road(ContactStabilised), QUICK, 30)
