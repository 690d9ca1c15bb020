"""Roads that move in time steps: belts, presses, rollers; and the same scenes seen by who goes with them."""

import numpy as np
import pytest

from forms import Elasticity, Hyperelasticity, Isotropic, NeoHookean, Support
from geometry import Body, ExtrudedRoad, LinearRoad, MovingRoad, Plane, RoadSeenFromAfar, RoundRoad, rectangle
from model import (
    HHT,
    BodyOnRoad,
    CentralDifferences,
    ContactStabilised,
    FiniteBody,
    History,
    MassRedistribution,
    MovingBody,
    Newmark,
    Status,
    follow,
    integrate,
    solve,
    static_kinetic,
)

G = 10.0
SCHEMES = {
    "Newmark": Newmark,
    "HHT": lambda body, dt: HHT(body, dt, alpha=0.1),
    "ContactStabilised": ContactStabilised,
    "MassRedistribution": MassRedistribution,
    "CentralDifferences": CentralDifferences,
}


def block(road, friction, height=0.0, support=None, E=1e4):
    body = Body.from_grid(rectangle(1.0, 0.5, 6, 3, corner=(0.0, height)))
    elasticity = Elasticity(body, Isotropic(E, 0.3))
    held = None if support is None else support(Support(body))
    return MovingBody.from_forms(
        elasticity, 1.0, elasticity.body_force((0.0, -G)), road, "bottom", held, friction=friction
    )


@pytest.mark.parametrize("scheme", SCHEMES)
def test_it_does_not_matter_who_moves(scheme):
    """A block thrown on ground at rest, and the same seen from a train: Galileo's relativity."""
    ground, train = LinearRoad([-50.0, 50.0], [-5.1, 4.9]), np.array([-0.7, 0.4])
    dt, steps, height = 1e-3, 150, 0.02
    start = np.tile([1.2, -0.5], (28, 1))
    at_rest = block(ground, 0.3, height)
    moving = block(MovingRoad(ground, train), 0.3, height)
    one, other = (SCHEMES[scheme](body, dt) for body in (at_rest, moving))
    a, b = one.start(velocity=start), other.start(velocity=start + train)
    touched = 0
    for _ in range(steps):
        a, b = one.step(a), other.step(b)
        touched += a.count > 0
    assert touched > 5
    np.testing.assert_allclose(b.displacement - train * b.time, a.displacement, atol=1e-9)
    np.testing.assert_allclose(b.contact_force, a.contact_force, atol=1e-6)


def test_a_slider_on_a_belt_goes_with_it_until_its_spring_pulls_with_mu_n():
    k, mu, speed, weight = 4.0, 0.2, 0.5, 0.5 * G
    belt = MovingRoad(Plane(), (speed, 0.0))

    def spring(support):
        return support.spring("left", x=k).dashpot("left", x=1.0)

    scheme = MassRedistribution(block(belt, mu, support=spring, E=1e5), 1e-2)
    state = scheme.run(scheme.start(), 500)
    assert k * state.displacement[:, 0].mean() == pytest.approx(mu * weight, rel=1e-2)
    assert np.all(state.status[state.contact_force[:, 1] > 0.01] == Status.SLIP)
    along, down = state.contact_force.sum(axis=0)
    assert along == pytest.approx(mu * down)


def test_a_slider_that_slips_at_k_s_equal_mu_s_n_sticks_and_slips_again():
    """Its spring's force swings between mu_s N and, without damping, 2 mu_k N - mu_s N."""
    k, speed, weight = 40.0, 0.01, 0.1 * G
    belt = MovingRoad(Plane(), (speed, 0.0))
    body = Body.from_grid(rectangle(1.0, 0.1, 1, 3))  # two feet, so that no part slips before the whole
    elasticity = Elasticity(body, Isotropic(1e5, 0.0))
    support, gravity = Support(body).spring("bottom", x=k), elasticity.body_force((0.0, -G))
    system = elasticity.system(gravity, support, density=1.0, damping=(0.0, 1e-3))
    contact = BodyOnRoad(system, "bottom", belt, friction=static_kinetic(0.3, 0.2))
    scheme = MassRedistribution(MovingBody.from_contact(contact), 2e-3)
    state = scheme.start(solve(contact).displacement, np.tile([speed, 0.0], (8, 1)))
    force = []
    for _ in range(500):
        state = scheme.step(state)
        force.append(k * state.displacement[:2, 0].mean())
    peak = int(np.argmax(force))
    assert force[peak] == pytest.approx(0.3 * weight, rel=0.01)
    assert peak * scheme.dt == pytest.approx(0.3 * weight / (k * speed), rel=0.02)
    assert min(force[peak:]) == pytest.approx((2 * 0.2 - 0.3) * weight, rel=0.1)


def test_a_slider_on_a_slow_belt_in_load_steps():
    """Quasi-statically it goes with the belt until k s = mu N, and no further."""
    k, mu, weight = 400.0, 0.3, 0.5 * G
    body = Body.from_grid(rectangle(1.0, 0.5, 6, 3))
    elasticity = Elasticity(body, Isotropic(1e5, 0.3))
    support = Support(body).spring("left", x=k)
    system = elasticity.system(elasticity.body_force((0.0, -G)), support)
    contact = BodyOnRoad(system, "bottom", MovingRoad(Plane(), (1.0, 0.0)), friction=mu)
    slip = mu * weight / k
    for solution in follow(contact, slip * np.array([0.25, 0.5, 0.75, 0.99, 1.01, 1.1])):
        pull = k * min(solution.time, slip)
        assert k * solution.displacement[:, 0].mean() == pytest.approx(pull, rel=5e-3)
        assert np.all(solution.status == Status.SLIP) == (solution.time > slip)


@pytest.mark.parametrize("acceleration, sticks", [(0.9, True), (1.2, False)])
def test_a_belt_that_speeds_up_takes_a_block_along_as_far_as_friction_goes(acceleration, sticks):
    """It sticks while a < mu g; else it follows with mu g."""
    a, mu, dt = acceleration * 0.3 * G, 0.3, 5e-3
    belt = MovingRoad(Plane(), lambda t: (0.5 * a * t**2, 0.0))
    scheme = MassRedistribution(block(belt, mu, E=1e6), dt)
    state = scheme.run(scheme.start(), 100)
    expected = 0.5 * (a if sticks else mu * G) * state.time**2
    assert state.displacement[:, 0].mean() == pytest.approx(expected, rel=2e-2)


def test_a_press_that_comes_down_and_goes_up_again_does_no_work_in_the_end():
    body = Body.from_grid(rectangle(1.0, 0.5, 6, 3))
    elasticity = Elasticity(body, Isotropic(1e4, 0.3))
    support = Support(body).fix("bottom", x=0.0, y=0.0)
    press = MovingRoad(Plane((0.0, 0.5), (0.0, -1.0)), lambda t: (0.0, 0.01 - 0.02 * np.sin(np.pi * t)))
    held = MovingBody.from_forms(
        elasticity, 1.0, elasticity.body_force((0.0, 0.0)), press, "top", support, damping=(0.0, 1e-3)
    )
    scheme = ContactStabilised(held, 5e-3)
    first = scheme.start()
    history = History(scheme, first)
    *_, middle = integrate(scheme, first, 100, history)
    stiffness = 1e4 / (1 - 0.3**2) / 0.5
    assert -middle.contact_force[:, 1].sum() == pytest.approx(0.01 * stiffness, rel=0.2)
    assert abs(middle.displacement[body.nodes("top"), 1] + 0.01).max() < 1e-12
    *_, last = integrate(scheme, middle, 100, history)
    assert last.count == 0
    assert history["gain"].max() <= 1e-12 * history["strain"].max()


def test_a_roller_that_turns_drags_a_block_that_a_spring_holds():
    k, mu = 2000.0, 0.3
    roller = MovingRoad(RoundRoad((0.5, 0.0), (0.0, 1.0), 0.3), turn=lambda t: -2.0 * t, centre=(0.5, -0.3))

    def spring(support):
        return support.spring("left", x=k).dashpot("left", x=5.0).fix("top", y=-1e-3)

    scheme = MassRedistribution(block(roller, mu, support=spring, E=1e4), 5e-3)
    state = scheme.run(scheme.start(), 100)
    force = state.contact_force.sum(axis=0)
    assert force[1] > 1.0 and force[0] == pytest.approx(mu * force[1], rel=3e-2)


def test_a_road_that_moves_is_not_hidden_in_another():
    belt = MovingRoad(Plane(), (1.0, 0.0))
    for make in (
        ExtrudedRoad,
        lambda road: RoadSeenFromAfar(road, 0.0, 1.0),
        lambda road: MovingRoad(road, (1.0, 0.0)),
    ):
        with pytest.raises(ValueError, match="takes a road at rest.*let the whole move"):
            make(belt)


def test_finite_strain_says_that_roads_must_rest():
    body = Body.from_grid(rectangle(1.0, 1.0, 2, 2))
    elasticity = Hyperelasticity(body, NeoHookean(E=1.0, nu=0.3))
    load = np.zeros((9, 2))
    with pytest.raises(ValueError, match="under a body of finite strain it must rest"):
        FiniteBody.from_forms(elasticity, 1.0, load, MovingRoad(Plane(), (1.0, 0.0)), "bottom")
