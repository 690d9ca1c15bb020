"""Meshes from files."""

from __future__ import annotations

import os
from pathlib import Path

from checks import is_path
from geometry.grid import Grid
from geometry.meshes.abaqus_file import read_abaqus
from geometry.meshes.gmsh_file import read_by_gmsh
from geometry.meshes.meshio_file import read_by_meshio
from geometry.meshes.raw_mesh import RawMesh

BY_GMSH = {".msh", ".med", ".unv", ".bdf", ".nas", ".cgns"}
SURFACES = {".stl", ".obj", ".off", ".ply", ".ply2", ".wrl"}
SHAPES = {".geo", ".geo_unrolled", ".step", ".stp", ".brep", ".iges", ".igs", ".xao"}


def read_mesh(path: str | os.PathLike) -> Grid:
    """Read a mesh of degree 1 from a file, with the names that the file gives.

    By gmsh: .msh (2.2, 4.0, 4.1, as text or binary), .med, .unv, .bdf, .cgns. Abaqus's .inp with its
    node sets, element sets and surfaces. All else, .vtk, .vtu, .xdmf among it, by meshio: what shares a
    value of an array of whole numbers is a group, "ARRAY VALUE".

    Groups of cells become regions, groups of facets boundaries; a facet may belong to several. A set of
    nodes becomes a boundary if it is all the nodes of some facets; otherwise it can be supported only, as
    can facets inside the body. Plane meshes must lie in a plane z = constant.

    Returns
    -------
    Grid : for `Body.from_grid`

    Raises
    ------
    ValueError
        one sentence, if the file is not whole, or holds what cannot be used.

    Examples
    --------
    >>> import tempfile, meshio
    >>> from geometry import Body, read_mesh
    >>> square = meshio.Mesh([[0, 0], [1, 0], [1, 1], [0, 1]], [("quad", [[0, 1, 2, 3]])],
    ...                      point_sets={"foot": [0, 1]})
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     square.write(folder + "/square.inp")
    ...     body = Body.from_grid(read_mesh(folder + "/square.inp"))
    >>> body.nodes("foot").size
    2
    """
    path = is_path(path)
    if path.suffix.lower() in SURFACES and path.is_file():
        raise ValueError(
            f"{str(path)!r} can hold the surface of a body only, but a body needs cells; fill it by a mesh "
            "generator, or read it as a rigid obstacle by SurfaceRoad.read."
        )
    return read_raw(path).grid()


def read_raw(path: Path) -> RawMesh:
    """Read points, rows and groups of a file, be it of a body or of a surface.

    Raises
    ------
    ValueError
        one sentence, if the file cannot be read.
    """
    suffix = path.suffix.lower()
    if not path.is_file():
        raise ValueError(f"There is no file {str(path)!r} to read a mesh from.")
    if suffix in SHAPES:
        raise ValueError(f"{str(path)!r} holds a shape, not its mesh; mesh it, say by gmsh, and save that.")
    if suffix == ".inp":
        return read_abaqus(path)
    if suffix == ".msh":
        with path.open("rb") as file:
            if not file.readline().startswith(b"$MeshFormat"):
                raise ValueError(f"{str(path)!r} is not a gmsh mesh; such a file starts with $MeshFormat.")
            if file.readline().split()[:2] in ([b"4", b"1"], [b"4.0", b"1"]):  # which gmsh reads no more
                return read_by_meshio(path)
    return (read_by_gmsh if suffix in BY_GMSH else read_by_meshio)(path)


def read_msh(path: str | os.PathLike) -> Grid:
    """Read a mesh from a gmsh file; the same as `read_mesh`.

    Examples
    --------
    >>> import meshio
    >>> from geometry import read_msh
    >>> points, triangle = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], [("triangle", [[0, 1, 2]])]
    >>> meshio.Mesh(points, triangle).write("one.msh", file_format="gmsh22")
    >>> read_msh("one.msh").cell
    'triangle'
    """
    return read_mesh(path)
