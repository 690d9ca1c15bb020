"""What differs between dolfinx 0.9, 0.10 and 0.11, in one place; import it before dolfinx."""

from __future__ import annotations

import contextlib
import sys
from typing import Any

with contextlib.suppress(ImportError):
    import dolfinx_solver  # noqa: F401  (the PyPI wheel: puts PETSc and MPI where dolfinx looks for them)
if "petsc4py.PETSc" not in sys.modules:  # before PETSc: otherwise the two load different HDF5 libraries
    import h5py  # noqa: F401

import basix
import basix.ufl
import numpy as np
from dolfinx import mesh as dolfinx_mesh
from mpi4py import MPI


def lagrange(cell: str, shape: tuple[int, ...] = ()) -> Any:
    """Degree-1 Lagrange element, equispaced as gmsh's are, so that all meshes share compiled forms."""
    return basix.ufl.element(
        "Lagrange", cell, 1, shape=shape, lagrange_variant=basix.LagrangeVariant.equispaced
    )


def create_mesh(points: np.ndarray, cells: np.ndarray, cell: str) -> dolfinx_mesh.Mesh:
    """Return a dolfinx mesh on this process alone; `create_mesh` swapped its last two positions in 0.10."""
    element = lagrange(cell, (points.shape[1],))
    return dolfinx_mesh.create_mesh(MPI.COMM_SELF, cells=cells, x=points, e=element)


def geometry_dofmap(mesh: dolfinx_mesh.Mesh) -> np.ndarray:
    """Return the geometry nodes of each cell (n, k)."""
    geometry = mesh.geometry
    return geometry.dofmaps[0] if hasattr(geometry, "dofmaps") else geometry.dofmap


def geometry_degree(mesh: Any) -> int:
    """Return the degree of the cells' geometry, 1 where edges are straight."""
    return int(_geometry_map(mesh).degree)


def geometry_variant(mesh: Any) -> basix.LagrangeVariant:
    """Return where the points of the cells' geometry lie."""
    return basix.LagrangeVariant(_geometry_map(mesh).variant)


def space_dimension(mesh: dolfinx_mesh.Mesh) -> int:
    """Return how many coordinates the forms on a mesh see; quadrilaterals refined by 0.11 have one more."""
    domain: Any = mesh.ufl_domain()
    dimension = domain.geometric_dimension  # a method before UFL 2025
    return int(dimension() if callable(dimension) else dimension)


def _geometry_map(mesh: Any) -> Any:
    maps: Any = getattr(
        mesh.geometry, "cmaps", None
    )  # a list, a method of another meaning in 0.9, or not there
    return maps[0] if hasattr(maps, "__getitem__") else mesh.geometry.cmap
