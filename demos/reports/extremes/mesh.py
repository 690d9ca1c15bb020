"""Mesh: flat cells, tiny angles, one single cell, jumps of size, a million unknowns."""

import numpy as np
from harness.verdict import deviation

from forms import Elasticity, Isotropic, Support
from geometry import Body, Grid, Plane, box, half_cylinder, half_cylinder_nested, rectangle
from model import BodyOnRoad, solve
from model.closed_forms.hertz import HertzCylinder

from .collected import CASES
from .scenes import by_least_squares, pressed

FAMILY = "mesh"
CELLS = ["quadrilateral", "triangle"]


def evenly_pressed(grid):
    """Patch test: the block is pressed by its own platen and gets the load's pressure at every node."""
    scene = pressed(grid, Isotropic(1.0, 0.0), force=(0.0, -1e-3 * np.ptp(grid.points[:, 0])))
    solution = solve(scene.problem, "direct", tolerance=1e-12)
    y = scene.system.coordinates[:, 1]
    even = deviation(solution.displacement[:, 1], -1e-3 * y)
    return max(even, deviation(solution.pressure_force, 1e-3 * scene.area)), solution.residual


@CASES.add(
    FAMILY, "{cell}s {aspect:g} times as wide as high", 1e-7, aspect=10.0 ** np.arange(-4, 5), cell=CELLS
)
def aspect_ratio(aspect, cell):
    """Flat and tall cells."""
    return evenly_pressed(rectangle(aspect, 1.0, 6, 6, cell))


@CASES.add(
    FAMILY, "{cell}s, nodes moved by up to {part} of the spacing", 1e-9, part=[0.1, 0.2, 0.3], cell=CELLS
)
def distorted(part, cell):
    """Cells of any shape."""
    return evenly_pressed(rectangle(2.0, 1.0, 8, 4, cell, distortion=part, seed=3))


@CASES.add(FAMILY, "{cell}s with angles of {angle:g} rad", 1e-8, angle=[1e-1, 1e-2, 1e-3, 1e-4], cell=CELLS)
def tiny_angles(angle, cell):
    """Inner nodes slide along x until the cells are slivers."""
    grid = rectangle(2.0, 1.0, 4, 4, cell)
    inner = np.abs(grid.points - [1.0, 0.5]).max(axis=1) < 0.5 + 1e-9
    x = grid.points[:, 0]
    x[:] = np.where(np.abs(x - 1.0) < 0.75, 1.0 + (x - 1.0) * (1.0 if not inner.any() else 4 * angle), x)
    return evenly_pressed(grid)


@CASES.add(FAMILY, "one single {cell}, mu = {mu}", 1e-11, cell=CELLS, mu=[None, 0.3])
def one_cell(cell, mu):
    """The smallest mesh there is."""
    points = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]])
    if cell == "triangle":
        grid = Grid(points[:3], np.array([[0, 1, 2]]), cell, {"bottom": np.array([[0, 1]])})
    else:
        grid = Grid(points, np.array([[0, 1, 2, 3]]), cell, {"bottom": np.array([[0, 1]])})
    body = Body.from_grid(grid)
    elasticity = Elasticity(body, Isotropic(1.0, 0.0))
    load = np.zeros_like(body.coordinates)
    top = body.coordinates[:, 1] == 1.0
    load[top, 1] = -1e-3 / top.sum()
    support = Support(body).fix_node(body.nearest_node((0.0, 0.0)), x=0.0)
    system = elasticity.system(load, support)
    scene = BodyOnRoad(system, "bottom", Plane(), friction=mu)
    solution = solve(scene.problem, "direct", tolerance=1e-12)
    x = body.coordinates[scene.nodes, 0]
    shares = np.array([0.5, 0.5]) if cell == "quadrilateral" else 1.0 - x
    return deviation(solution.pressure_force, 1e-3 * shares, 1e-3), solution.residual


@CASES.add(
    FAMILY, "{cell}s, sizes from 1 to {jump:g} across one column", 1e-9, jump=[10, 1e2, 1e3, 1e4], cell=CELLS
)
def size_jump(jump, cell):
    """A column of small cells right beside large ones."""
    grid = rectangle(2.0, 1.0, 8, 4, cell)
    x = grid.points[:, 0]
    x[:] = np.where(x <= 1.0, x / jump, 1.0 / jump + (x - 1.0))
    return evenly_pressed(grid)


@CASES.add(
    FAMILY, "cylinder, {columns} x {layers}, {cell}s", 1e-9, columns=[4, 8, 16], layers=[2, 8], cell=CELLS
)
def coarse_and_fine(columns, layers, cell):
    """Against least squares."""
    grid = half_cylinder(1.0, columns, layers, 0.02, cell=cell)
    scene = pressed(grid, Isotropic(1.0, 0.3), displacement=(0.0, -0.01), boundary="arc")
    solution = solve(scene.problem, "direct", tolerance=1e-12)
    return deviation(solution.pressure_force, by_least_squares(scene.problem)[0]), solution.residual


@CASES.add(
    FAMILY,
    "{cell}s in space, {aspect:g} times as wide as high",
    1e-9,
    aspect=[1e-2, 1.0, 1e2],
    cell=["hexahedron", "tetrahedron"],
)
def in_space(aspect, cell):
    """The patch test in space."""
    body = Body.from_grid(box(aspect, aspect, 1.0, 3, 3, 3, cell))
    elasticity = Elasticity(body, Isotropic(1.0, 0.0))
    load = elasticity.total_force("top", (0.0, 0.0, -1e-3 * aspect**2))
    system = elasticity.system(load, Support(body).platen("top").fix("top", x=0.0, y=0.0))
    scene = BodyOnRoad(system, "bottom", Plane((0.0,) * 3, (0.0, 0.0, 1.0)))
    solution = solve(scene.problem, "direct", tolerance=1e-12)
    return deviation(scene.pressure(solution), np.full(scene.nodes.size, 1e-3)), solution.residual


@CASES.add(FAMILY, "a million unknowns", 0.01, long=True)
def a_million():
    """Hertz, by multigrid."""
    E, R, P = 210e3, 10.0, 1e4
    body = Body.from_grid(half_cylinder_nested(R), 7)
    elasticity = Elasticity(body, Isotropic(E, 0.3))
    support = Support(body).platen("top").fix("top", x=0.0)
    system = elasticity.system(elasticity.total_force("top", (0.0, -P)), support)
    scene = BodyOnRoad(system, "arc", Plane(), reach=0.3 * R)
    assert scene.problem.b.size > 1_000_000
    solution = solve(scene.problem, "multigrid", tolerance=1e-10)
    return abs(scene.pressure(solution).max() / HertzCylinder(P, R, E, 0.3).p0 - 1), solution.residual


@CASES.add(FAMILY, "folded cell refused", refuses=True)
def folded():
    """A node drawn across its cell."""
    grid = rectangle(1.0, 1.0, 2, 2)
    grid.points[4] = (1.5, 1.5)
    return evenly_pressed(grid)


@CASES.add(FAMILY, "flat cell refused", refuses=True)
def flat():
    """Cells without area."""
    grid = rectangle(1.0, 1.0, 2, 2)
    grid.points[:, 1] = 0.0
    return evenly_pressed(grid)
