"""Contact that takes no energy: rolling, bouncing, what friction takes, the limit of small steps."""

import numpy as np
import pytest

from forms import Hyperelasticity, NeoHookean
from geometry import Body, LinearRoad, Plane, RoundRoad, SmoothRoad, box, ring
from model import EnergyMomentum, FiniteBody, History, LosslessContact, integrate

pytestmark = pytest.mark.filterwarnings("ignore::model.UnresolvedWaves")


def ring_above_road(mu=None, height=0.0, around=48, across=4, road=None):
    body = Body.from_grid(ring(0.5, 0.2, around, across, lowest=(0.0, height)))
    elastic = Hyperelasticity(body, NeoHookean(E=1000.0, nu=0.3))
    load = elastic.body_force((0.0, -9.81))
    return FiniteBody.from_forms(elastic, 1.0, load, road or Plane(), "outer", friction=mu)


def ridden(scheme, steps, velocity):
    begin = scheme.start(velocity=velocity)
    history = History(scheme, begin)
    *_, end = integrate(scheme, begin, steps, history, progress=False)
    return history, end


def rolling(body, speed=2.0):
    """Velocities (N, 2) of a rigid ring that rolls."""
    arm = body.coordinates - [0.0, 0.5]
    return np.stack([speed + speed / 0.5 * arm[:, 1], -speed / 0.5 * arm[:, 0]], axis=1)


def test_rolling_loses_what_friction_takes_and_no_more():
    lost = {}
    for method in (EnergyMomentum, LosslessContact):
        body = ring_above_road(0.5)
        history, _ = ridden(method(body, 0.005), 40, rolling(body))
        lost[method] = (history["total"][0] - history["total"][-1]) / history["kinetic"][0]
        assert history["gain"].max() < 1e-11 * history["kinetic"][0]
        assert history["momentum_error"].max() < 1e-9
        assert history["contacts"].max() >= 3
    assert lost[EnergyMomentum] > 5e-4 and abs(lost[LosslessContact]) < 1e-10


@pytest.mark.parametrize("mu", [None, 0.3])
def test_a_bounce_keeps_energy_and_contact_exact(mu):
    body = ring_above_road(mu, height=0.02)
    scheme = LosslessContact(body, 0.005)
    state = scheme.start(velocity=np.zeros_like(body.coordinates) + [3.0, -2.0])
    history = History(scheme, state)
    for after in integrate(scheme, state, 50, history, progress=False):
        assert np.array_equal(after.gap == 0.0, after.status != 0)
        assert body.gaps(after.displacement)[0].min() > -1e-14
    kinetic = history["kinetic"][0]
    assert history["contacts"].max() >= 3 and history["contacts"][-1] == 0
    assert history["gain"].max() < 1e-10 * kinetic
    assert history["total"][0] - history["total"][-1] < 1e-10 * kinetic
    assert history["lowest_pressure"].min() >= 0.0
    assert np.all(np.diff(history["friction"]) >= -1e-12 * kinetic)
    assert history["momentum_error"].max() < 1e-9


def test_steps_that_resolve_no_waves_keep_energy_and_end_soon():
    """Where friction and waves leave no stress along C1 - C0, attempts end after 16 idle iterations."""
    body = ring_above_road(0.5, height=0.05, around=96, across=6)
    scheme = LosslessContact(body, 0.01)
    begin = scheme.start(velocity=np.zeros_like(body.coordinates) + [10.0, 0.0])
    history, spent = History(scheme, begin), []
    for _ in integrate(scheme, begin, 16, history, progress=False):
        spent.append(scheme.iterations)
    assert 60 < max(spent) < 1100  # 1,149 where each attempt goes on to its limit
    assert abs(history["total"][-1] - history["total"][0]) < 1e-9 * history["kinetic"][0]


def test_small_steps_lead_where_those_of_the_end_force_lead():
    off = {}
    for dt in (0.005, 0.00125):
        ends = []
        for method in (EnergyMomentum, LosslessContact):
            body = ring_above_road(0.3)
            end = ridden(method(body, dt), round(0.1 / dt), np.zeros_like(body.coordinates) + [3.0, -2.0])[1]
            ends.append(end.displacement)
        off[dt] = np.abs(ends[0] - ends[1]).max()
    assert off[0.00125] < 0.5 * off[0.005]


def test_a_block_in_space_bounces():
    body = Body.from_grid(box(0.4, 0.3, 0.3, 3, 3, 3, corner=(0.0, 0.0, 0.001)))
    elastic = Hyperelasticity(body, NeoHookean(E=1e4, nu=0.4))
    load = elastic.body_force((0, 0, -9.81))
    road = Plane((0, 0, 0), (0, 0, 1))
    moving = FiniteBody.from_forms(elastic, 1.0, load, road, "bottom", friction=0.4)
    history, _ = ridden(LosslessContact(moving, 1e-3), 15, np.zeros_like(body.coordinates) + [1.0, 0.5, -1.0])
    assert history["contacts"].max() > 0
    assert history["gain"].max() < 1e-10 * history["kinetic"][0]
    assert history["total"][0] - history["total"][-1] < 1e-10 * history["kinetic"][0]


X = np.linspace(-2.0, 4.0, 121)
WAVES = {
    "smooth": SmoothRoad(lambda x: 0.02 * np.sin(2 * np.pi * x) - 0.02, X),
    "linear": LinearRoad(X, 0.02 * np.sin(2 * np.pi * X) - 0.02),
    "round": RoundRoad(radius=2.0),
}


@pytest.mark.parametrize("kind", WAVES)
def test_a_ring_runs_over_roads_that_bend(kind):
    body = ring_above_road(0.5, road=WAVES[kind])
    scheme = LosslessContact(body, 0.005)
    state = scheme.start(velocity=rolling(body))
    history = History(scheme, state)
    for after in integrate(scheme, state, 8 if kind == "smooth" else 40, history, progress=False):
        gap = body.gaps(after.displacement)[0]
        assert gap.min() > -1e-12 and np.abs(gap[after.status != 0]).max(initial=0.0) < 1e-12
    kinetic = history["kinetic"][0]
    assert history["contacts"].max() >= 1
    assert history["gain"].max() < 1e-10 * kinetic
    assert np.all(np.diff(history["friction"]) >= -1e-12 * kinetic)


def test_a_ball_bounces_over_triangles_in_space():
    """Nodes come to lie on facets, over edges and in hollows, where all slopes that meet may press."""
    from harness.thrown_ball import rough, thrown

    ride = thrown((2.0, 0.3, -1.0), seconds=0.1, road=rough())
    kinetic = ride.history["kinetic"][0]
    assert ride.history["contacts"].max() >= 3 and ride.deepest < 1e-11
    assert ride.history["gain"].max() < 1e-10 * kinetic
    assert abs(ride.history["total"][0] - ride.history["total"][-1]) < 1e-10 * kinetic
    assert ride.history["friction"][-1] > 0.01 * kinetic and np.all(
        np.diff(ride.history["friction"]) > -1e-12
    )
    assert ride.history["momentum_error"].max() < 1e-10


def test_refusals():
    with pytest.raises(ValueError, match="take LosslessContact"):
        EnergyMomentum(ring_above_road(road=WAVES["smooth"]), 0.01)
