"""Bodies of revolution of finite strain: closed forms, the linear limit, tangents, pressure, motion."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from tangents import tangent_errors

from forms import Elasticity, Hyperelasticity, Isotropic, NeoHookean, Support
from geometry import Body, Grid, Plane, rectangle
from model import BodyOnRoad, EnergyMomentum, FiniteBody, FiniteContact, History, integrate

pytestmark = pytest.mark.filterwarnings("ignore::model.UnresolvedWaves")
RUBBER = NeoHookean(E=1000.0, nu=0.3)


def cylinder(cells=(4, 4), height=0.0):
    """Radius 0.5, length 1, on its axis."""
    return Body.from_grid(rectangle(0.5, 1.0, *cells, corner=(0.0, height)))


def test_small_strain_is_hooke_and_forces_are_derivatives():
    body = Body.from_grid(rectangle(0.5, 1.0, 4, 4, corner=(0.1, 0.0)))
    elastic = Hyperelasticity(body, RUBBER, pressure={"left": 30.0}, kinematics="axisymmetric")
    K = Elasticity(body, Isotropic(1000.0, 0.3), "axisymmetric").stiffness()
    assert np.abs((elastic.stiffness() - K).data).max() < 1e-12 * np.abs(K.data).max()
    random = np.random.default_rng(2)
    u0, u1, d = (random.uniform(-0.01, 0.01, body.coordinates.shape) for _ in range(3))
    assert max(tangent_errors(elastic, u0, u1, d)) < 1e-6
    bare = Hyperelasticity(body, RUBBER, kinematics="axisymmetric")
    f, gained = bare.step_force(u0, u1), bare.strain_energy(u1) - bare.strain_energy(u0)
    assert np.vdot(f, u1 - u0) == pytest.approx(gained, rel=1e-8)
    # the same numbers by numpy: the least det F of a widening by its own square
    wide = np.stack([0.5 * body.coordinates[:, 0], 0 * body.coordinates[:, 1]], axis=1)
    assert elastic.volume_ratio(wide) == pytest.approx(1.5**2)


@pytest.mark.parametrize("mean", [False, True])
def test_a_cylinder_pressed_between_smooth_plates_widens_as_a_rod(mean):
    """Uniaxial stress: stretches l along and w across, with mu (w - 1/w) + lambda ln(l w^2) / w = 0."""
    length, E, nu = 0.6, 1000.0, 0.3 if not mean else 0.499
    mu, lame = (NeoHookean(E, nu).parameters[name] for name in ("mu", "lame"))
    w = brentq(lambda w: mu * (w - 1 / w) + lame * np.log(length * w**2) / w, 0.5, 2.0, xtol=1e-15)
    force = -np.pi * 0.25 * (mu * (length - 1 / length) + lame * np.log(length * w**2) / length)
    body = cylinder()
    elastic = Hyperelasticity(body, NeoHookean(E, nu), mean_dilatation=mean, kinematics="axisymmetric")
    support = Support(body).fix("left", x=0.0).fix("top", y=length - 1.0)
    contact = BodyOnRoad(elastic.system(elastic.body_force((0.0, 0.0)), support), "bottom", Plane())
    solution = FiniteContact(contact).solve(steps=4)
    assert solution.pressure_force.sum() == pytest.approx(force, rel=1e-8)
    u = contact.displacement(solution)
    assert u[body.nodes("right"), 0] == pytest.approx(0.5 * (w - 1.0), rel=1e-8)
    stress = elastic.stress(u)
    assert np.abs(stress[:, [0, 2], [0, 2]]).max() < 1e-8 * np.abs(stress).max()
    assert stress[:, 1, 1] == pytest.approx(-force / (np.pi * (0.5 * w) ** 2), rel=1e-8)


def shell(cells):
    """A quarter section of a hollow ball, radii 1 and 2, its equator on y = 0."""
    n, m = cells
    angle, radius = np.linspace(0.0, 0.5 * np.pi, n + 1), np.linspace(1.0, 2.0, m + 1)
    points = np.array([(r * np.cos(a), r * np.sin(a)) for r in radius for a in angle])
    points[np.abs(points) < 1e-12] = 0.0
    number = np.arange(len(points)).reshape(m + 1, n + 1)
    cells = np.stack([number[:-1, :-1], number[:-1, 1:], number[1:, :-1], number[1:, 1:]], axis=-1)
    sides = {
        "inner": np.stack([number[0, :-1], number[0, 1:]], axis=1),
        "outer": np.stack([number[-1, :-1], number[-1, 1:]], axis=1),
        "equator": np.stack([number[:-1, 0], number[1:, 0]], axis=1),
        "axis": np.stack([number[:-1, -1], number[1:, -1]], axis=1),
    }
    return Body.from_grid(Grid(points, cells.reshape(-1, 4), "quadrilateral", sides))


def inner_widening(p):
    """Of a hollow ball under inner pressure, from the ordinary differential equation of its radius."""
    mu, lame = RUBBER.parameters["mu"], RUBBER.parameters["lame"]

    def nominal(stretch, J):
        return mu * (stretch - 1 / stretch) + lame * np.log(J) / stretch

    def slopes(R, y):  # radius, and nominal radial stress
        around = y[0] / R
        radial = brentq(lambda s: nominal(s, s * around**2) - y[1], 0.2, 5.0, xtol=1e-14)
        return [radial, 2 * (nominal(around, radial * around**2) - y[1]) / R]

    def stress_outside(r):
        return solve_ivp(slopes, (1.0, 2.0), [r, -p * r**2], rtol=1e-10, atol=1e-10).y[1, -1]

    return brentq(stress_outside, 1.0, 1.6) - 1.0


def test_a_hollow_ball_is_inflated_as_its_equation_says():
    p, off = 150.0, []
    wanted = inner_widening(p)
    assert wanted > 0.15
    for cells in ((8, 6), (16, 12)):
        body = shell(cells)
        elastic = Hyperelasticity(body, RUBBER, pressure={"inner": p}, kinematics="axisymmetric")
        support = Support(body).fix("axis", x=0.0).fix("equator", y=0.0)
        system = elastic.system(elastic.body_force((0.0, 0.0)), support)
        contact = BodyOnRoad(system, "outer", Plane((0.0, -9.0), (0.0, 1.0)))
        u = contact.displacement(FiniteContact(contact).solve(steps=3))
        off.append(np.linalg.norm((body.coordinates + u)[body.nodes("inner")], axis=1).mean() - 1 - wanted)
    assert abs(off[1]) < 0.005 * wanted and abs(off[1]) < 0.3 * abs(off[0])  # h^2


@pytest.mark.parametrize("mu", [None, 0.3])
def test_a_cylinder_dropped_on_its_end_gains_nothing(mu):
    body = cylinder((4, 6), height=0.01)
    elastic = Hyperelasticity(body, RUBBER, kinematics="axisymmetric")
    moving = FiniteBody.from_forms(
        elastic,
        1.0,
        elastic.body_force((0.0, -9.81)),
        Plane(),
        "bottom",
        support=Support(body).fix("left", x=0.0),
        friction=mu,
    )
    scheme = EnergyMomentum(moving, 0.001)
    state = scheme.start(velocity=np.zeros_like(body.coordinates) + [0.0, -2.0])
    history = History(scheme, state)
    for _ in integrate(scheme, state, 60, history, progress=False):
        pass
    assert history["contacts"].max() == 5
    assert history["gain"].max() < 1e-10 * history["kinetic"][0]
    assert history["kinetic"][0] == pytest.approx(0.5 * np.pi * 0.25 * 4.0)


def test_refusals():
    with pytest.raises(ValueError, match="Plane stress"):
        Hyperelasticity(cylinder(), RUBBER, kinematics="plane stress")
    with pytest.raises(ValueError, match="must have x >= 0"):
        across = Body.from_grid(rectangle(1.0, 1.0, 2, 2, corner=(-0.5, 0.0)))
        Hyperelasticity(across, RUBBER, kinematics="axisymmetric")
    with pytest.raises(ValueError, match="does not fit"):
        Hyperelasticity(cylinder(), RUBBER, kinematics="3d")
