"""The half cylinder in its three meshes, the ring, rectangles: exact and well shaped."""

import numpy as np
import pytest

from geometry import Body, box, half_cylinder, half_cylinder_gmsh, half_cylinder_nested, rectangle, ring


def corners(grid):
    """Corners of each cell in turn around it."""
    return grid.points[grid.cells[:, [0, 1, 3, 2] if grid.cells.shape[1] == 4 else [0, 1, 2]]]


def angles(grid):
    corner = corners(grid)
    edge = np.roll(corner, -1, axis=1) - corner
    back = -np.roll(edge, 1, axis=1)
    cosine = (edge * back).sum(axis=2) / np.linalg.norm(edge, axis=2) / np.linalg.norm(back, axis=2)
    return np.degrees(np.arccos(np.clip(cosine, -1, 1)))


def aspect_ratio(grid):
    corner = corners(grid)
    length = np.linalg.norm(np.roll(corner, -1, axis=1) - corner, axis=2)
    return (length.max(axis=1) / length.min(axis=1)).max()


def sorted_rows(points):
    return points[np.lexsort(points.T)]


def test_structured_half_cylinder_is_the_papers():
    grid = half_cylinder(10.0)
    assert len(grid.cells) == 760
    arc = grid.points[np.unique(grid.facets["arc"])]
    np.testing.assert_allclose(np.hypot(arc[:, 0], arc[:, 1] - 10), 10, rtol=1e-14)
    under = np.sort(arc[np.abs(arc[:, 0]) < 0.85, 0])
    np.testing.assert_allclose(np.diff(under), 0.073, rtol=0.01)
    assert np.sum(np.all(grid.points == 0, axis=1)) == 1
    assert grid.points[:, 1].min() == 0
    np.testing.assert_array_equal(sorted_rows(grid.points), sorted_rows(grid.points * [-1, 1] + 0.0))
    np.testing.assert_array_equal(grid.points[np.unique(grid.facets["top"]), 1], 10.0)


@pytest.mark.parametrize("inner", [0.01, 0.1, 1.0, 5.0])
@pytest.mark.parametrize("refinements", [0, 1, 3])
def test_nested_half_cylinder_is_well_shaped(inner, refinements):
    grid = half_cylinder_nested(10.0, refinements, inner)
    assert aspect_ratio(grid) < 2.5
    assert angles(grid).min() > 50 and angles(grid).max() < 135
    arc = grid.points[np.unique(grid.facets["arc"])]
    np.testing.assert_allclose(np.hypot(arc[:, 0], arc[:, 1] - 10), 10, rtol=1e-14)
    assert np.sum(np.all(grid.points == 0, axis=1)) == 1
    assert grid.points[:, 1].min() == 0


def test_boundary_nodes_of_the_nested_half_cylinder_meet_two_cells():
    grid = half_cylinder_nested(10.0)
    assert len(grid.cells) == 56
    meets = np.bincount(grid.cells.ravel())
    boundary = np.unique(np.concatenate(list(grid.facets.values())))
    single = boundary[meets[boundary] == 1]
    np.testing.assert_allclose(sorted_rows(grid.points[single]), [[-10, 10], [10, 10]])
    assert set(meets[boundary]) == {1, 2}


def test_heights_near_the_lowest_point_are_right_to_the_last_digits():
    grid = half_cylinder_nested(10.0, 6)
    x, y = grid.points[np.unique(grid.facets["arc"])].T
    near = (np.abs(x) < 0.1) & (x != 0)
    np.testing.assert_allclose(y[near], x[near] ** 2 / (10 + np.sqrt(100 - x[near] ** 2)), rtol=1e-12)


def test_ring():
    coarse = ring(0.5, 0.2, 24, 3, lowest=(0.0, 0.5))
    np.testing.assert_array_equal(coarse.points[0], [0.0, 0.5])
    np.testing.assert_array_equal(sorted_rows(coarse.points), sorted_rows(coarse.points * [-1, 1] + 0.0))
    grid, _ = coarse.refine()
    for name, radius in {"outer": 0.5, "inner": 0.2}.items():
        x, y = grid.points[np.unique(grid.facets[name])].T
        np.testing.assert_allclose(np.hypot(x, y - 1), radius, rtol=1e-14)
    assert len(grid.cells) == 4 * 24 * 3 and aspect_ratio(grid) < 3


@pytest.mark.parametrize("cell", ["quadrilateral", "triangle"])
def test_gmsh_half_cylinder(cell):
    pytest.importorskip("gmsh")
    grid = half_cylinder_gmsh(10.0, spacing=0.2, cell=cell)
    assert grid.cell == cell and set(grid.facets) == {"arc", "top"}
    assert np.sum(np.all(grid.points == 0, axis=1)) == 1
    x, y = grid.points[np.unique(grid.facets["arc"])].T
    np.testing.assert_allclose(np.hypot(x, y - 10), 10, rtol=1e-14)
    near = np.sort(x[np.abs(x) < 0.8])
    assert np.diff(near).max() < 0.3
    body = Body.from_grid(grid, 1)
    assert body.prolongations[0].shape == (len(body.coordinates), len(grid.points))


def test_rectangles_and_boxes_have_their_sides():
    body = Body.from_grid(box(3.0, 2.0, 1.0, 3, 2, 4, corner=(1, 1, 1), distortion=0.2))
    for axis, sides in enumerate([("left", "right"), ("front", "back"), ("bottom", "top")]):
        for name, place in zip(sides, (1, 1 + (3, 2, 1)[axis])):
            np.testing.assert_allclose(body.coordinates[body.nodes(name), axis], place)
    tri = rectangle(1.0, 1.0, 4, 4, "triangle", distortion=0.4, seed=3)
    assert len(tri.cells) == 32 and Body.from_grid(tri).nodes("bottom").size == 5


@pytest.mark.parametrize(
    "make, words",
    [
        (lambda: half_cylinder(-1.0), "radius is -1.0"),
        (lambda: half_cylinder(np.nan), "radius is nan"),
        (lambda: half_cylinder(10.0, columns=41), "41 columns"),
        (lambda: half_cylinder(10.0, spacing=1.0), "spacing 1 must"),
        (
            lambda: half_cylinder(10.0, columns=60),
            "60 columns are too many .* at most 56",
        ),
        (lambda: half_cylinder(10.0, layers=200), "200 cells"),
        (lambda: half_cylinder(10.0, cell="pentagon"), "'pentagon'"),
        (lambda: half_cylinder_nested(10.0, inner_half_width=11.0), "half_width is 11.0"),
        (lambda: ring(0.2, 0.5), "0.2 and 0.5"),
        (lambda: ring(0.5, 0.2, around=7), "7 x 5"),
        (lambda: rectangle(0.0, 1.0, 2, 2), "width is 0.0"),
        (lambda: rectangle(1.0, 1.0, 0, 2), "columns is 0; it must be a whole number"),
        (lambda: rectangle(1.0, 1.0, 2, 2, distortion=0.7), "0.7"),
        (lambda: rectangle(1.0, 1.0, 2, 2, "hexahedron"), "'hexahedron'"),
        (lambda: half_cylinder_gmsh(-2.0), "radius is -2.0"),
    ],
)
def test_bad_sizes_are_refused_in_one_sentence(make, words):
    with pytest.raises(ValueError, match=words) as refusal:
        make()
    assert str(refusal.value).endswith(".") and "\n" not in str(refusal.value)
