"""Fields of a body that many ranks share, gathered on the first."""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import numpy as np

Fields = Mapping[str, np.ndarray]


def gathered(
    body: Any, nodes: Fields, cells: Fields
) -> tuple[Any, dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Gather a shared body and its fields on rank 0; collective.

    Parameters
    ----------
    body : geometry.Body
        With `shared`.
    nodes, cells : dict of ndarray
        Fields at the nodes and in the cells that this rank holds.

    Returns
    -------
    On rank 0 the whole mesh, for `write_xdmf`, and its fields; on other ranks None and nothing.
    """
    comm, ids, owner = body.shared.comm, body.shared.ids[0], body.shared.owner[0]
    own = np.flatnonzero(owner == comm.rank)
    # Each cell once: by the rank that owns its lowest node, which holds all cells around that.
    lowest = np.take_along_axis(body.cells, np.argmin(ids[body.cells], axis=1)[:, None], axis=1)[:, 0]
    ours = np.flatnonzero(owner[lowest] == comm.rank)
    at_nodes = comm.gather({name: values[own] for name, values in nodes.items()})
    in_cells = comm.gather({name: values[ours] for name, values in cells.items()})
    places = comm.gather((ids[own], body.coordinates[own], ids[body.cells[ours]]))
    if comm.rank:
        return None, {}, {}
    numbers, points, corners = (np.concatenate(part) for part in zip(*places))
    order = np.argsort(numbers)
    mesh, vertices = _mesh(points[order], corners, body.cell)
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
