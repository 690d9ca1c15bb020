"""Boundary facets: which ones are meant, their measure, and the area that belongs to each node."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from forms.assembly import vector

import ufl  # isort: skip
from dolfinx import fem  # isort: skip
from dolfinx import mesh as dolfinx_mesh  # isort: skip

FACET_DEGREE = 3  # a cubic is exact: bilinear shape functions on a face of a hexahedron, its Jacobian linear
Facets = str | Sequence[str] | Sequence[int] | np.ndarray
WANTED = "give indices of facets, say tags.find(2), or names of boundaries of a Body"


def facet_indices(facets: Facets, mesh: Any, body: Any, shared: bool) -> np.ndarray:
    """Return dolfinx's numbers of outer facets, sorted, each once; of many ranks those of this one.

    Parameters
    ----------
    facets : their indices, or one or several names of boundaries of the body
    mesh : dolfinx mesh
    body : the Body that has the names, or None
    shared : whether other ranks may have facets where this one has none

    Raises
    ------
    TypeError, ValueError
        if they are not outer facets of the mesh, or there are none
    """
    if isinstance(facets, str) or _holds_names(facets):
        names = [facets] if isinstance(facets, str) else list(facets)
        if body is None:
            raise ValueError(
                f"There is no boundary {names[0]!r}, for this mesh has no names; give the indices of "
                "facets, say tags.find(2)."
            )
        return np.asarray(body.facet_indices(names))
    if not isinstance(facets, list | tuple | np.ndarray):
        raise TypeError(f"Facets are a {type(facets).__name__}; {WANTED}.")
    if any(not np.isscalar(one) for one in facets):
        raise ValueError(f"Facets are {facets!r:.80}, where each must be one number; {WANTED}.")
    indices, fdim = np.unique(facets), mesh.topology.dim - 1
    mesh.topology.create_entities(fdim)
    mesh.topology.create_connectivity(fdim, mesh.topology.dim)
    if mesh.comm.size > 1:  # copies of other ranks' facets are theirs
        indices = indices[indices < mesh.topology.index_map(fdim).size_local].astype(np.int32)
    if mesh.comm.allreduce(indices.size) == 0 and not shared:
        raise ValueError(
            "No facets are named that may touch; look whether the mesh has the tag that you asked for."
        )
    if not np.issubdtype(indices.dtype, np.integer):
        raise ValueError(f"Facets are of the type {indices.dtype}; give their indices, integers.")
    outer = np.isin(indices, dolfinx_mesh.exterior_facet_indices(mesh.topology))
    if not outer.all():
        raise ValueError(
            f"{np.count_nonzero(~outer)} of the {indices.size} facets are not on the boundary of this "
            f"mesh, the first is {indices[~outer][0]}; name outer facets of the mesh that "
            "the forms live on."
        )
    return indices.astype(np.int32)


def _holds_names(facets: Any) -> bool:
    return (
        isinstance(facets, list | tuple | np.ndarray)
        and len(facets) > 0
        and all(isinstance(name, str) for name in facets)
    )


def boundary_measure(mesh: dolfinx_mesh.Mesh, facets: np.ndarray) -> Any:
    """Return ds on some facets, always under tag 1 so that all boundaries share compiled forms."""
    facets = np.sort(facets)
    here = dolfinx_mesh.meshtags(mesh, mesh.topology.dim - 1, facets, np.ones(len(facets), dtype=np.int32))
    return ufl.Measure("ds", mesh, subdomain_data=here, metadata={"quadrature_degree": FACET_DEGREE})(1)


def plane_of(road: Any) -> Any:
    """Return the plane that a road is at time 0, if it is one and does not turn; else None."""
    if hasattr(road, "at"):
        road = road.road if getattr(road, "turn", True) is None else None
    return road if getattr(road, "flat", False) else None


def nodal_areas(space: Any, facets: np.ndarray, axisymmetric: bool) -> np.ndarray:
    """Return the integrals (N,) of the nodes' shape functions over boundary facets."""
    mesh = space.mesh
    ones = fem.Constant(mesh, np.ones(mesh.topology.dim))
    density = ufl.inner(ones, ufl.TestFunction(space))
    if axisymmetric:
        density = 2 * np.pi * ufl.SpatialCoordinate(mesh)[0] * density
    return vector(density * boundary_measure(mesh, facets))[:, 0]
