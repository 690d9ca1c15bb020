"""Fields of a body that many ranks share, gathered on the first."""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import numpy as np

Fields = Mapping[str, np.ndarray]


def gathered(
    system: Any, nodes: Fields, cells: Fields
) -> tuple[Any, dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Gather a shared mesh and its fields on rank 0; collective.

    Parameters
    ----------
    system : forms.System
        With `sharing`.
    nodes, cells : dict of ndarray
        Fields at the nodes and in the cells that this rank holds.

    Returns
    -------
    On rank 0 the whole mesh, for `write_xdmf`, and its fields; on other ranks None and nothing.
    """
    comm, ids, own = system.sharing.comm, system.sharing.mesh_ids, system.sharing.own
    ours = system.sharing.cells
    at_nodes = comm.gather({name: values[own] for name, values in nodes.items()})
    in_cells = comm.gather({name: values[ours] for name, values in cells.items()})
    places = comm.gather((ids[own], system.points[own], ids[system.cells[ours]]))
    if comm.rank:
        return None, {}, {}
    numbers, points, corners = (np.concatenate(part) for part in zip(*places))
    order = np.argsort(numbers)
    corners = np.searchsorted(numbers[order], corners)
    mesh, vertices = _mesh(points[order], corners, system.mesh.topology.cell_name())
    order = order[mesh.geometry.input_global_indices]
    original = mesh.topology.original_cell_index
    return (
        SimpleNamespace(mesh=mesh, cells=vertices),
        {name: np.concatenate([part[name] for part in at_nodes])[order] for name in nodes},
        {name: np.concatenate([part[name] for part in in_cells])[original] for name in cells},
    )


def _mesh(points: np.ndarray, cells: np.ndarray, cell: str) -> tuple[Any, np.ndarray]:
    """Make a dolfinx mesh on this rank alone; return its cells too."""
    import basix.ufl
    from dolfinx import mesh as dolfinx_mesh
    from mpi4py import MPI

    variant, dim = basix.LagrangeVariant.equispaced, points.shape[1]
    element: Any = basix.ufl.element("Lagrange", cell, 1, shape=(dim,), lagrange_variant=variant)
    mesh = dolfinx_mesh.create_mesh(MPI.COMM_SELF, cells=cells, x=points, e=element)
    geometry = mesh.geometry
    return mesh, np.asarray(geometry.dofmaps[0] if hasattr(geometry, "dofmaps") else geometry.dofmap)
