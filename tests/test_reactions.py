"""Reactions of supports and platens, and sheets of forces and moments that close."""

import numpy as np
import pytest

from forms import Elasticity, Hyperelasticity, Isotropic, NeoHookean, Support
from geometry import Body, Plane, RoundRoad, box, rectangle, ring
from model import BodyOnRoad, MovingBody, Newmark, follow, solve

WEIGHT = 7.0


def test_a_beam_on_a_pivot_and_a_pad():
    """Weight and a push: statics gives what the pivot and the road bear, and their moments."""
    body = Body.from_grid(rectangle(4.0, 1.0, 16, 4))
    elasticity = Elasticity(body, Isotropic(1e4, 0.3))
    load = elasticity.body_force((0.0, -WEIGHT / 4)) + elasticity.total_force("right", (-1.5, 0.0))
    pivot = body.nearest_node((0.0, 0.5))
    body.mark("pad", lambda x: (x[1] < 1e-9) & (x[0] > 3 - 1e-9))
    system = elasticity.system(load, Support(body).fix_node(pivot, x=0.0, y=0.0))
    contact = BodyOnRoad(system, "pad", Plane(), friction=0.2)
    sheet = contact.reactions(solve(contact), about=body.coordinates[pivot])
    assert sheet.remainder < 1e-9
    assert sum(sheet.moment.values()) == pytest.approx(0, abs=1e-8)
    assert sheet.moment["reactions"] == pytest.approx(0, abs=1e-12)
    assert sheet.moment["loads"] == pytest.approx(-2 * WEIGHT)
    assert sheet.force["contact"] + sheet.force["reactions"] == pytest.approx([1.5, WEIGHT])
    np.testing.assert_allclose(sheet.at([pivot])[0], sheet.force["reactions"])
    assert "reactions" in str(sheet) and "sum" in str(sheet)


@pytest.mark.parametrize("dim", [2, 3])
def test_a_platen_bears_the_moment_that_keeps_it_from_tilting(dim):
    """Load off the middle of a platen: its force sums to nothing, its moment is the load's."""
    grid = rectangle(2.0, 1.0, 8, 4) if dim == 2 else box(2.0, 1.0, 1.0, 6, 3, 3)
    body = Body.from_grid(grid)
    elasticity = Elasticity(body, Isotropic(1e4, 0.3))
    load = np.zeros(body.coordinates.shape)
    corner = body.nearest_node((2.0, 1.0) if dim == 2 else (2.0, 0.5, 1.0))
    load[corner, -1] = -3.0
    support = Support(body).platen("top").fix("top", x=0.0, y=0.0 if dim == 3 else None)
    contact = BodyOnRoad(elasticity.system(load, support), "bottom", Plane())
    middle = (1.0, 0.0) if dim == 2 else (1.0, 0.5, 0.0)
    sheet = contact.reactions(solve(contact), about=middle)
    assert sheet.force["reactions"] == pytest.approx(0, abs=1e-8)
    offset = body.coordinates[corner] - middle
    exact = -3 * offset[0] if dim == 2 else np.cross(offset, (0, 0, -3.0))
    np.testing.assert_allclose(sheet.moment["reactions"] + exact, 0, atol=1e-8)
    np.testing.assert_allclose(sum(sheet.moment.values()), 0, atol=1e-8)


def test_what_a_press_needs_along_a_path_of_times():
    body = Body.from_grid(rectangle(2.0, 1.0, 8, 4))
    elasticity = Elasticity(body, Isotropic(1e3, 0.0))
    support = Support(body).fix("top", x=0.0, y=lambda t: -0.01 * t)
    contact = BodyOnRoad(elasticity.system(elasticity.body_force((0.0, -1.0)), support), "bottom", Plane())
    for step, solution in enumerate(follow(contact, [1.0, 2.0, 3.0]), start=1):
        force = contact.reactions(solution).force
        assert force["contact"][1] == pytest.approx(20 * step + 1)  # half of the weight hangs on the press
        assert force["reactions"][1] == pytest.approx(1 - 20 * step)


def test_a_load_that_the_system_does_not_know_is_given():
    body = Body.from_grid(rectangle(2.0, 1.0, 4, 2))
    elasticity = Elasticity(body, Isotropic(1e3, 0.3))
    load = elasticity.total_force("top", (0.0, -2.0))
    system = elasticity.system(load, Support(body).fix_node(body.nearest_node((1, 1)), x=0.0))
    contact = BodyOnRoad(system, "bottom", Plane())
    half = next(iter(follow(contact, [0.5 * system.load])))
    with pytest.raises(ValueError, match="do not balance .*load="):
        contact.reactions(half)
    assert contact.reactions(half, load=0.5 * load).force["contact"] == pytest.approx([0, 1], abs=1e-9)
    with pytest.raises(ValueError, match="about is .* must be 2 finite"):
        contact.reactions(half, about=(0, 0, 0))


def test_a_wheel_on_a_round_road_balances_in_motion():
    """Newmark's steps of a damped ring in its bounce: inertia, damping, weight and contact."""
    body = Body.from_grid(ring(0.5, 0.2, 24, 2))
    elasticity = Elasticity(body, Isotropic(1e4, 0.3))
    low = body.coordinates[:, 1].min()
    system = elasticity.system(elasticity.body_force((0.0, -10.0)), density=1.0, damping=(0.3, 1e-4))
    contact = BodyOnRoad(system, "outer", Plane((0.0, low - 1e-3)), friction=0.3)
    motion = Newmark(MovingBody.from_contact(contact), 1e-3)
    state = motion.start(velocity=np.tile([0.5, -0.5], (len(body.coordinates), 1)))
    touched = 0
    for _ in range(20):
        state = motion.step(state)
        sheet = contact.reactions(state, about=(0.1, 0.2))
        assert sheet.remainder < 1e-9
        np.testing.assert_allclose(
            sum(sheet.moment.values()), 0, atol=1e-8 * abs(sheet.force["inertia"]).max()
        )
        touched += state.contact_force.any()
    assert touched > 5


def test_reactions_on_a_hill():
    body = Body.from_grid(rectangle(2.0, 1.0, 8, 4, corner=(-0.7, 0.005)))
    elasticity = Elasticity(body, Isotropic(1e3, 0.3))
    system = elasticity.system(elasticity.body_force((0.0, 0.0)), Support(body).fix("top", x=0.0, y=-0.01))
    contact = BodyOnRoad(system, "bottom", RoundRoad(radius=5.0), friction=0.4)
    sheet = contact.reactions(solve(contact))
    assert sheet.force["contact"] == pytest.approx(-sheet.force["reactions"], abs=1e-8)
    assert sheet.moment["contact"] == pytest.approx(-sheet.moment["reactions"], abs=1e-8)


def test_a_sheet_of_finite_strain_is_refused_and_so_are_its_springs():
    rubber = Hyperelasticity(Body.from_grid(rectangle(2.0, 1.0, 2, 2)), NeoHookean(E=1e3, nu=0.3))
    nothing, support = rubber.body_force((0.0, 0.0)), Support(rubber.body)
    contact = BodyOnRoad(rubber.system(nothing, support), "bottom", Plane())
    with pytest.raises(ValueError, match="linear strain only"):
        contact.reactions(None)
    with pytest.raises(ValueError, match="linear strain only"):
        rubber.system(nothing, support.spring("top", x=1.0))
