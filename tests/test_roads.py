"""Rigid roads."""

import numpy as np
import pytest

from geometry import Plane


@pytest.mark.parametrize("dim", [2, 3])
def test_plane_splits_points_into_foot_and_gap(dim):
    random = np.random.default_rng(1)
    point, normal, points = random.normal(size=dim), random.normal(size=dim), random.normal(size=(20, dim))
    road = Plane(point, 7.3 * normal)
    gap, unit, foot = road.closest(points)
    np.testing.assert_allclose(np.linalg.norm(unit, axis=1), 1)
    np.testing.assert_allclose(foot + gap[:, None] * unit, points)
    np.testing.assert_allclose((foot - point) @ normal, 0, atol=1e-13)
    np.testing.assert_allclose(gap, (points - point) @ normal / np.linalg.norm(normal))


@pytest.mark.parametrize("size", [1e-300, 1e300])
def test_length_of_the_normal_does_not_matter(size):
    np.testing.assert_allclose(Plane((0, 0), (0, size)).normal, [0, 1])


@pytest.mark.parametrize(
    "point, normal, words",
    [
        ((0, 0), (0, 0), "must not be zero"),
        ((0, 0), (0, np.nan), "finite"),
        ((0, np.inf), (0, 1), "finite"),
        ((0, 0, 0), (0, 1), "both"),
        ((0,), (1,), "2 or 3"),
    ],
)
def test_bad_planes_are_refused(point, normal, words):
    with pytest.raises(ValueError, match=words):
        Plane(point, normal)
