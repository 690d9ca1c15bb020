"""Roads drawn for ParaView: every vertex lies on the road, whatever its shape, and VTK reads it."""

import numpy as np
import pytest

from geometry import ExtrudedRoad, LinearRoad, MovingRoad, Plane, RoundRoad, SmoothRoad
from model.results.road_surface import road_surface, write_road

pyvista = pytest.importorskip("pyvista")

SQUARE = np.array([[-1.0, 0.1], [1.0, 0.1], [-1.0, 1.0], [1.0, 1.0]])
CUBE = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (0.1, 1.0)])
x = np.linspace(-3, 3, 61)
ROADS = {
    "plane": (Plane(), SQUARE),
    "wall": (Plane((1.1, 0.0), (-1.0, 0.0)), SQUARE),
    "tilted": (Plane((0.0, 0.0), (0.3, 1.0)), SQUARE),
    "groove": (LinearRoad([-1.0, 0.0, 1.0], [1.0, 0.0, 1.0]), SQUARE / 2 + [0, 0.6]),
    "rough": (LinearRoad(x, 0.1 * np.sin(5 * x)), SQUARE),
    "smooth": (SmoothRoad(lambda x: 0.1 * np.sin(5 * x), x), SQUARE),
    "hole": (RoundRoad((0.0, -1.1), (0.0, 1.0), -1.6), SQUARE),
    "plane in space": (Plane((0.0, 0.0, 0.0), (0.0, 0.0, 1.0)), CUBE),
    "waves in space": (ExtrudedRoad(LinearRoad(x, 0.1 * np.sin(5 * x))), CUBE),
    "a ball's bowl": (RoundRoad((0.0, 0.0, -1.4), (0.0, 0.0, 1.0), -1.9), CUBE),
}


@pytest.mark.parametrize("name", ROADS)
def test_vertices_lie_on_the_road(name):
    road, around = ROADS[name]
    surface = road_surface(road, around)
    gap, normal, foot = road.closest(surface.points)
    assert np.abs(gap).max() < 1e-12
    assert np.allclose(np.linalg.norm(surface.normal, axis=1), 1.0)
    # the road nearest to each given point is drawn, within a cell of the grid
    nearest = road.closest(around)[2]
    apart = np.linalg.norm(surface.points[None] - nearest[:, None], axis=2).min(axis=1)
    assert apart.max() < 0.12


def test_the_length_of_what_is_drawn():
    turn = np.linspace(0, 2 * np.pi, 50)
    inside = np.column_stack([np.cos(turn), 0.5 + np.sin(turn)])
    for road, around, length in [(*ROADS["plane"], 2.4), (ROADS["hole"][0], inside, 2 * np.pi * 1.6)]:
        surface = road_surface(road, around)
        ends = surface.points[surface.facets]
        assert np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).sum() == pytest.approx(length, rel=1e-3)


def test_what_does_not_show_is_refused():
    with pytest.raises(ValueError, match=r"points \(n, 2\) or \(n, 3\), all finite"):
        road_surface(Plane(), np.array([[np.nan, 0.0]]))
    with pytest.raises(ValueError, match="all finite, not"):
        road_surface(Plane(), np.zeros(3))


@pytest.mark.parametrize("name", ["rough", "waves in space"])
def test_vtk_reads_the_road(tmp_path, name):
    road, around = ROADS[name]
    write_road(tmp_path / "road.xdmf", road, around)
    grid = pyvista.read(tmp_path / "road.xdmf")
    surface = road_surface(road, around)
    dim = around.shape[1]
    assert grid.n_cells == len(surface.facets)
    assert np.allclose(grid["height"], grid.points[:, dim - 1])
    assert np.allclose(
        grid["normal"][:, :dim], road.closest(np.asarray(grid.points[:, :dim], dtype=float))[1], atol=1e-5
    )


def test_a_moving_road_is_a_series(tmp_path):
    write_road(
        tmp_path / "road.xdmf", MovingRoad(ROADS["rough"][0], (2.0, 0.0)), SQUARE, times=[0.0, 0.5, 1.0]
    )
    reader = pyvista.get_reader(tmp_path / "road.xdmf")
    assert reader.time_values == [0.0, 0.5, 1.0]
    reader.set_active_time_value(1.0)
    assert np.allclose(reader.read()["displacement"], [2.0, 0.0, 0.0])
