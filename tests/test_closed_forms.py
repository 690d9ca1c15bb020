"""The closed forms against what they must obey: loads, limits, signs, laws of motion."""

import numpy as np
import pytest
from scipy.integrate import quad

from model.closed_forms.carter import Carter
from model.closed_forms.hertz import HertzCylinder, HertzSphere, effective_modulus
from model.closed_forms.mindlin import MindlinCylinder, MindlinSphere
from model.closed_forms.rod import RodImpact
from model.closed_forms.spence import Spence, dundurs_beta, goodman_stick_ratio, unit_punch

PAPER = HertzCylinder(P=1e4, R=10, E=210e3, nu=0.3)
BALL = HertzSphere(F=100, R=10, E=210e3, nu=0.3)
rod = RodImpact()


def integral(function, a):
    """Over -a < x < a, midpoint rule in the angle."""
    angle = np.pi * ((np.arange(200_000) + 0.5) / 200_000 - 0.5)
    return np.mean(function(a * np.sin(angle)) * np.cos(angle)) * a * np.pi


def test_hertz_cylinder_is_the_papers():
    assert PAPER.p0 == pytest.approx(8570.66, abs=0.005)
    assert PAPER.a == pytest.approx(0.74279, abs=5e-6)
    assert integral(PAPER.pressure, PAPER.a) == pytest.approx(PAPER.P)
    assert PAPER.pressure([-1.0, 0.0, 1.0]).tolist() == [0, PAPER.p0, 0]


def test_hertz_sphere_carries_its_load_and_flattens():
    assert quad(lambda r: 2 * np.pi * r * BALL.pressure(r), 0, BALL.a)[0] == pytest.approx(BALL.F)
    # Johnson (3.42a): the deflection under the ellipsoid's middle is the approach
    assert np.pi * BALL.p0 * BALL.a / (2 * effective_modulus(BALL.E, BALL.nu)) == pytest.approx(BALL.approach)


@pytest.mark.parametrize("share", [0, 0.3, 0.75, 1])
def test_partial_slip_transmits_its_force(share):
    Q = share * 0.5 * PAPER.P
    mindlin, carter = MindlinCylinder(PAPER, Q, 0.5), Carter(PAPER, Q, 0.5)
    assert integral(mindlin.traction, PAPER.a) == pytest.approx(Q, abs=1e-6 * PAPER.P)
    assert integral(carter.traction, PAPER.a) == pytest.approx(Q, abs=1e-6 * PAPER.P)
    x = np.linspace(-PAPER.a, PAPER.a, 201)
    for traction in (mindlin.traction(x), carter.traction(x)):
        assert np.all(traction >= -1e-10) and np.all(traction <= mindlin.sliding_traction(x) + 1e-10)
    ball = MindlinSphere(BALL, share * 0.5 * BALL.F, 0.5)
    total = quad(lambda r: 2 * np.pi * r * ball.traction(r), 0, BALL.a, points=[ball.c])[0]
    assert total == pytest.approx(ball.Q, abs=1e-6 * BALL.F)


def test_partial_slip_at_the_papers_load():
    Q = 0.75 * 0.5 * PAPER.P
    assert MindlinCylinder(PAPER, Q, 0.5).c == pytest.approx(0.5 * PAPER.a)
    carter = Carter(PAPER, Q, 0.5)
    assert carter.stick_zone == pytest.approx((0, PAPER.a))
    assert carter.creepage == pytest.approx(0.5 * PAPER.a / 10 * 0.5)
    assert MindlinSphere(BALL, 0.875 * 0.5 * BALL.F, 0.5).c == pytest.approx(0.5 * BALL.a)


def test_mindlins_sphere_starts_with_the_stiffness_of_full_stick():
    # Johnson (7.43): Q / shift tends to 8 a G / (2 - nu)
    G, Q = BALL.E / 2.6, 1e-6
    assert Q / MindlinSphere(BALL, Q, 0.5).shift == pytest.approx(8 * BALL.a * G / 1.7, rel=1e-6)


@pytest.mark.parametrize("mu", [0.05, 0.1, 0.2, 0.5, 1, 3])
def test_spence_carries_the_load_within_the_cone(mu):
    spence = Spence(PAPER, mu)
    assert integral(spence.pressure, spence.a) == pytest.approx(PAPER.P, rel=1e-6)
    x = np.linspace(0, spence.a, 2001)[1:-1]
    p, tau = spence.pressure(x), spence.traction(x)
    assert np.all(tau >= 0) and np.all(tau <= mu * p * (1 + 1e-9))
    assert tau[x > spence.c] == pytest.approx(mu * p[x > spence.c])
    assert spence.pressure(0.0) == pytest.approx(spence.p0)
    assert np.all(spence.traction(-x) == -tau)


def test_spence_converges_with_the_square_of_the_panels():
    values = np.array([unit_punch(0.5, 0.3, n)[:1] + unit_punch(0.5, 0.3, n)[4:] for n in (25, 50, 100)])
    ratio = (values[0] - values[1]) / (values[1] - values[2])
    assert np.all((ratio > 3) & (ratio < 6))
    assert values[2] == pytest.approx([0.94102, 0.94266], abs=3e-5)


@pytest.mark.parametrize("nu", [0.3, 0.45])
def test_spence_tends_to_full_adhesion(nu):
    """A punch that cannot slip has a closed form, Johnson (2.72); the cylinder is a sum of such punches.

    Its tractions change sign for ever near the edge: a little slips there however rough the plane.
    """
    beta, punch = dundurs_beta(nu), unit_punch(1e6, nu)
    epsilon = np.arctanh(beta) / np.pi
    assert punch.pressure[0] == pytest.approx(1 / (np.pi * np.sqrt(1 - beta**2)), rel=2e-4)
    growth = 1 - epsilon * quad(lambda y: np.sin(epsilon * y) / np.cosh(y / 2), 0, 200, limit=200)[0]
    assert punch.growth == pytest.approx(growth, rel=2e-4)
    inner = punch.edges[1:] < 0.9
    middle = (punch.edges[1:] + punch.edges[:-1])[inner] / 2
    turn = epsilon * np.log((1 + middle) / (1 - middle))
    scale = np.sqrt((1 - beta**2) * (1 - middle**2)) * np.pi
    assert punch.pressure[inner] * scale == pytest.approx(np.cos(turn), abs=3e-3)
    assert punch.traction[inner] * scale == pytest.approx(np.sin(turn), abs=3e-3)


def test_spence_tends_to_goodman_where_the_coupling_is_weak():
    for nu, mu in [(0.49, 0.01), (0.495, 0.005)]:
        assert unit_punch(mu, nu).stick_ratio == pytest.approx(goodman_stick_ratio(mu, nu), rel=3e-3)
    assert unit_punch(0.3, 0.5).growth == pytest.approx(1, abs=1e-4)
    assert Spence(HertzCylinder(1e4, 10, 210e3, 0.5), 0.3).p0 == pytest.approx(
        HertzCylinder(1e4, 10, 210e3, 0.5).p0, rel=2e-4
    )


def test_goodmans_estimate_is_the_published_one():
    assert goodman_stick_ratio(0.5, 0.3) == pytest.approx(0.968, abs=5e-4)
    assert goodman_stick_ratio(0.2, 0.3) == pytest.approx(0.406, abs=5e-4)
    assert goodman_stick_ratio(0.1, 0.3) == pytest.approx(0.045, abs=5e-4)
    assert goodman_stick_ratio(0.1, 0.5) == 1


def test_rod_conserves_energy_and_obeys_wall_and_support():
    x = (np.arange(4000) + 0.5) / 4000
    for t in np.linspace(0, 7, 141):
        energy = np.mean(rod.velocity(x, t) ** 2 + rod.stress(x, t) ** 2) / 2
        assert energy == pytest.approx(rod.energy, rel=1e-3)
    t = np.linspace(0, 6, 601)
    assert np.all(rod.displacement(0, t) >= 0) and np.all(rod.displacement(1, t) == 0)
    assert np.all(rod.contact_pressure(t) * rod.displacement(0, t) == 0)
    assert rod.contact_pressure([0.5, 1.5, 2.5, 4.5]).tolist() == [0, 0.5, 0, 0.5]
    assert rod.displacement(0, [0.4, 1.7, 2.6]) == pytest.approx([0.3, 0, 0.3])


def test_rod_solves_the_wave_equation():
    x, t = np.meshgrid((np.arange(97) + 0.31) / 97.5, np.linspace(0, 3, 302)[1:-1] + 1e-4)
    h = 1e-7
    velocity = (rod.displacement(x, t + h) - rod.displacement(x, t - h)) / (2 * h)
    slope = (rod.displacement(x + h, t) - rod.displacement(x - h, t)) / (2 * h)
    assert velocity == pytest.approx(rod.velocity(x, t), abs=1e-6)
    assert slope == pytest.approx(rod.stress(x, t), abs=1e-6)
    assert -rod.stress(1e-6, np.array([1.2, 1.8])) == pytest.approx(0.5)


def test_rod_in_units():
    steel, (x, t) = RodImpact(L=2.0, E=2.1e11, rho=7800.0), np.meshgrid([0.0, 0.3, 0.9], [0.2, 1.3, 2.4])
    c = np.sqrt(2.1e11 / 7800.0)
    h = 1e-7
    velocity = (steel.displacement(2 * x, (2 * t + h) / c) - steel.displacement(2 * x, 2 * t / c)) / (h / c)
    assert velocity == pytest.approx(steel.velocity(2 * x, 2 * t / c), rel=1e-6)
    assert steel.stress(2 * x, 2 * t / c) == pytest.approx(2.1e11 * rod.stress(x, t))
    assert steel.contact_pressure(0.5 * steel.period) == pytest.approx(1.05e11)
    assert steel.energy == pytest.approx(0.5 * 2.1e11 * 0.5**2 * 2.0)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: HertzCylinder(-1, 10, 210e3, 0.3), "P is -1"),
        (lambda: HertzCylinder(1e4, 0, 210e3, 0.3), "R is 0"),
        (lambda: HertzCylinder(1e4, 10, float("nan"), 0.3), "E is nan"),
        (lambda: HertzSphere(1, 10, 210e3, 0.7), "nu must be .*0.7"),
        (lambda: HertzSphere(1, 10, "steel", 0.3), "E is 'steel'"),
        (lambda: MindlinCylinder(PAPER, 6000, 0.5), "Q must lie .*5000.*6000"),
        (lambda: Carter(PAPER, -1, 0.5), "Q must lie .*-1"),
        (lambda: MindlinSphere(BALL, 1, 0), "mu is 0"),
        (lambda: Spence(PAPER, -0.1), "mu is -0.1"),
        (lambda: Spence(PAPER, 1e-12).p0, "mu = 1e-12 leaves"),
        (lambda: RodImpact(rho=0.0), "rho is 0"),
        (lambda: rod.displacement(1.5, 0), "x must be .*1.5"),
        (lambda: rod.contact_pressure(-1), "t must be .*-1"),
    ],
)
def test_wrong_arguments_get_a_sentence(call, words):
    with pytest.raises(ValueError, match=words):
        call()


def test_the_rod_takes_nodes_where_rounding_has_put_them():
    rod = RodImpact()
    assert rod.displacement(-1e-19, 0.0) == rod.displacement(0.0, 0.0)
    with pytest.raises(ValueError, match="must be between 0 and 1"):
        rod.displacement(-1e-9, 0.0)
