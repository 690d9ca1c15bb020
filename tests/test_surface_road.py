"""Obstacles of any shape: surfaces in space and polylines in the plane."""

import pickle

import numpy as np
import pytest

from forms import Elasticity, Isotropic, Support
from geometry import (
    Body,
    LinearRoad,
    Plane,
    PolylineRoad,
    RoundRoad,
    SurfaceRoad,
    box,
    half_cylinder_nested,
    rectangle,
)
from model import BodyOnRoad, ContactSolver
from model.quasistatics.curved_contact import CurvedContact

random = np.random.default_rng(3)
CUBE = np.array([[x, y, z] for z in (0.0, 1) for y in (0.0, 1) for x in (0.0, 1)])
SIDES = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
TRIANGLES = [[side[0], side[k], side[k + 1]] for side in SIDES for k in (1, 2)]


def from_box(points):
    """Signed distance (n,) to the unit cube or square, and the nearest point of its surface."""
    clipped = np.clip(points, 0, 1)
    outside = np.linalg.norm(points - clipped, axis=1)
    depth = np.minimum(points, 1 - points).min(axis=1)
    return np.where(outside > 0, outside, -depth), clipped


@pytest.mark.parametrize("dim", [2, 3])
def test_distances_from_a_box_outside_inside_and_at_its_corners(dim):
    square = PolylineRoad([[0, 0], [1, 0], [1, 1], [0, 1]], closed=True)
    road = square if dim == 2 else SurfaceRoad(CUBE, TRIANGLES)
    points = random.uniform(-1, 2, (500, dim))
    gap, normal, foot = road.closest(points)
    exact, nearest = from_box(points)
    np.testing.assert_allclose(gap, exact, atol=1e-15)
    np.testing.assert_allclose(foot[exact > 0], nearest[exact > 0], atol=1e-15)
    np.testing.assert_allclose(foot + gap[:, None] * normal, points, atol=1e-15)
    gap, normal, _ = road.closest(np.ones((1, dim)))
    assert gap == 0 and normal == pytest.approx(np.full((1, dim), dim**-0.5))


def test_inside_of_a_hole_and_both_ways_round():
    points = random.uniform(0.1, 0.9, (50, 2))
    corners = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    depth = from_box(points)[0]
    for way in (corners, corners[::-1]):
        np.testing.assert_allclose(PolylineRoad(way, closed=True).closest(points)[0], depth)
        np.testing.assert_allclose(PolylineRoad(way, closed=True, inside=True).closest(points)[0], -depth)
    hole = SurfaceRoad(CUBE, TRIANGLES, inside=True)
    points = random.uniform(0.1, 0.9, (50, 3))
    np.testing.assert_allclose(hole.closest(points)[0], -from_box(points)[0])
    np.testing.assert_allclose(pickle.loads(pickle.dumps(hole)).closest(points)[0], -from_box(points)[0])


def test_a_profile_is_a_polyline_and_a_surface():
    x, height = np.sort(random.uniform(0, 10, 40)), random.uniform(0, 0.8, 40)
    points = np.column_stack([random.uniform(1, 9, 300), random.uniform(-0.5, 2, 300)])
    profile, chain = LinearRoad(x, height), PolylineRoad(np.column_stack([x, height]))
    for one, other in zip(profile.closest(points), chain.closest(points)):
        np.testing.assert_allclose(one, other, atol=1e-13)
    places = random.uniform(0, 10, (200, 2))
    surface = LinearRoad(places, random.uniform(0, 0.5, 200))
    a, b, c = surface._surface.points[surface._surface.facets].transpose(1, 0, 2)
    up = np.cross(b - a, c - a)[:, 2] > 0
    facets = np.where(up[:, None], surface._surface.facets, surface._surface.facets[:, ::-1])
    points = np.column_stack([random.uniform(2, 8, (200, 2)), random.uniform(-0.2, 2, 200)])
    for one, other in zip(
        surface.closest(points), SurfaceRoad(surface._surface.points, facets).closest(points)
    ):
        np.testing.assert_allclose(one, other, atol=1e-12)


@pytest.mark.parametrize("binary", [False, True])
def test_an_stl_file(tmp_path, binary):
    meshio = pytest.importorskip("meshio")
    meshio.Mesh(CUBE, [("triangle", np.array(TRIANGLES))]).write(tmp_path / "cube.stl", binary=binary)
    points = random.uniform(-30, 60, (100, 3))
    road = SurfaceRoad.read(tmp_path / "cube.stl", scale=25.4)
    np.testing.assert_allclose(road.closest(points)[0], 25.4 * from_box(points / 25.4)[0], atol=1e-12)


def test_a_block_set_down_beside_a_step_that_hangs_over():
    """Pushed under a ledge and against its wall it stands on the floor, and the wall takes the push."""
    body = Body.from_grid(rectangle(1.0, 1.0, 4, 4))
    elasticity = Elasticity(body, Isotropic(1000.0, 0.3))
    load = elasticity.total_force("top", (1.0, -2.0))
    ledge = PolylineRoad([[-5, 0], [1, 0], [1, 3], [0.2, 3], [0.2, 4], [9, 4]])
    system = elasticity.system(load)
    pressed = BodyOnRoad(system, ["bottom", "right", "top"], ledge)
    solution = CurvedContact(ContactSolver(pressed.problem), pressed.points).solve(ledge)
    np.testing.assert_allclose(solution.contact_force.sum(axis=0), [-1, 2], atol=1e-8)
    assert (
        ledge.closest(pressed.points + solution.displacement[pressed.problem.contact_nodes])[0].min() > -1e-10
    )


def test_hertz_on_a_polygon_of_many_sides_is_hertz_on_a_circle():
    """A half cylinder of radius 10 in a hollow of radius 12, drawn by 4,000 sides."""
    body = Body.from_grid(half_cylinder_nested(10.0, 3))
    elasticity = Elasticity(body, Isotropic(210e3, 0.3))
    support = Support(body).fix_node(body.nearest_node((0.0, 10.0)), x=0.0)
    system = elasticity.system(elasticity.total_force("top", (0.0, -2e3)), support)
    angle = np.linspace(0, 2 * np.pi, 4000, endpoint=False) - np.pi / 2
    hollow = PolylineRoad(12 * np.stack([np.cos(angle), np.sin(angle) + 1], axis=1), closed=True, inside=True)
    peaks = []
    for road in (hollow, RoundRoad((0, 0), (0, 1), -12)):
        pressed = BodyOnRoad(system, "arc", road)
        pressed.problem.gap[:] = np.maximum(pressed.problem.gap, 0)
        solution = CurvedContact(ContactSolver(pressed.problem), pressed.points).solve(road)
        assert solution.contact_force.sum(axis=0) == pytest.approx([0, 2e3], abs=1e-6)
        peaks.append(pressed.pressure(solution).max())
    assert peaks[0] == pytest.approx(peaks[1], rel=2e-3)


def test_a_ball_of_triangles_pressed_into_a_block():
    """The facets of a ball under a plate: the force is the load, and it is on the ball itself."""
    pyvista = pytest.importorskip("pyvista")
    ball = pyvista.Icosphere(radius=2.0, center=(0.0, 0.0, -2.0), nsub=4)
    road = SurfaceRoad(ball.points, ball.regular_faces)
    body = Body.from_grid(box(2.0, 2.0, 1.0, 6, 6, 3, corner=(-1.0, -1.0, 1e-3)))
    elasticity = Elasticity(body, Isotropic(1000.0, 0.3))
    system = Support(body).platen("top").fix("top", x=0.0, y=0.0)
    system = elasticity.system(elasticity.total_force("top", (0.0, 0.0, -5.0)), system)
    pressed = BodyOnRoad(system, "bottom", road, friction=0.3)
    solution = CurvedContact(ContactSolver(pressed.problem), pressed.points).solve(road)
    assert solution.contact_force[:, 2].sum() == pytest.approx(5, rel=1e-6)
    at = pressed.points + solution.displacement[pressed.problem.contact_nodes]
    gap = road.closest(at)[0]
    assert abs(gap[solution.status > 0]).max() < 1e-11 and gap.min() > -1e-11


def test_the_default_plane_is_level_in_any_dimension():
    points = random.uniform(-1, 1, (5, 3))
    for place in (points, points[:, :2]):
        gap, normal, foot = Plane().closest(place)
        np.testing.assert_array_equal(gap, place[:, -1])
        np.testing.assert_array_equal(normal, np.tile(np.eye(place.shape[1])[-1], (5, 1)))
    assert Plane(point=(0, 0, 2)).closest(points)[0] == pytest.approx(points[:, 2] - 2)
    assert RoundRoad(radius=-2.0).closest(points[:, :2])[0].shape == (5,)


@pytest.mark.parametrize(
    "road, points, words",
    [
        (LinearRoad([0.0, 1], [0, 0]), np.zeros((4, 3)), "LinearRoad has 2 dimensions.*ExtrudedRoad"),
        (LinearRoad([[0.0, 0], [1, 0], [0, 1]], [0] * 3), np.zeros((4, 2)), "3 dimensions.*profile"),
        (Plane((0, 0), (1, 1)), np.zeros((4, 3)), "Plane has 2 dimensions"),
        (RoundRoad((0, 0, 0), (0, 0, 1)), np.zeros((4, 2)), "RoundRoad has 3 dimensions"),
        (PolylineRoad([[0, 0], [1, 0]]), np.zeros((4, 3)), "PolylineRoad has 2 dimensions"),
        (SurfaceRoad(CUBE, TRIANGLES), np.zeros((4, 2)), "SurfaceRoad has 3 dimensions"),
    ],
)
def test_roads_say_which_bodies_they_are_for(road, points, words):
    with pytest.raises(ValueError, match=words):
        road.closest(points)


@pytest.mark.parametrize(
    "make, words",
    [
        (lambda: SurfaceRoad(CUBE, [*TRIANGLES[:-1], TRIANGLES[-1][::-1]]), "face different sides"),
        (lambda: SurfaceRoad(CUBE, [[0, 1, 8]]), "points from 0 to 7"),
        (lambda: SurfaceRoad(CUBE, [[0, 1, 1]]), "lines or points"),
        (lambda: SurfaceRoad(CUBE * np.nan, TRIANGLES), "Point 0 of the surface"),
        (lambda: SurfaceRoad(CUBE[:, :2], TRIANGLES), r"\(m, 3\)"),
        (lambda: SurfaceRoad.read("none.stl"), "no file"),
        (lambda: PolylineRoad([[0, 0], [0, 0], [1, 0]]), "Points 0 and 1 .* both at"),
        (lambda: PolylineRoad([[0, 0]]), "2 or more"),
        (lambda: PolylineRoad([[0, 0], [1, 0]], closed=True), "3 or more"),
        (lambda: PolylineRoad([[0, 0], [1, np.inf]]), "Point 1 of the polyline"),
    ],
)
def test_bad_obstacles_are_refused(make, words):
    with pytest.raises(ValueError, match=words):
        make()
