"""Statics of finite strain: closed forms, the pressed ring, load paths, roads that bend, what is refused."""

import numpy as np
import pytest

from forms import Elasticity, Hyperelasticity, Isotropic, NeoHookean, StVenantKirchhoff, Support
from geometry import Body, Grid, Plane, RoundRoad, box, rectangle, ring
from model import BodyOnRoad, FiniteContact, NotConverged, solve


def half_ring(outer, inner, around, across):
    """The lower half of a ring on the road, its cut at the height of the centre."""
    angles = np.linspace(np.pi, 2 * np.pi, around + 1)
    points = [
        (r * np.cos(a), outer + r * np.sin(a)) for r in np.linspace(inner, outer, across + 1) for a in angles
    ]
    n = around + 1
    cells = [
        [j * n + i, j * n + i + 1, (j + 1) * n + i, (j + 1) * n + i + 1]
        for j in range(across)
        for i in range(around)
    ]
    facets = {
        "outer": np.array([[across * n + i, across * n + i + 1] for i in range(around)]),
        "cut": np.array([[j * n + end, (j + 1) * n + end] for j in range(across) for end in (0, around)]),
    }
    return Grid(np.array(points), np.array(cells), "quadrilateral", facets)


def pressed_ring(mu=None, inner=0.2, mesh=(96, 10), by=0.15, energy=None):
    body = Body.from_grid(half_ring(0.5, inner, *mesh))
    elastic = Hyperelasticity(body, energy or NeoHookean(E=1000.0, nu=0.3))
    support = Support(body).fix("cut", y=lambda t: -by * t)
    support.fix_node(body.nearest_node((0.0, 0.5 - inner)), x=0.0)
    system = elastic.system(elastic.body_force((0.0, 0.0)), support)
    return FiniteContact(BodyOnRoad(system, "outer", Plane(), friction=mu))


@pytest.mark.parametrize(
    "mu, inner, mesh, by, force",
    [
        (None, 0.2, (96, 10), 0.15, 56.08),
        (0.5, 0.2, (96, 10), 0.15, 59.50),
        (None, 0.42, (160, 4), 0.35, 4.80),
    ],
)
def test_the_ring_between_road_and_platen(mu, inner, mesh, by, force):
    """Pressed by 30 % (thin: 70 %) of its diameter; the upper half mirrors the lower."""
    statics = pressed_ring(mu, inner, mesh, by)
    solution = statics.solve(steps=5)
    assert solution.pressure_force.sum() == pytest.approx(force, abs=0.006)
    assert solution.gap.min() == 0.0 and solution.residual < 1e-10
    assert np.array_equal(solution.gap == 0.0, solution.status != 0)
    tangential = np.abs(solution.contact_force[:, 0])
    assert np.all(tangential <= (mu or 0.0) * solution.pressure_force + 1e-12)
    assert statics.forces.volume_ratio(solution.displacement) > 0.5


def test_path_and_step_sizes_do_not_matter_without_friction():
    forces = [pressed_ring(mesh=(32, 4)).solve(steps=n).pressure_force.sum() for n in (1, 7)]
    assert forces[0] == pytest.approx(forces[1], rel=1e-9)
    halves = list(pressed_ring(mesh=(32, 4)).follow([0.5, 1.0]))
    assert halves[1].pressure_force.sum() == pytest.approx(forces[0], rel=1e-9)
    half = pressed_ring(mesh=(32, 4), by=0.075).solve()
    assert halves[0].pressure_force.sum() == pytest.approx(half.pressure_force.sum(), rel=1e-9)


def test_static_sag_of_the_paper_s_ring():
    body = Body.from_grid(ring(0.5, 0.2, 96, 6, lowest=(0.0, 0.0)))
    elastic = Hyperelasticity(body, NeoHookean(E=1000.0, nu=0.3))
    support = Support(body)
    for y in (0.0, 1.0):
        support.fix_node(body.nearest_node((0.0, y)), x=0.0)
    load = elastic.body_force((0.0, -9.81))
    contact = BodyOnRoad(elastic.system(load, support), "outer", Plane())
    solution = FiniteContact(contact).solve()
    u = contact.displacement(solution)
    M = elastic.mass(1.0) @ np.tile([0.0, 1.0], len(u))
    assert M @ (body.coordinates + u).ravel() / M.sum() == pytest.approx(0.4852, abs=2e-5)
    assert np.count_nonzero(solution.status) == 5
    assert solution.pressure_force.sum() == pytest.approx(-load[:, 1].sum(), rel=1e-9)


def test_a_block_in_space_under_uniaxial_strain():
    body = Body.from_grid(box(1.0, 1.0, 1.0, 2, 2, 2))
    E, nu, stretch = 1e3, 0.45, 0.6
    rubber = NeoHookean(E, nu)
    elastic = Hyperelasticity(body, rubber)
    support = Support(body).fix("top", z=stretch - 1.0)
    for name in ("left", "right"):
        support.fix(name, x=0.0)
    for name in ("front", "back"):
        support.fix(name, y=0.0)
    road = Plane((0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    contact = BodyOnRoad(elastic.system(elastic.body_force((0, 0, 0)), support), "bottom", road)
    mu, lame = rubber.parameters["mu"], rubber.parameters["lame"]
    force = -(mu * (stretch - 1 / stretch) + lame * np.log(stretch) / stretch)
    assert FiniteContact(contact).solve().pressure_force.sum() == pytest.approx(force, rel=1e-9)


def test_small_loads_are_those_of_linear_strain():
    body = Body.from_grid(rectangle(1.0, 0.5, 8, 4))
    found = []
    for forms in (
        Hyperelasticity(body, NeoHookean(1e3, 0.3)),
        Elasticity(body, Isotropic(1e3, 0.3)),
    ):
        support = Support(body).fix("top", x=1e-6, y=-1e-6)
        contact = BodyOnRoad(
            forms.system(forms.body_force((0.0, 0.0)), support), "bottom", Plane(), friction=0.3
        )
        found.append(FiniteContact(contact).solve() if not found else solve(contact))
    off = np.abs(found[0].contact_force - found[1].contact_force).max()
    assert off < 1e-4 * np.abs(found[1].contact_force).max()
    assert np.array_equal(found[0].status, found[1].status)


def test_a_round_road_is_met_exactly():
    body = Body.from_grid(rectangle(1.0, 0.5, 16, 8, corner=(-0.5, 0.0)))
    elastic = Hyperelasticity(body, NeoHookean(1e3, 0.4), mean_dilatation=True)
    road = RoundRoad(radius=0.4)
    support = Support(body).fix("top", x=0.0, y=lambda t: -0.15 * t)
    contact = BodyOnRoad(elastic.system(elastic.body_force((0, 0)), support), "bottom", road, friction=0.3)
    solution = FiniteContact(contact).solve(steps=3)
    gap = road.closest(contact.points + contact.displacement(solution)[contact.nodes])[0]
    assert np.abs(gap[solution.status != 0]).max() < 1e-12 and gap.min() > -1e-12
    assert np.count_nonzero(solution.status) > 5
    # action and reaction: forces along the road's normal within the cone
    assert np.abs(solution.contact_force.sum(axis=0)[0]) < 1e-8 * solution.pressure_force.sum()


def test_what_cannot_be_pressed_further_says_so():
    with pytest.raises(NotConverged, match="path stops at 0.* NeoHookean bears it"):
        pressed_ring(mesh=(16, 2), by=0.4, energy=StVenantKirchhoff(1000.0, 0.3)).solve(steps=2)
    assert pressed_ring(mesh=(16, 2), by=0.4).solve(steps=2).residual < 1e-10
    body = Body.from_grid(rectangle(1.0, 0.5, 4, 2))
    linear = Elasticity(body, Isotropic(1e3, 0.3))
    with pytest.raises(ValueError, match="linear strain takes model.solve"):
        FiniteContact(BodyOnRoad(linear.system(linear.body_force((0.0, -1.0))), "bottom", Plane()))
