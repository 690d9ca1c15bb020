"""Statics of finite strain: closed forms, the pressed ring, load paths, roads that bend, what is refused."""

import numpy as np
import pytest
from harness.thrown_ball import rough

from forms import Elasticity, Hyperelasticity, Isotropic, NeoHookean, StVenantKirchhoff, Support
from geometry import (
    Body,
    Grid,
    LinearRoad,
    MovingRoad,
    Plane,
    RoundRoad,
    SeveralRoads,
    box,
    rectangle,
    ring,
)
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


@pytest.mark.parametrize("mu", [None, 0.5])
def test_the_road_alone_holds_what_lies_on_it(mu):
    """No supports: a block under its weight, and with friction a ring in a groove."""
    body = Body.from_grid(rectangle(1.0, 0.5, 8, 4, corner=(0.0, 0.05)))
    elastic = Hyperelasticity(body, NeoHookean(1000.0, 0.3))
    lies = BodyOnRoad(elastic.system(elastic.body_force((0.0, -100.0))), "bottom", Plane(), friction=mu)
    assert FiniteContact(lies).solve().contact_force.sum(axis=0) == pytest.approx([0.0, 50.0], abs=1e-9)
    body = Body.from_grid(ring(0.5, 0.2, 48, 4, lowest=(0.0, 0.0)))
    elastic = Hyperelasticity(body, NeoHookean(1000.0, 0.3))
    weight = elastic.body_force((0.0, -9.81))
    groove = LinearRoad([-2.0, 0.0, 2.0], [1.79, -0.21, 1.79])
    rolls = FiniteContact(BodyOnRoad(elastic.system(weight), "outer", groove, friction=mu))
    if mu is None:
        with pytest.raises(NotConverged, match="support it against rolling"):
            rolls.solve(steps=3)
    else:
        held = rolls.solve(steps=3).contact_force.sum(axis=0)
        assert held == pytest.approx(-weight.sum(axis=0), abs=1e-9)


def pressed_block(nu, mu=None, cells=(16, 8), by=0.5):
    """A block of rubber bonded to a platen, a road pressed against it; its sides may touch both."""
    body = Body.from_grid(rectangle(1.0, 0.5, *cells, corner=(-0.5, 0.0)))
    elastic = Hyperelasticity(body, NeoHookean(E=1e3, nu=nu), mean_dilatation=True)
    road = MovingRoad(Plane((0.0, 0.0), (0.0, 1.0)), lambda t: (0.0, 0.5 * by * t))
    platen = Plane((0.0, 0.5), (0.0, -1.0))
    system = elastic.system(elastic.body_force((0.0, 0.0)), Support(body).fix("top", x=0.0, y=0.0))
    return BodyOnRoad(system, ["bottom", "left", "right"], SeveralRoads([road, platen]), friction=mu)


@pytest.mark.parametrize("nu, mu", [(0.45, None), (0.49, 0.3), (0.499, None), (0.499, 0.3)])
def test_rubber_bonded_to_its_platen_is_pressed_by_half(nu, mu):
    contact = pressed_block(nu, mu)
    statics = FiniteContact(contact)
    solution = statics.solve(steps=10)
    x = contact.points + contact.displacement(solution)[contact.nodes]
    assert x[:, 1].min() == pytest.approx(0.25, abs=1e-12) and x[:, 1].max() < 0.5 + 1e-12
    on_platen = (solution.status != 0) & (x[:, 1] > 0.5 - 1e-9) & (contact.points[:, 1] < 0.5 - 1e-9)
    assert on_platen.sum() >= 2 and on_platen.sum() % 2 == 0  # the sides have come to lie on it, alike
    assert statics.forces.volume_ratio(contact.displacement(solution)) > 0.0
    assert solution.residual < 1e-9
    tangential = np.abs(solution.contact_force[:, 0])
    assert np.all(tangential <= (mu or 0.0) * solution.pressure_force + 1e-9)
    if mu is None:  # no path to remember
        again = FiniteContact(pressed_block(nu)).solve(steps=3)
        assert again.pressure_force.sum() == pytest.approx(solution.pressure_force.sum(), rel=1e-6)


def test_a_road_that_comes_is_a_platen_that_comes():
    """Road moved up and along against a block, or the block down and back on the road, with friction."""
    body = Body.from_grid(rectangle(1.0, 0.5, 8, 4))
    elastic = Hyperelasticity(body, NeoHookean(1e3, 0.3))
    none = elastic.body_force((0.0, 0.0))
    comes = MovingRoad(Plane(), lambda t: (0.02 * t, 0.05 * t))
    held = elastic.system(none, Support(body).fix("top", x=0.0, y=0.0))
    moved = elastic.system(none, Support(body).fix("top", x=lambda t: -0.02 * t, y=lambda t: -0.05 * t))
    found = [
        FiniteContact(BodyOnRoad(system, "bottom", road, friction=0.3)).solve(steps=4)
        for system, road in ((held, comes), (moved, Plane()))
    ]
    assert found[0].contact_force == pytest.approx(found[1].contact_force, abs=1e-6)
    assert 0 < np.count_nonzero(found[0].status == 2) < 9


def test_friction_by_place_goes_with_a_road_that_moves():
    """Where one half of the belt is rough, the nodes over it are, as they are on a road at rest."""
    body = Body.from_grid(rectangle(1.0, 0.5, 8, 4))
    elastic = Hyperelasticity(body, NeoHookean(1e3, 0.3))
    held = elastic.system(elastic.body_force((0.0, 0.0)), Support(body).fix("top", x=0.0, y=0.0))
    comes = MovingRoad(Plane(), lambda t: (0.02 * t, 0.05 * t))
    middle = float(body.coordinates[:, 0].mean())

    def mu(x):
        return np.where(x[:, 0] < middle - 0.1, 0.6, 0.05)

    touch = FiniteContact(BodyOnRoad(held, "bottom", comes, friction=mu)).solve(steps=4)
    pressed = touch.pressure_force > 1e-9
    ratio = np.abs(touch.contact_force[pressed, 0]) / touch.pressure_force[pressed]
    assert ratio.max() > 0.06 and ratio.max() < 0.6 + 1e-9


def on_corners(grid, faces, road, mu, by):
    """The solution of a body of rubber pressed down on a road of facets, and where its nodes come to be."""
    body = Body.from_grid(grid)
    elastic = Hyperelasticity(body, NeoHookean(1e3, 0.3))
    still = {"x": 0.0} if grid.points.shape[1] == 2 else {"x": 0.0, "y": 0.0}
    down = {"xyz"[len(still)]: lambda t: -by * t}
    support = Support(body)
    if "top" in grid.facets:
        support.fix("top", **still, **down)
    else:
        support.fix_node(body.nearest_node((0.0, 1.0)), **still, **down)
    load = elastic.body_force(np.zeros(grid.points.shape[1]))
    contact = BodyOnRoad(elastic.system(load, support), faces, road, friction=mu)
    statics = FiniteContact(contact)
    solution = statics.solve(steps=5)
    x = contact.points + contact.displacement(solution)[contact.nodes]
    gap = road.closest(x)[0]
    assert solution.residual < 1e-10 and gap.min() > -1e-12
    assert np.abs(gap[solution.status != 0]).max() < 1e-12
    assert statics.forces.volume_ratio(solution.displacement) > 0.3
    return solution, x


GROOVE = LinearRoad([-2.0, 0.0, 2.0], [0.3, -0.1, 0.3])
TRIANGLES = LinearRoad(0.065 * np.arange(-24, 25), -0.02 * (np.arange(-24, 25) % 2))


@pytest.mark.parametrize("mu", [None, 0.3])
def test_a_node_is_pushed_into_the_bottom_of_a_groove(mu):
    """Its force lies within the cones of both slopes, and these bear half of the rest each.

    With friction it sticks where it first comes down, a little aside: on the road's nearest point to where it
    was before.
    """
    grid = rectangle(1.0, 0.5, 8, 4, corner=(-0.5, 0.0))
    solution, x = on_corners(grid, "bottom", GROOVE, mu, 0.15)
    force, lowest = solution.contact_force, np.argmin(x[:, 1])
    aside, unlike = (1e-12, 1e-9) if mu is None else (1e-3, 5e-3)
    assert x[lowest] == pytest.approx([0.0, -0.1], abs=aside) and np.all(solution.status != 0)
    left, right = (force[side].sum(axis=0) for side in (x[:, 0] < -0.1, x[:, 0] > 0.1))
    assert left == pytest.approx(right * [-1.0, 1.0], abs=unlike * right[1])
    widest = np.arctan(0.2) + np.arctan(mu or 0.0)
    assert abs(np.arctan2(*force[lowest])) <= widest + 1e-9 and force[lowest, 1] > 1.0


@pytest.mark.parametrize("mu", [None, 0.3])
def test_rubber_on_triangles_and_a_ring_in_a_groove(mu):
    """Half of the load on slopes of either kind where everything mirrors."""
    block = rectangle(1.04, 0.5, 31, 6, corner=(-0.52, 0.0))
    valley = LinearRoad([-2.0, 0.0, 2.0], [1.79, -0.21, 1.79])
    for grid, faces, road, by in (
        (block, "bottom", TRIANGLES, 0.12),
        (ring(0.5, 0.2, 48, 4, lowest=(0.0, 0.0)), "outer", valley, 0.4),
    ):
        solution, x = on_corners(grid, faces, road, mu, by)
        sides = [solution.contact_force[side].sum(axis=0) for side in (x[:, 0] < -1e-9, x[:, 0] > 1e-9)]
        assert sides[0] == pytest.approx(sides[1] * [-1.0, 1.0], rel=1e-3)


@pytest.mark.parametrize("mu", [None, 0.3])
def test_a_block_in_space_on_facets_sharper_than_its_cells(mu):
    grid = box(1.0, 1.0, 0.5, 8, 8, 4, corner=(-0.5, -0.5, 0.0))
    solution, _ = on_corners(grid, "bottom", rough(0.03, 0.2, 0.8), mu, 0.1)
    assert np.count_nonzero(solution.status) > 60


HELD_ASIDE = [  # normals of planes under bodies that supports hold along all axes but the vertical
    ((0.0, 1.0), None),
    ((0.1, 1.0), None),
    ((-0.4, 1.0), 0.3),
    ((0.0, 0.0, 1.0), None),
    ((0.2, -0.1, 1.0), None),
]


@pytest.mark.parametrize("normal, mu", HELD_ASIDE)
def test_a_body_held_aside_falls_on_a_slanted_wall(normal, mu):
    """Nothing holds it along the vertical, and the wall bears its weight; nodes are held in part."""
    if len(normal) == 2:
        body = Body.from_grid(ring(0.5, 0.2, 48, 4, lowest=(0.0, 0.0)))
        support, faces, deep = Support(body), "outer", (0.0, -0.06)
        for y in (0.0, 1.0):
            support.fix_node(body.nearest_node((0.0, y)), x=0.0)
    else:
        body = Body.from_grid(box(1.0, 1.0, 0.5, 3, 3, 2))
        support, faces, deep = (
            Support(body).fix("left", x=0.0).fix("front", y=0.0),
            "bottom",
            (0.0, 0.0, -0.3),
        )
    elastic = Hyperelasticity(body, NeoHookean(1e3, 0.3))
    weight = elastic.body_force([0.0] * (len(normal) - 1) + [-1.0])
    contact = BodyOnRoad(elastic.system(weight, support), faces, Plane(deep, normal), friction=mu)
    solution = FiniteContact(contact).solve(steps=2)
    force = solution.contact_force.sum(axis=0)
    assert force[-1] == pytest.approx(-weight.sum(), rel=1e-9)
    if mu is None:
        assert force == pytest.approx(force[-1] * np.array(normal), abs=1e-9)
    assert np.array_equal(solution.gap == 0.0, solution.status != 0)


def test_solutions_know_their_time_so_that_the_road_is_seen_where_it_is():
    elastic = Hyperelasticity(Body.from_grid(rectangle(1.0, 1.0, 2, 2)), NeoHookean(1.0, 0.3))
    system = elastic.system(np.zeros((9, 2)), Support(elastic.body).fix("top", x=0.0, y=0.0))
    rises = MovingRoad(Plane((0.0, -0.1)), lambda t: (0.0, 0.3 * t))
    contact = BodyOnRoad(system, "bottom", rises)
    for time, solution in zip((0.5, 1.0), FiniteContact(contact).follow([0.5, 1.0]), strict=True):
        assert solution.time == time
        gap = contact.fields(solution)[0]["gap"]
        assert np.abs(gap[contact.nodes]).max() < 1e-9
        assert gap[elastic.body.nodes("top")] == pytest.approx(1.1 - 0.3 * time)
