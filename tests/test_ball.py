"""The half ball: nested hexahedra, none of them badly shaped, on the sphere to the last digit."""

import numpy as np
import pytest

from geometry import Body, half_ball
from geometry.body import CORNER_EDGES

PARTS = {"quarter": 1, "half": 2, "whole": 4}


def shapes(grid):
    """Smallest scaled Jacobian and largest ratio of edges over all corners of all cells."""
    corners = grid.points[grid.cells][:, CORNER_EDGES["hexahedron"]]
    edges = corners[:, :, 1:] - corners[:, :, :1]
    lengths = np.linalg.norm(edges, axis=3)
    scaled = np.linalg.det(edges) / lengths.prod(axis=2)
    return scaled.min(), (lengths.max(axis=(1, 2)) / lengths.min(axis=(1, 2))).max()


@pytest.mark.parametrize("inner", [0.02, 0.1, 0.4])
def test_cells_keep_their_shape_under_refinement(inner):
    for refinements in range(3):
        jacobian, aspect = shapes(half_ball(1.0, "quarter", refinements, inner))
        assert jacobian > 0.65
        assert aspect < 3


@pytest.mark.parametrize("part", PARTS)
def test_parts_of_the_ball(part):
    radius = 10.0
    grid = half_ball(radius, part, refinements=2)
    body = Body.from_grid(half_ball(radius, part), refinements=2)
    assert len(grid.cells) == len(body.cells) == 80 * PARTS[part] * 64
    assert (
        set(body.names) == {"sphere", "top"} | {"quarter": {"x0", "y0"}, "half": {"y0"}, "whole": set()}[part]
    )
    on = body.coordinates[body.nodes("sphere")]
    np.testing.assert_allclose(np.linalg.norm(on - [0, 0, radius], axis=1), radius, rtol=1e-15)
    assert np.all(on[:, 2] >= 0)
    near = on[:, 2] < 0.01 * radius
    height = np.sum(on[near, :2] ** 2, axis=1) / (
        radius + np.sqrt(radius**2 - np.sum(on[near, :2] ** 2, axis=1))
    )
    np.testing.assert_allclose(on[near, 2], height, rtol=1e-14)
    assert np.all(body.coordinates[body.nodes("top"), 2] == radius)
    for name, axis in (("x0", 0), ("y0", 1)):
        if name in body.names:
            assert np.all(body.coordinates[body.nodes(name), axis] == 0)


def test_the_whole_is_its_own_mirror_image_to_the_last_bit():
    points = half_ball(3.0, "whole").points
    for mirror in ([-1, 1, 1], [1, -1, 1]):
        mirrored = points * mirror + 0.0
        assert {tuple(p) for p in mirrored} == {tuple(p) for p in points}


def test_every_facet_on_the_sphere_has_a_cell_of_its_own():
    grid = half_ball(1.0)
    on = np.isin(grid.cells, np.unique(grid.facets["sphere"]))
    assert on.sum(axis=1).max() == 4  # no cell has two faces on the sphere
    assert np.sum(on.sum(axis=1) == 4) == len(grid.facets["sphere"])


@pytest.mark.parametrize(
    "options, words",
    [
        ({"radius": 0}, "radius is 0"),
        ({"radius": np.nan}, "radius is nan"),
        ({"radius": 1, "part": "third"}, "one of 'quarter', 'half', 'whole'"),
        ({"radius": 1, "inner_half_width": 2}, "less than the radius, 1"),
    ],
)
def test_bad_balls_are_refused(options, words):
    with pytest.raises(ValueError, match=words):
        half_ball(**options)
