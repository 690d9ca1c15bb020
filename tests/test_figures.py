"""The figures say what they are given; what they look like is for the eye."""

import matplotlib.pyplot as plt
import numpy as np
import pytest

from geometry import Body, box, rectangle
from model.figures import figures
from model.figures.figures import body_picture, convergence_figure, mesh_figure, pressure_figure


@pytest.fixture(autouse=True)
def close_figures():
    yield
    plt.close("all")


def test_pressure_figure_has_marks_and_lines():
    x = np.linspace(-3, 3, 25)
    figure = pressure_figure(x, {"computed": 1 - x**2}, {"exact": lambda s: 1 - s**2}, 1.0)
    axes = figure.axes[0]
    assert axes.get_xlabel() == "x (mm)" and axes.get_ylabel() == "stress (MPa)"
    line, marks = axes.lines
    assert np.all(np.abs(marks.get_xdata()) <= 1.5)
    assert np.interp(marks.get_xdata(), *line.get_data()) == pytest.approx(marks.get_ydata(), abs=2e-1)
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ["exact", "computed"]


@pytest.mark.parametrize("order", [1, 2])
def test_order_triangle_has_its_slope_and_stays_below(order):
    h = np.array([0.5, 0.25, 0.125])
    axes = convergence_figure(h, {"a": h**order, "b": 3 * h}, "h (mm)", "error", order, {"floor": 1e-4}).axes[
        0
    ]
    corners = axes.patches[0].get_xy()
    low, high = corners.min(axis=0), corners.max(axis=0)
    rise, run = np.log(high[1] / low[1]), np.log(high[0] / low[0])
    assert rise / run == pytest.approx(order)
    assert high[1] < min(high[0] ** order, 3 * high[0])


def test_mesh_figure_draws_every_cell():
    body = Body.from_grid(rectangle(3, 2, 4, 3))
    figure = mesh_figure(body, centre=(1, 1), width=1)
    for axes in figure.axes:
        polygons = axes.collections[0].get_paths()
        assert len(polygons) == 12
        assert sum(polygon.to_polygons()[0][:-1].shape == (4, 2) for polygon in polygons) == 12
    areas = [abs(_area(polygon.to_polygons()[0])) for polygon in polygons]
    assert sum(areas) == pytest.approx(6)


def _area(corners):
    x, y = corners.T
    return (x[:-1] * y[1:] - x[1:] * y[:-1]).sum() / 2


@pytest.mark.parametrize("grid", [rectangle(3, 2, 4, 3), box(1, 1, 1, 2, 2, 2, "tetrahedron")])
def test_body_picture(grid):
    if figures._no_rendering():
        pytest.skip(figures._no_rendering())
    body = Body.from_grid(grid)
    field = np.arange(len(body.cells))
    figure = body_picture(body, 0 * body.coordinates, field, "cell", (0.5,) * body.dim, 1.0)
    image = figure.axes[0].images[0].get_array()
    assert image.shape == (600, 800, 3) and len(np.unique(image.reshape(-1, 3), axis=0)) > 4
    if body.dim == 2:
        # nine tenths and more of the width are body, and cell colours stand where the cells do
        inside = np.any(image != 255, axis=2)
        assert inside[300].mean() == pytest.approx(1 / 1.05, abs=0.01)


def test_no_picture_without_opengl(monkeypatch, capsys):
    monkeypatch.setattr(figures, "_no_rendering", lambda: "VTK finds no OpenGL")
    assert body_picture(None, None, None, "", (0, 0), 1.0) is None
    assert capsys.readouterr().err == "No picture of the body: VTK finds no OpenGL.\n"
