"""Pressure that follows the boundary: tubes against their own equation, energy, tangents, refusals."""

import numpy as np
import pytest
from scipy.integrate import solve_bvp
from tangents import tangent_errors

from forms import Hyperelasticity, NeoHookean, Support
from geometry import Body, Grid, MovingRoad, Plane, SeveralRoads, box, rectangle, ring
from model import BodyOnRoad, EnergyMomentum, FiniteBody, FiniteContact, History, integrate

pytestmark = pytest.mark.filterwarnings("ignore::model.UnresolvedWaves")
INNER, OUTER, RUBBER = 0.2, 0.5, NeoHookean(E=1000.0, nu=0.3)


def tube(p, mesh=(48, 8), road=-5.0):
    """A ring about the origin with pressure inside, held such that it can widen freely."""
    body = Body.from_grid(ring(OUTER, INNER, *mesh, lowest=(0.0, -OUTER)))
    elastic = Hyperelasticity(body, RUBBER, pressure={"inner": p})
    support = Support(body)
    for x in (-OUTER, OUTER):
        support.fix_node(body.nearest_node((x, 0.0)), y=0.0)
    support.fix_node(body.nearest_node((0.0, -OUTER)), x=0.0)
    system = elastic.system(elastic.body_force((0.0, 0.0)), support)
    return elastic, BodyOnRoad(system, "outer", Plane((0.0, road), (0.0, 1.0)))


def widening(p):
    """Widening of the inner radius by the ordinary differential equation of a tube's radius."""
    mu, lame = RUBBER.parameters["mu"], RUBBER.parameters["lame"]

    def nominal(stretch, J):
        return mu * (stretch - 1 / stretch) + lame * np.log(J) / stretch

    def slopes(R, y):  # radius and nominal radial stress; the radial stretch by Newton's method
        around, radial = y[0] / R, np.ones_like(R)
        for _ in range(40):
            off = nominal(radial, radial * around) - y[1]
            bend = mu * (1 + 1 / radial**2) + lame * (1 - np.log(radial * around)) / radial**2
            radial = radial - off / bend
        return np.stack([radial, (nominal(around, radial * around) - y[1]) / R])

    def ends(inside, outside):
        return np.array([inside[1] + p * inside[0] / INNER, outside[1]])

    R = np.linspace(INNER, OUTER, 50)
    found = solve_bvp(slopes, ends, R, np.stack([R, 0.0 * R]), tol=1e-8)
    assert found.success
    return found.sol(INNER)[0] - INNER


@pytest.mark.parametrize("p", [1.0, 80.0])
def test_a_tube_widens_as_its_equation_says(p):
    wanted, off = widening(p), []
    if p == 1.0:  # Lame, small strain
        shear, square = 1000.0 / 2.6, (OUTER / INNER) ** 2
        assert wanted == pytest.approx(p * INNER / (2 * shear) * (0.4 + square) / (square - 1), rel=3e-3)
    for mesh in ((24, 4), (48, 8)):
        elastic, contact = tube(p, mesh)
        u = contact.displacement(FiniteContact(contact).solve())
        x = elastic.body.coordinates
        inner = elastic.body.nodes("inner")
        off.append(np.linalg.norm((x + u)[inner], axis=1).mean() - INNER - wanted)
    assert abs(off[1]) < 0.012 * wanted
    assert abs(off[1]) < 0.3 * abs(off[0])  # h^2


def test_the_pressure_presses_the_tube_on_the_road():
    _, contact = tube(60.0, road=-0.505)
    solution = FiniteContact(contact).solve()
    assert solution.pressure_force.sum() > 1.0 and solution.gap.min() == 0.0


def test_energy_is_pressure_times_volume_and_motion_keeps_it():
    p = 20.0
    body = Body.from_grid(ring(OUTER, INNER, 32, 3, lowest=(0.0, 0.01)))
    elastic, bare = Hyperelasticity(body, RUBBER, pressure={"inner": p}), Hyperelasticity(body, RUBBER)
    u = np.random.default_rng(1).uniform(-0.01, 0.01, body.coordinates.shape)
    nodes = body.nodes("inner")
    x = (body.coordinates + u)[nodes]
    arm = x - x.mean(axis=0)
    x = x[np.argsort(np.arctan2(arm[:, 1], arm[:, 0]))]
    area = 0.5 * np.sum(x[:, 0] * np.roll(x[:, 1], -1) - x[:, 1] * np.roll(x[:, 0], -1))
    assert elastic.strain_energy(u) == pytest.approx(bare.strain_energy(u) - p * area, rel=1e-12)
    moving = FiniteBody.from_forms(elastic, 1.0, elastic.body_force((0.0, -9.81)), Plane(), "outer")
    scheme = EnergyMomentum(moving, 0.0025)
    state = scheme.start(velocity=np.zeros_like(u) + [1.0, -1.0])
    history = History(scheme, state)
    for _ in integrate(scheme, state, 40, history, progress=False):
        pass
    assert history["contacts"].max() > 0
    assert history["gain"].max() < 1e-10 * history["kinetic"][0]
    assert history["momentum_error"].max() < 1e-9
    assert np.ptp(history["strain"]) > 0.01 * history["kinetic"][0]  # the tube breathes


@pytest.mark.parametrize("dim", [2, 3])
def test_tangents_step_force_and_what_it_does(dim):
    if dim == 2:
        body, face = Body.from_grid(ring(OUTER, INNER, 16, 2)), "inner"
    else:
        body, face = Body.from_grid(box(1.0, 1.0, 1.0, 2, 2, 2)), ["left", "right", "front", "back", "top"]
    pressure = dict.fromkeys([face] if dim == 2 else [*face, "bottom"], 30.0)
    elastic = Hyperelasticity(body, RUBBER, pressure=pressure)
    random = np.random.default_rng(2)
    u0, u1, d = (random.uniform(-0.02, 0.02, body.coordinates.shape) for _ in range(3))
    assert max(tangent_errors(elastic, u0, u1, d)) < 1e-6
    K = elastic.tangent(u1)
    assert np.abs((K - K.T).data).max() < 1e-10 * np.abs(K.data).max()  # closed: symmetric
    f = elastic.step_force(u0, u1)
    gained = elastic.strain_energy(u1) - elastic.strain_energy(u0)
    assert np.vdot(f, u1 - u0) == pytest.approx(gained, rel=1e-7)
    assert np.abs(f.sum(axis=0)).max() < 1e-12 * np.abs(f).sum()


def arc_of_a_tube(whole):
    """A tube about the origin, or its lower half."""
    angle = np.linspace(np.pi, 3 * np.pi, 49)[: 48 if whole else 25]
    points = np.array([(r * np.cos(a), r * np.sin(a)) for r in np.linspace(INNER, OUTER, 5) for a in angle])
    number = np.arange(len(points)).reshape(5, angle.size)
    ahead = np.roll(number, -1, axis=1)
    if not whole:
        number, ahead = number[:, :-1], ahead[:, :-1]
    cells = np.stack([number[:-1], ahead[:-1], number[1:], ahead[1:]], axis=-1).reshape(-1, 4)
    sides = {name: np.stack([number[k], ahead[k]], axis=1) for name, k in (("inner", 0), ("outer", -1))}
    return Body.from_grid(Grid(points, cells, "quadrilateral", sides))


def test_a_half_pressed_by_its_cut_is_half_of_a_tube_between_roads():
    """The plane of the cut moves towards the road: the volume within is that below the cut."""
    by, found = 0.08, []
    for whole in (True, False):
        body = arc_of_a_tube(whole)
        elastic, support = Hyperelasticity(body, RUBBER, pressure={"inner": 60.0}), Support(body)
        support.fix_node(body.nearest_node((0.0, -OUTER)), x=0.0)
        cut = body.mark("cut", lambda x: np.abs(x[1]) < 1e-9).nodes("cut") if not whole else ()
        for node in cut:
            support.fix_node(int(node), y=lambda t: -by * t)
        if whole:
            support.fix_node(body.nearest_node((0.0, OUTER)), x=0.0)
            for x in (-OUTER, OUTER):
                support.fix_node(body.nearest_node((x, 0.0)), y=0.0)
        comes = [
            MovingRoad(Plane((0.0, -OUTER)), lambda t: (0.0, by * t)),
            MovingRoad(Plane((0.0, OUTER), (0.0, -1.0)), lambda t: (0.0, -by * t)),
        ]
        road = SeveralRoads(comes) if whole else Plane((0.0, -OUTER))
        system = elastic.system(elastic.body_force((0.0, 0.0)), support)
        contact = BodyOnRoad(system, "outer", road)
        solution = FiniteContact(contact).solve(steps=3)
        up = solution.contact_force[:, 1]
        found.append(up[up > 0.0].sum())
    assert found[1] == pytest.approx(found[0], rel=1e-8) and found[0] > 1.0


def test_refusals():
    body = Body.from_grid(rectangle(1.0, 0.5, 4, 2))
    elastic = Hyperelasticity(body, RUBBER, pressure={"top": 1.0})
    load = elastic.body_force((0.0, 0.0))
    with pytest.raises(ValueError, match="'top', whose rim may move"):
        elastic.system(load, Support(body).fix("bottom", x=0.0, y=0.0))
    held = Support(body).fix("left", x=0.0, y=0.0).fix("right", x=0.0, y=0.0)
    contact = BodyOnRoad(elastic.system(load, held), "bottom", Plane((0.0, -0.1), (0.0, 1.0)))
    down = contact.displacement(FiniteContact(contact).solve())
    assert down[body.nearest_node((0.5, 0.5)), 1] < 0.0
    with pytest.raises(ValueError, match="must be a finite number"):
        Hyperelasticity(body, RUBBER, pressure={"top": np.nan})
    with pytest.raises(ValueError, match="no boundary 'lid'"):
        Hyperelasticity(body, RUBBER, pressure={"lid": 1.0})
