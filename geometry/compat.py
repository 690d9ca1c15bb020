"""What differs between dolfinx 0.9, 0.10 and 0.11, in one place; import it before dolfinx."""

from __future__ import annotations

import contextlib
from typing import Any

with contextlib.suppress(ImportError):
    import dolfinx_solver  # noqa: F401  (the PyPI wheel: puts PETSc and MPI where dolfinx looks for them)
import h5py  # noqa: F401  (before PETSc: otherwise the two load different HDF5 libraries)

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
