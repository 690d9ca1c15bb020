"""Everyday bodies of about the size 1, each meshed once: where they may touch, and where they can be held."""

import tempfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np

from geometry import (
    Body,
    Grid,
    box,
    half_ball,
    half_cylinder,
    half_cylinder_gmsh,
    half_cylinder_nested,
    read_msh,
    rectangle,
    ring,
)
from geometry.grid import LOCAL_FACETS


@dataclass(frozen=True)
class Shape:
    """How to mesh a body.

    Attributes
    ----------
    grid : callable
        Makes the mesh.
    touching : tuple of str
        Boundaries that may touch a road.
    held : str
        Boundary that supports and loads take hold of.
    refinements : int
        How often the mesh is refined.
    symmetric : bool
        The body is cut at x = 0 and y = 0 and slides along both planes.
    """

    grid: Callable[[], Grid]
    touching: tuple[str, ...]
    held: str = "top"
    refinements: int = 0
    symmetric: bool = False


def carved(columns: int, rows: int, keep: Callable[[np.ndarray], np.ndarray], width: float = 1.0) -> Grid:
    """What is left of a rectangle of height 1; all of its boundary but the highest part is called "skin"."""
    grid = rectangle(width, 1.0, columns, rows)
    kept = keep(grid.points[grid.cells].mean(axis=1) / [width, 1.0])
    used, cells = np.unique(grid.cells[kept], return_inverse=True)
    cells = cells.reshape(-1, 4)
    edges = cells[:, LOCAL_FACETS["quadrilateral"]].reshape(-1, 2)
    _, number, count = np.unique(np.sort(edges, axis=1), axis=0, return_inverse=True, return_counts=True)
    outer = edges[count[number.ravel()] == 1]
    points = grid.points[used]
    high = (points[outer, 1] > 1.0 - 1e-9).all(axis=1)
    return Grid(points, cells, "quadrilateral", {"top": outer[high], "skin": outer[~high]})


def lump() -> Grid:
    """A ball of tetrahedra by gmsh, its upper cap cut off; "top" is where it was."""
    import gmsh

    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        occ = gmsh.model.occ
        ball, slab = occ.addSphere(0.0, 0.0, 0.5, 0.5), occ.addBox(-1.0, -1.0, 0.7, 2.0, 2.0, 1.0)
        occ.cut([(3, ball)], [(3, slab)])
        occ.synchronize()
        faces = [tag for _, tag in gmsh.model.getEntities(2)]
        flat = [tag for tag in faces if abs(occ.getCenterOfMass(2, tag)[2] - 0.7) < 1e-6]
        for name, tags in (("top", flat), ("skin", [tag for tag in faces if tag not in flat])):
            gmsh.model.addPhysicalGroup(2, tags, name=name)
        gmsh.model.addPhysicalGroup(3, [tag for _, tag in gmsh.model.getEntities(3)], name="lump")
        gmsh.option.setNumber("Mesh.MeshSizeMax", 0.3)
        gmsh.model.mesh.generate(3)
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "lump.msh"
            gmsh.write(str(path))
            gmsh.finalize()
            return read_msh(path)
    finally:
        if gmsh.isInitialized():
            gmsh.finalize()


SIDES = ("bottom", "left", "right")
PLANE = {
    "square": Shape(lambda: rectangle(1.0, 1.0, 6, 5), SIDES),
    "flat block": Shape(lambda: rectangle(1.0, 0.3, 10, 3), SIDES),
    "tower": Shape(lambda: rectangle(0.3, 1.0, 3, 8, "triangle", distortion=0.2), SIDES),
    "nested block": Shape(lambda: rectangle(1.0, 0.5, 3, 2), SIDES, refinements=2),
    "ring": Shape(lambda: ring(0.5, 0.35, 20, 2), ("outer",), "inner"),
    "thin ring": Shape(lambda: ring(0.5, 0.47, 36, 1), ("outer",), "inner"),
    "nested ring": Shape(lambda: ring(0.5, 0.3, 8, 1), ("outer",), "inner", 2),
    "half cylinder": Shape(lambda: half_cylinder(0.5, 16, 6, 0.01), ("arc",)),
    "nested half cylinder": Shape(lambda: half_cylinder_nested(0.5), ("arc",), refinements=1),
    "half cylinder by gmsh": Shape(lambda: half_cylinder_gmsh(0.5, 0.04, 0.15, cell="triangle"), ("arc",)),
    "L": Shape(lambda: carved(6, 6, lambda x: (x[:, 0] < 0.5) | (x[:, 1] > 0.66)), ("skin",)),
    "boot": Shape(lambda: carved(6, 6, lambda x: (x[:, 0] < 0.34) | (x[:, 1] < 0.34)), ("skin",)),
    "frame": Shape(lambda: carved(10, 5, lambda x: (abs(x[:, 0] - 0.5) > 0.3) | (x[:, 1] > 0.6)), ("skin",)),
}
SPACE = {
    "cube": Shape(lambda: box(1.0, 1.0, 1.0, 3, 3, 3), ("bottom", "left", "right")),
    "tetrahedra": Shape(lambda: box(1.0, 0.8, 0.6, 3, 3, 2, "tetrahedron", distortion=0.2), SIDES),
    "lump by gmsh": Shape(lump, ("skin",)),
    "quarter ball": Shape(lambda: half_ball(0.5, "quarter"), ("sphere",), symmetric=True),
}
SHAPES = PLANE | SPACE


@cache
def meshed(name: str, size: float) -> Body:
    """Return the body of a shape, enlarged to a size."""
    shape = SHAPES[name]
    grid = shape.grid()
    snap = {part: lambda x, onto=onto: size * onto(x / size) for part, onto in grid.snap.items()}
    return Body.from_grid(replace(grid, points=size * grid.points, snap=snap), shape.refinements)
