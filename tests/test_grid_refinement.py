"""Uniform refinement on plain arrays."""

import numpy as np
import pytest

from geometry import Grid, box, rectangle
from geometry.grid import exterior_facets

MESHES = {
    "quadrilateral": lambda: rectangle(
        2.0, 1.0, 3, 2, distortion=0.3, regions={"right": lambda c: c[:, 0] > 1}
    ),
    "triangle": lambda: rectangle(2.0, 1.0, 3, 2, "triangle", distortion=0.3),
    "hexahedron": lambda: box(2.0, 1.0, 1.0, 2, 2, 3, distortion=0.2),
    "tetrahedron": lambda: box(2.0, 1.0, 1.0, 2, 2, 3, "tetrahedron", distortion=0.2),
}


def area(grid, facets):
    corner = grid.points[facets]
    if grid.dim == 2:
        return np.linalg.norm(corner[:, 1] - corner[:, 0], axis=1).sum()
    halves = [[0, 1, 2]] if facets.shape[1] == 3 else [[0, 1, 2], [3, 1, 2]]
    return sum(
        np.linalg.norm(np.cross(corner[:, b] - corner[:, a], corner[:, c] - corner[:, a]), axis=1).sum() / 2
        for a, b, c in halves
    )


@pytest.mark.parametrize("cell", MESHES)
def test_children_fill_their_parents(cell):
    coarse = MESHES[cell]()
    fine, transfer = coarse.refine()
    assert len(fine.cells) == 2**coarse.dim * len(coarse.cells)
    assert len(np.unique(fine.cells)) == len(fine.points) == transfer.shape[0]
    np.testing.assert_allclose(transfer @ coarse.points, fine.points, atol=1e-15)
    np.testing.assert_allclose(transfer.sum(axis=1), 1)
    for name in coarse.facets:
        assert area(fine, fine.facets[name]) == pytest.approx(area(coarse, coarse.facets[name]))
    together = np.sort(np.concatenate(list(fine.facets.values())), axis=1)
    outside = np.sort(exterior_facets(fine), axis=1)
    assert {tuple(row) for row in together} == {tuple(row) for row in outside}


def test_old_nodes_keep_their_numbers():
    coarse = MESHES["hexahedron"]()
    fine, transfer = coarse.refine()
    n = len(coarse.points)
    np.testing.assert_array_equal(fine.points[:n], coarse.points)
    assert (transfer[:n] != np.eye(n)).sum() == 0


def test_regions_pass_on():
    fine, _ = MESHES["quadrilateral"]().refine()
    coarse = MESHES["quadrilateral"]()
    right = np.zeros(len(coarse.cells), dtype=bool)
    right[coarse.regions["right"]] = True
    np.testing.assert_array_equal(np.flatnonzero(np.repeat(right, 4)), fine.regions["right"])


@pytest.mark.parametrize("cell", ["tetrahedron", "triangle"])
def test_repeated_refinement_does_not_degenerate(cell):
    grid = MESHES[cell]()

    def worst(grid):
        corner = grid.points[grid.cells]
        volume = np.abs(np.linalg.det(corner[:, 1:] - corner[:, :1]))
        longest = np.linalg.norm(corner[:, :, None] - corner[:, None], axis=-1).max(axis=(1, 2))
        return (volume / longest**grid.dim).min()

    start = worst(grid)
    for _ in range(3):
        grid, _ = grid.refine()
    assert worst(grid) > start / 4


@pytest.mark.parametrize("how", ["halved", "crossed"])
def test_quadrilaterals_cut_into_triangles_cover_the_same(how):
    grid = MESHES["quadrilateral"]()
    cut = grid.halved() if how == "halved" else grid.crossed()[0]
    corner = cut.points[cut.cells]
    assert (np.abs(np.linalg.det(corner[:, 1:] - corner[:, :1])) / 2).sum() == pytest.approx(2.0)
    with pytest.raises(ValueError, match="Only quadrilaterals"):
        cut.crossed()


def test_new_nodes_land_on_the_snapped_boundary_only():
    def lift(points):
        return points + [0.0, 0.01]

    plain = rectangle(1.0, 1.0, 2, 2)
    lifted = Grid(plain.points, plain.cells, plain.cell, plain.facets, snap={"top": lift}).refine()[0]
    moved = np.flatnonzero(np.any(lifted.points != plain.refine()[0].points, axis=1))
    assert len(moved) == 2
    np.testing.assert_allclose(lifted.points[moved, 1], 1.01)
