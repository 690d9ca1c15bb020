"""The half cylinder meshed by gmsh, graded by a size field."""

from __future__ import annotations

import numpy as np

from checks import one_of, positive
from geometry.grid import Grid
from geometry.meshes.circle import SPACING, onto_circle
from geometry.meshes.gmsh_file import gmsh_mesh, gmsh_session

FRONTAL_QUADS, FULL_QUADS = 8, 3  # gmsh's numbers of its algorithms


def half_cylinder_gmsh(
    radius: float,
    spacing: float | None = None,
    largest: float | None = None,
    contact_half_width: float | None = None,
    cell: str = "quadrilateral",
) -> Grid:
    """Half cylinder meshed by gmsh, with the boundaries "arc" and "top", its lowest point a node at (0, 0).

    Parameters
    ----------
    radius : of the cylinder; its centre is (0, radius)
    spacing : size of the cells within `contact_half_width` of the lowest point; default 0.0073 radius
    largest : size of the cells two radii away, reached linearly; default 0.2 radius
    contact_half_width : default 0.1 radius
    cell : "quadrilateral" or "triangle"

    Raises
    ------
    ValueError
        for sizes that are not positive, or another cell

    Examples
    --------
    >>> from geometry import half_cylinder_gmsh
    >>> grid = half_cylinder_gmsh(radius=10.0, spacing=0.5, cell="triangle")
    >>> grid.cell, sorted(grid.facets)
    ('triangle', ['arc', 'top'])
    """
    positive(radius=radius)
    one_of(("quadrilateral", "triangle"), cell=cell)
    spacing = SPACING * radius if spacing is None else spacing
    largest = 0.2 * radius if largest is None else largest
    even = 0.1 * radius if contact_half_width is None else contact_half_width
    positive(spacing=spacing, largest=largest, contact_half_width=even)
    with gmsh_session() as gmsh:
        geo, field = gmsh.model.geo, gmsh.model.mesh.field
        centre, left, bottom, right = (
            geo.addPoint(x, y, 0) for x, y in [(0, radius), (-radius, radius), (0, 0), (radius, radius)]
        )
        arc = [geo.addCircleArc(left, centre, bottom), geo.addCircleArc(bottom, centre, right)]
        top = geo.addLine(right, left)
        surface = geo.addPlaneSurface([geo.addCurveLoop([*arc, top])])
        geo.synchronize()
        for dim, entities, name in [(1, arc, "arc"), (1, [top], "top"), (2, [surface], "body")]:
            gmsh.model.addPhysicalGroup(dim, entities, name=name)
        distance, size = field.add("Distance"), field.add("Threshold")
        field.setNumbers(distance, "PointsList", [bottom])
        limits = {"InField": distance, "SizeMin": spacing, "SizeMax": largest, "DistMin": even}
        for option, value in {**limits, "DistMax": 2 * radius}.items():
            field.setNumber(size, option, value)
        field.setAsBackgroundMesh(size)
        for option in ("MeshSizeExtendFromBoundary", "MeshSizeFromPoints", "MeshSizeFromCurvature"):
            gmsh.option.setNumber(f"Mesh.{option}", 0)
        if cell == "quadrilateral":
            gmsh.option.setNumber("Mesh.RecombineAll", 1)
            gmsh.option.setNumber("Mesh.Algorithm", FRONTAL_QUADS)
            gmsh.option.setNumber("Mesh.RecombinationAlgorithm", FULL_QUADS)
        gmsh.model.mesh.generate(2)
        grid = gmsh_mesh(gmsh, "the half cylinder").grid()
    onto_arc = onto_circle(radius)
    nodes = np.unique(grid.facets["arc"])
    grid.points[nodes] = onto_arc(grid.points[nodes])
    grid.snap = {"arc": onto_arc}
    grid.regions, grid.node_sets = {}, {}
    return grid
