"""Contact in space: plane scenes drawn out sideways, Hertz's sphere, and no preferred direction."""

import numpy as np
import pytest

from forms import Elasticity, Isotropic, Support
from geometry import (
    Body,
    ExtrudedRoad,
    Grid,
    LinearRoad,
    Plane,
    RoundRoad,
    SmoothRoad,
    box,
    half_ball,
    rectangle,
)
from model import ContactSolver, Status, solve
from model.closed_forms.hertz import HertzSphere
from model.quasistatics.curved_contact import CurvedContact
from model.results.body_on_road import BodyOnRoad

E, NU, R, F = 210e3, 0.3, 10.0, 15e3
HERTZ = HertzSphere(F, R, E, NU)
UP = Plane((0, 0, 0), (0, 0, 1))


def ball(refinements, part="quarter", friction=None, road=UP, push=(0.0, 0.0)):
    body = Body.from_grid(half_ball(R, part), refinements)
    share = {"quarter": 4, "half": 2, "whole": 1}[part]
    elasticity = Elasticity(body, Isotropic(E, NU))
    load = elasticity.total_force("top", (push[0] / share, push[1] / share, -F / share))
    support = Support(body).platen("top")
    if friction is None:
        support.fix("top", x=0.0, y=0.0)
    if part != "whole":
        support.fix("y0", y=0.0)
    if part == "quarter":
        support.fix("x0", x=0.0)
    system = elasticity.system(load, support)
    return BodyOnRoad(system, "sphere", road, friction=friction, reach=0.1 * R)


def punch(dim, road, friction, push):
    """Press a block of 6 x 2 (x 1) on a road and push it; in 3-D it is held in y, as in plane strain."""
    if dim == 2:
        body = Body.from_grid(rectangle(6.0, 2.0, 12, 6, corner=(-3, 0), distortion=0.1, seed=4))
    else:
        flat = rectangle(6.0, 2.0, 12, 6, corner=(-3, 0), distortion=0.1, seed=4)
        points = np.concatenate([np.insert(flat.points, 1, y, axis=1) for y in (0.0, 1.0)])
        n = len(flat.points)
        cells = np.concatenate(
            [flat.cells[:, :2], flat.cells[:, :2] + n, flat.cells[:, 2:], flat.cells[:, 2:] + n], axis=1
        )
        facets = {
            name: np.concatenate([rows, rows + n], axis=1)
            for name, rows in flat.facets.items()
            if name in ("top", "bottom")
        }
        facets |= {"front": flat.cells, "back": flat.cells + n}
        body = Body.from_grid(Grid(points, cells, "hexahedron", facets))
    elasticity = Elasticity(body, Isotropic(10.0, NU))
    load = elasticity.total_force("top", (push, -4.0) if dim == 2 else (push, 0.0, -4.0))
    support = Support(body).platen("top")
    if dim == 3:
        support.fix("front", y=0.0).fix("back", y=0.0)
    system = elasticity.system(load, support)
    pressed = BodyOnRoad(system, "bottom", road, friction=friction)
    solution = CurvedContact(ContactSolver(pressed.problem, "direct"), pressed.points).solve(
        road, tolerance=1e-11
    )
    return pressed, solution


@pytest.mark.parametrize("friction, push", [(None, 0.0), (0.4, 0.5)])
@pytest.mark.parametrize("radius", [40.0, -40.0, np.inf])
def test_a_scene_drawn_out_sideways_gives_the_answer_of_the_plane(friction, push, radius):
    road = Plane((0, 0), (0, 1)) if radius == np.inf else RoundRoad((0.2, -0.2), (0, 1), radius)
    if friction is None:
        road, push = RoundRoad((0.2, -0.2), (0, 1), -40.0), 0.1  # a hollow holds the block by itself
    flat, in_plane = punch(2, road, friction, push)
    deep, in_space = punch(3, ExtrudedRoad(road), friction, push)
    u, v = flat.displacement(in_plane), deep.displacement(in_space)
    place = {tuple(np.round(p, 12)): k for k, p in enumerate(flat.elasticity.body.coordinates)}
    of = [place[tuple(np.round(p, 12))] for p in deep.elasticity.body.coordinates[:, [0, 2]]]
    scale = np.abs(u).max()
    assert np.abs(v[:, [0, 2]] - u[of]).max() <= 1e-8 * scale
    assert np.abs(v[:, 1]).max() <= 1e-12 * scale
    statuses = {tuple(np.round(p, 12)): s for p, s in zip(flat.points, in_plane.status)}
    assert [statuses[tuple(np.round(p, 12))] for p in deep.points[:, [0, 2]]] == list(in_space.status)


@pytest.fixture(scope="module")
def presses():
    """Solve Hertz's sphere by multigrid on two nested meshes."""
    bodies = [ball(k) for k in (1, 2)]
    return [(body, solve(body.problem, "multigrid", tolerance=1e-8)) for body in bodies]


def test_hertz_sphere(presses):
    body, solution = presses[1]
    pressure, radius = body.pressure(solution), np.hypot(*body.points[:, :2].T)
    assert pressure.max() == pytest.approx(HERTZ.p0, rel=0.01)
    inside = radius < 0.8 * HERTZ.a
    slope, square = np.polyfit(radius[inside] ** 2, pressure[inside] ** 2, 1)
    assert np.sqrt(-square / slope) == pytest.approx(HERTZ.a, rel=0.01)
    assert radius[solution.status != Status.FREE].max() < 1.1 * HERTZ.a
    assert 4 * solution.pressure_force.sum() == pytest.approx(F, rel=1e-7)
    assert np.all(solution.gap >= 0) and np.all(solution.pressure_force >= 0)


def test_pressure_converges_to_hertz(presses):
    errors = []
    for body, solution in presses:
        radius = np.hypot(*body.points[:, :2].T)
        difference = body.pressure(solution) - HERTZ.pressure(radius)
        errors.append(
            np.sqrt(np.sum(body.area * difference**2) / np.sum(body.area * HERTZ.pressure(radius) ** 2))
        )
    assert errors[1] < errors[0] < 0.03


def test_cycles_do_not_depend_on_the_mesh(presses):
    cycles = [solution.cycles for _, solution in presses]
    assert max(cycles) <= 16
    assert abs(cycles[0] - cycles[1]) <= 2


def test_corrections_agree_in_space(presses):
    body, solution = presses[0]
    direct = solve(body.problem, "direct", tolerance=1e-11)
    scale = np.abs(direct.displacement).max()
    assert np.abs(solution.displacement - direct.displacement).max() <= 1e-6 * scale


def test_a_quarter_and_the_whole_agree():
    quarter, whole = ball(1), ball(1, "whole")
    one = solve(quarter.problem, "multigrid", tolerance=1e-10)
    all_round = solve(whole.problem, "multigrid", tolerance=1e-10)
    at = {tuple(np.round(p, 9)): q for p, q in zip(whole.points, whole.pressure(all_round))}
    expected = [at[tuple(np.round(p, 9))] for p in quarter.points]
    np.testing.assert_allclose(quarter.pressure(one), expected, atol=1e-5 * HERTZ.p0)


def turned_block(angle, road=UP):
    """A block pressed with friction and pushed along its own x, all of it turned about the vertical."""
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    grid = box(3.0, 2.0, 1.5, 6, 4, 3, corner=(-1.5, -1.0, 0.0), distortion=0.2, seed=1)
    grid.points = grid.points @ turn.T
    body = Body.from_grid(grid)
    elasticity = Elasticity(body, Isotropic(10.0, NU))
    load = elasticity.total_force("top", turn @ (0.8, 0.3, -3.0))
    system = elasticity.system(load, Support(body).platen("top"))
    pressed = BodyOnRoad(system, "bottom", road, friction=0.4)
    return pressed, solve(pressed.problem, "direct", tolerance=1e-12), turn


def test_friction_has_no_preferred_direction():
    straight, solution, _ = turned_block(0.0)
    assert {Status.SLIP, Status.STICK} <= set(solution.status)
    for angle in (0.3, 2.0):
        turned, other, turn = turned_block(angle)
        at = {tuple(np.round(p @ turn, 9)): k for k, p in enumerate(turned.points)}
        of = [at[tuple(np.round(p, 9))] for p in straight.points]
        assert np.array_equal(solution.status, other.status[of])
        np.testing.assert_allclose(other.contact_force[of] @ turn, solution.contact_force, atol=1e-9)
        tangential = np.linalg.norm(other.contact_force[:, :2], axis=1)
        assert np.all(tangential <= 0.4 * other.pressure_force + 1e-12)


def test_a_plane_given_as_a_surface_gives_the_answer_of_the_plane():
    flat, on_plane, _ = turned_block(0.3)
    x, y = np.array([-5.0, -0.31, 0.02, 4.0]), np.array([-4.0, 0.1, 0.7, 1.3, 5.0])
    places = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    for road in (LinearRoad(places, 0 * places[:, 0]), SmoothRoad.through(places, 0 * places[:, 0])):
        pressed, _, _ = turned_block(0.3, road)
        contact = CurvedContact(ContactSolver(pressed.problem, "direct"), pressed.points)
        solution = contact.solve(road, tolerance=1e-12)
        assert np.array_equal(solution.status, on_plane.status)
        scale = np.abs(on_plane.displacement).max()
        assert np.abs(solution.displacement - on_plane.displacement).max() <= 1e-12 * scale
        force = np.abs(on_plane.contact_force).max()
        assert np.abs(solution.contact_force - on_plane.contact_force).max() <= 1e-11 * force


def rough_block():
    """A block pressed with friction on a rough surface and pushed."""
    line = np.arange(-3.0, 3.1, 0.25)
    places = np.stack(np.meshgrid(line, line, indexing="ij"), axis=-1).reshape(-1, 2)
    heights = 0.03 * np.sin(2.3 * places[:, 0] + 1.0) * np.cos(1.9 * places[:, 1]) - 0.03
    road = SmoothRoad.through(places, heights)
    body = Body.from_grid(box(3.0, 2.0, 1.5, 10, 7, 5, corner=(-1.5, -1.0, 0.0)))
    elasticity = Elasticity(body, Isotropic(10.0, NU))
    load = elasticity.total_force("top", (0.5, 0.2, -3.0))
    system = elasticity.system(load, Support(body).platen("top"))
    pressed = BodyOnRoad(system, "bottom", road, friction=0.6)
    contact = CurvedContact(ContactSolver(pressed.problem, "direct"), pressed.points)
    return road, pressed, contact, contact.solve(road)


def test_nodes_end_on_a_rough_surface(tmp_path):
    road, pressed, contact, solution = rough_block()
    at = pressed.points + solution.displacement[pressed.problem.contact_nodes]
    gap, normal, _ = road.closest(at)
    touching = solution.status != Status.FREE
    assert 5 < np.count_nonzero(touching) < touching.size
    assert np.abs(gap[touching]).max() <= 1e-12 * 3.0
    assert gap.min() >= -1e-12 * 3.0
    pressure = np.sum(solution.contact_force * normal, axis=1)
    traction = solution.contact_force - pressure[:, None] * normal
    assert np.all(pressure >= -1e-9 * pressure.max())
    assert np.all(np.linalg.norm(traction, axis=1) <= 0.6 * pressure + 1e-8 * pressure.max())
    np.testing.assert_allclose(solution.contact_force.sum(axis=0), [-0.5, -0.2, 3.0], atol=1e-8)

    pyvista = pytest.importorskip("pyvista")
    pressed.write(tmp_path / "block.xdmf", solution)
    mesh = pyvista.XdmfReader(tmp_path / "block.xdmf").read()
    mesh = mesh[0] if isinstance(mesh, pyvista.MultiBlock) else mesh
    place = {tuple(np.round(p, 9)): k for k, p in enumerate(np.asarray(mesh.points, dtype=float))}
    of = [place[tuple(np.round(p, 9))] for p in pressed.points]
    assert mesh.n_cells == 10 * 7 * 5
    read = {name: np.asarray(mesh.point_data[name])[of] for name in mesh.point_data}
    np.testing.assert_allclose(read["contact_pressure"], pressed.pressure(solution), rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(read["contact_traction"], pressed.traction(solution), rtol=1e-9, atol=1e-12)
    assert np.array_equal(read["status"], solution.status)


def test_sphere_in_a_hollow_and_on_a_hill():
    """On a round road the sphere's own curvature counts with the road's: 1/R + 1/R_road."""
    for radius in (-30.0, 20.0):
        road = RoundRoad((0, 0, 0), (0, 0, 1), radius)
        body = ball(1, road=road)
        contact = CurvedContact(ContactSolver(body.problem, "multigrid"), body.points)
        solution = contact.solve(road, tolerance=1e-8)
        hertz = HertzSphere(F, 1 / (1 / R + 1 / radius), E, NU)
        assert body.pressure(solution).max() == pytest.approx(hertz.p0, rel=0.03)
        at = body.points + solution.displacement[body.problem.contact_nodes]
        assert np.abs(road.closest(at[solution.status != Status.FREE])[0]).max() <= 1e-12 * R
