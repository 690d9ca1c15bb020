"""Roads that are not flat: nearest points, gaps and normals."""

import numpy as np
import pytest

from geometry import ExtrudedRoad, LinearRoad, MovingRoad, Plane, RoundRoad, ShiftedRoad, SmoothRoad

random = np.random.default_rng(5)


def check(road, points, exact=1e-13):
    """Point = closest point + gap normal; the closest point is on the road, with the same normal."""
    gap, normal, foot = road.closest(points)
    np.testing.assert_allclose(np.linalg.norm(normal, axis=1), 1)
    np.testing.assert_allclose(foot + gap[:, None] * normal, points, atol=exact)
    np.testing.assert_allclose(road.closest(foot)[0], 0, atol=1e-13)
    return gap, normal, foot


def lattice(low, high, count):
    line = np.linspace(low, high, count)
    return np.stack(np.meshgrid(line, line, indexing="ij"), axis=-1).reshape(-1, 2)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("radius", [3.0, -3.0, 1e9, -1e9])
def test_round_roads(dim, radius):
    normal = random.normal(size=dim)
    road = RoundRoad(random.normal(size=dim), normal, radius)
    points = road.point + random.uniform(-1, 1, (50, dim))
    gap, normal, foot = check(road, points)
    centre = road.point - radius * road.normal
    np.testing.assert_allclose(np.linalg.norm(foot - centre, axis=1), abs(radius))
    if abs(radius) < 10:
        distance = np.linalg.norm(points - centre, axis=1)
        np.testing.assert_allclose(gap, np.sign(radius) * (distance - abs(radius)), atol=1e-14)
    else:
        np.testing.assert_allclose(gap, (points - road.point) @ road.normal, atol=1e-8)


def test_the_centre_of_a_hollow_has_a_nearest_point():
    gap, normal, foot = RoundRoad((0, 0), (0, 1), -2).closest(np.array([[0.0, 2.0]]))
    assert gap[0] == 2 and foot[0] == pytest.approx([0, 0]) and normal[0] == pytest.approx([0, 1])


def test_linear_profile_against_all_segments():
    x, height = np.sort(random.uniform(0, 10, 60)), random.uniform(0, 0.8, 60)
    shuffled = random.permutation(60)
    road = LinearRoad(x[shuffled], height[shuffled])
    points = np.column_stack([random.uniform(-1, 11, 400), random.uniform(-1, 3, 400)])
    gap, _, _ = check(road, points, 1e-12)
    x, height = np.concatenate([[-99], x, [99]]), np.concatenate([height[:1], height, height[-1:]])
    a, b = np.stack([x[:-1], height[:-1]], axis=1), np.stack([x[1:], height[1:]], axis=1)
    t = np.clip(np.sum((points[:, None] - a) * (b - a), axis=2) / np.sum((b - a) ** 2, axis=1), 0, 1)
    distance = np.linalg.norm(points[:, None] - a - t[:, :, None] * (b - a), axis=2).min(axis=1)
    np.testing.assert_allclose(np.abs(gap), distance, atol=1e-12)
    above = points[:, 1] > np.interp(points[:, 0], x, height)
    assert np.array_equal(gap > 0, above)


def test_linear_surface_against_points_on_its_triangles():
    road = LinearRoad(random.uniform(0, 10, (300, 2)), random.uniform(0, 0.5, 300))
    points = np.column_stack([random.uniform(1, 9, (200, 2)), random.uniform(-1, 2, 200)])
    gap, _, _ = check(road, points)
    surface = road._surface
    weights = random.dirichlet((1, 1, 1), 300)
    dense = np.einsum("wk,tka->twa", weights, surface.points[surface.facets]).reshape(-1, 3)
    distance = [np.linalg.norm(dense - p, axis=1).min() for p in points]
    assert np.all(distance >= np.abs(gap) - 1e-12)
    assert np.median(distance - np.abs(gap)) < 0.01


@pytest.mark.parametrize("offset", [0.0, 1e-9, 1.0, -1e-9])
def test_a_flat_profile_is_the_plane_to_the_last_digit(offset):
    x = np.array([-3.0, -1.1, 0.0, 0.2, 4.0])
    points = np.stack([np.linspace(-2.5, 3.5, 61), np.full(61, offset)], axis=1)
    for road in (LinearRoad(x, 0 * x), SmoothRoad.through(x, 0 * x)):
        for flat, plane in zip(road.closest(points), Plane().closest(points)):
            np.testing.assert_allclose(flat, plane, atol=1e-15)
    places = lattice(-3, 3, 8)
    points = np.column_stack([places[places.max(axis=1) < 2.9], np.full(49, offset)])
    surface = LinearRoad(places, 0 * places[:, 0])
    for flat, plane in zip(surface.closest(points), Plane((0, 0, 0), (0, 0, 1)).closest(points)):
        np.testing.assert_allclose(flat, plane, atol=1e-15)


def test_corners():
    """Above a peak and below a hollow the corner is nearest, its normal anywhere between the slopes'."""
    peak = LinearRoad([-1.0, 0, 1], [-1.0, 0, -1])
    gap, normal, foot = peak.closest(np.array([[0.0, 1], [0.5, 1], [-0.2, 0.5], [0, 0], [0, -0.5]]))
    np.testing.assert_allclose(foot[:4], 0, atol=1e-15)
    np.testing.assert_allclose(normal[:2], [[0, 1], [0.5 / np.sqrt(1.25), 1 / np.sqrt(1.25)]])
    np.testing.assert_allclose(normal[3], [0, 1])
    assert gap[3] == 0 and gap[4] == pytest.approx(-0.5 / np.sqrt(2))
    hollow = LinearRoad([-1.0, 0, 1], [1.0, 0, 1])
    gap, normal, foot = hollow.closest(np.array([[0.0, -1], [0.3, -1], [0, 0]]))
    np.testing.assert_allclose(foot, 0, atol=1e-15)
    np.testing.assert_allclose(normal[1], [-0.3 / np.sqrt(1.09), 1 / np.sqrt(1.09)])
    assert gap[0] == -1
    np.testing.assert_allclose(normal[2], [0, 1])


def wavy(x):
    return 0.3 * np.sin(3 * x) + 0.1 * np.cos(7 * x)


def test_smooth_profile_with_and_without_its_slope():
    points = np.column_stack(
        [random.uniform(0, 10, 300), wavy(random.uniform(0, 10, 300)) + random.uniform(0, 0.1, 300)]
    )
    x = np.linspace(-1, 11, 400)
    plain = SmoothRoad(wavy, x)
    with_slope = SmoothRoad(wavy, x, lambda x: 0.9 * np.cos(3 * x) - 0.7 * np.sin(7 * x))
    gap, normal, foot = check(plain, points, 1e-8)
    np.testing.assert_allclose(foot[:, 1], wavy(foot[:, 0]), atol=1e-15)
    fine = np.linspace(-1, 11, 200_001)
    distance = [np.hypot(fine - a, wavy(fine) - b).min() for a, b in points]
    np.testing.assert_allclose(np.abs(gap), distance, atol=1e-6)
    near = np.abs(gap) < 0.05
    for one, other in zip(plain.closest(points[near]), with_slope.closest(points[near])):
        np.testing.assert_allclose(one, other, atol=1e-9)


def test_smooth_surface_is_the_sphere_that_it_describes():
    places = lattice(-3, 3, 40)
    points = np.column_stack([random.uniform(-2, 2, (100, 2)), random.uniform(-0.5, 0.5, 100)])
    hill = RoundRoad((0, 0, 0), (0, 0, 1), 5)
    smooth = SmoothRoad(lambda x, y: np.sqrt(25 - x**2 - y**2) - 5, places)
    for one, other in zip(smooth.closest(points), hill.closest(points)):
        np.testing.assert_allclose(one, other, atol=1e-8)
    drawn = SmoothRoad.through(places, np.sqrt(25 - np.sum(places**2, axis=1)) - 5)
    np.testing.assert_allclose(drawn.closest(points)[0], hill.closest(points)[0], atol=1e-5)


def test_a_smooth_road_passes_through_its_samples():
    x, height = np.sort(random.uniform(0, 10, 40)), random.uniform(0, 0.3, 40)
    road = SmoothRoad.through(x, height)
    gap, _, _ = road.closest(np.stack([x, height], axis=1))
    np.testing.assert_allclose(gap, 0, atol=1e-15)


def test_roads_from_roads():
    profile = LinearRoad([-1.0, 0, 1], [0.0, 0.5, 0.0])
    points = random.uniform(-1, 1, (30, 2))
    moving = MovingRoad(profile, (2.0, 0.5))
    np.testing.assert_allclose(moving.displacement(3.0), [6, 1.5])
    for moved, still in zip(moving.at(3.0).closest(points + [6, 1.5])[:2], profile.closest(points)[:2]):
        np.testing.assert_allclose(moved, still, atol=1e-14)
    assert isinstance(moving.at(0.0), ShiftedRoad)
    gap, normal, foot = profile.closest(points)
    deep = np.insert(points, 1, 7.0, axis=1)
    gap_3d, normal_3d, foot_3d = ExtrudedRoad(profile).closest(deep)
    assert np.array_equal(gap, gap_3d)
    assert np.array_equal(normal, normal_3d[:, [0, 2]]) and np.all(normal_3d[:, 1] == 0)
    assert np.array_equal(foot, foot_3d[:, [0, 2]]) and np.all(foot_3d[:, 1] == 7)


@pytest.mark.parametrize(
    "make, words",
    [
        (lambda: RoundRoad((0, 0), (0, 1), 0), "radius is 0"),
        (lambda: RoundRoad((0, 0), (0, 1), np.inf), "radius is inf"),
        (lambda: RoundRoad((0, 0), (0, 0), 1), "must not be zero"),
        (lambda: LinearRoad([0, 1, 2], [0, np.nan, 1]), "Sample 1 of the road, height nan"),
        (lambda: LinearRoad([0, 1, 0], [0, 1, 2]), "Samples 0 and 2 of the road are both at"),
        (lambda: LinearRoad([0], [0]), "1 samples; it needs 2"),
        (lambda: LinearRoad([0, 1], [0]), "shape"),
        (lambda: LinearRoad([[0, 0], [1, 1], [2, 2]], [0, 0, 0]), "in a line"),
        (lambda: SmoothRoad(lambda x: 1 / x, [0.0, 1, 2]), "not finite"),
        (lambda: SmoothRoad.through(random.uniform(size=(20, 2)), np.zeros(20)), "use LinearRoad"),
        (lambda: MovingRoad(Plane(), (1, np.nan)), "velocity"),
    ],
)
def test_bad_roads_are_refused(make, words):
    with np.errstate(divide="ignore"), pytest.raises(ValueError, match=words):
        make()
