"""Meshes from gmsh: the half cylinder graded by a size field, and any `.msh` file."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from geometry.grid import DIMENSION, FACET, Grid
from geometry.meshes.circle import onto_circle

# gmsh's element types of degree 1, and the order in which dolfinx wants their vertices
CELL_OF_TYPE = {2: "triangle", 3: "quadrilateral", 4: "tetrahedron", 5: "hexahedron"}
ORDER = {
    "interval": [0, 1],
    "triangle": [0, 1, 2],
    "quadrilateral": [0, 1, 3, 2],
    "tetrahedron": [0, 1, 2, 3],
    "hexahedron": [0, 1, 3, 2, 4, 5, 7, 6],
}
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
    """
    spacing = 0.0073 * radius if spacing is None else spacing
    largest = 0.2 * radius if largest is None else largest
    even = 0.1 * radius if contact_half_width is None else contact_half_width
    for name, value in {
        "radius": radius,
        "spacing": spacing,
        "largest size": largest,
        "even width": even,
    }.items():
        if not (np.isfinite(value) and value > 0):
            raise ValueError(f"The {name} is {value}; it must be positive.")
    if cell not in ("quadrilateral", "triangle"):
        raise ValueError(f"The cell type is {cell!r}; it must be 'quadrilateral' or 'triangle'.")
    with _session() as gmsh:
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
        grid = _grid(gmsh, "the half cylinder")
    onto_arc = onto_circle(radius)
    nodes = np.unique(grid.facets["arc"])
    grid.points[nodes] = onto_arc(grid.points[nodes])
    grid.snap = {"arc": onto_arc}
    grid.regions = {}
    return grid


def read_msh(path: str | os.PathLike) -> Grid:
    """Read a mesh of degree 1 from a gmsh file.

    Physical groups of the cells' dimension become regions, those one dimension lower boundaries, under their
    names (or their tags, where they have no name). Plane meshes must lie in a plane z = constant.

    Raises
    ------
    ValueError
        one sentence, if the file is not whole, or holds what cannot be used.
    """
    path = Path(path)
    if not path.is_file():
        raise ValueError(f"There is no file {str(path)!r} to read a mesh from.")
    with path.open("rb") as file:
        if not file.read(32).startswith(b"$MeshFormat"):
            raise ValueError(f"{str(path)!r} is not a gmsh mesh; such a file starts with $MeshFormat.")
    with _session() as gmsh:
        try:
            gmsh.merge(str(path))
        except Exception as error:
            reason = str(error) or "it does not say why"
            raise ValueError(
                f"gmsh cannot read {str(path)!r} ({reason}); the file may be damaged."
            ) from error
        return _grid(gmsh, repr(str(path)))


@contextmanager
def _session() -> Iterator:
    """Run gmsh silently in a model of its own, leaving a gmsh that the caller may be running as it was."""
    try:
        import gmsh
    except ImportError as error:
        raise ImportError(
            "This needs gmsh, which is not installed; install it with `pip install gmsh`."
        ) from error
    except OSError as error:
        raise ImportError(
            f"gmsh cannot be loaded ({error}); install its system libraries, on Debian and Ubuntu "
            "`apt install libglu1-mesa libxft2 libxinerama1 libxcursor1`."
        ) from error
    started = not gmsh.isInitialized()
    if started:
        gmsh.initialize(readConfigFiles=False, interruptible=False)
        gmsh.option.setNumber("General.Terminal", 0)
    gmsh.model.add("zerogap")
    try:
        yield gmsh
    finally:
        gmsh.model.remove()
        if started:
            gmsh.finalize()


def _grid(gmsh: Any, source: str) -> Grid:
    """Turn gmsh's current mesh into a Grid."""
    dim = max((d for d in (2, 3) if len(gmsh.model.mesh.getElements(d)[0])), default=0)
    types = list(gmsh.model.mesh.getElementTypes(dim)) if dim else []
    if len(types) != 1 or types[0] not in CELL_OF_TYPE:
        names = " and ".join(gmsh.model.mesh.getElementProperties(t)[0] for t in types) or "no cells"
        raise ValueError(
            f"The mesh of {source} has {names}; it must have triangles, quadrilaterals, tetrahedra or "
            "hexahedra of degree 1, of one kind only."
        )
    cell = CELL_OF_TYPE[types[0]]
    tags, points = _nodes(gmsh, dim)
    if dim == 2 and np.ptp(points[:, 2]) > 1e-12 * np.ptp(points, axis=0).max():
        raise ValueError(
            f"The mesh of {source} is a surface in space; a plane mesh needs one z for all nodes."
        )
    order = np.argsort(tags)

    def rows(kind: str, d: int, entity: int = -1) -> tuple[np.ndarray, np.ndarray]:
        numbers, nodes = [], []
        for type_, found, vertices in zip(*gmsh.model.mesh.getElements(d, entity)):
            if gmsh.model.mesh.getElementProperties(type_)[3] != len(ORDER[kind]):
                raise ValueError(
                    f"The mesh of {source} has boundary facets of another degree than its cells."
                )
            numbers.append(found)
            position = order[np.searchsorted(tags, vertices, sorter=order)]
            nodes.append(position.reshape(-1, len(ORDER[kind]))[:, ORDER[kind]])
        if not numbers:
            return np.empty(0, dtype=int), np.empty((0, len(ORDER[kind])), dtype=int)
        return np.concatenate(numbers), np.concatenate(nodes)

    cell_numbers, cells = rows(cell, dim)
    cell_at = dict(zip(cell_numbers.tolist(), range(len(cells))))
    facets: dict[str, np.ndarray] = {}
    regions: dict[str, np.ndarray] = {}
    for d, tag in gmsh.model.getPhysicalGroups():
        name = gmsh.model.getPhysicalName(d, tag) or str(tag)
        entities = gmsh.model.getEntitiesForPhysicalGroup(d, tag)
        if d == dim - 1:
            facets[name] = np.concatenate([rows(FACET[cell], d, entity)[1] for entity in entities])
        if d == dim:
            members = np.concatenate([rows(cell, d, entity)[0] for entity in entities])
            regions[name] = np.array([cell_at[n] for n in members.tolist()], dtype=int)
    return Grid(points[:, : DIMENSION[cell]].copy(), cells, cell, facets, regions)


def _nodes(gmsh: Any, dim: int) -> tuple[np.ndarray, np.ndarray]:
    """Return tags and positions (n, 3) of the nodes, without bare points of the geometry like centres."""
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    used = np.concatenate(gmsh.model.mesh.getElements(dim)[2])
    keep = ~np.isin(tags, gmsh.model.mesh.getNodes(0)[0]) | np.isin(tags, used)
    return tags[keep], coordinates.reshape(-1, 3)[keep]
