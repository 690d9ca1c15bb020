"""Fields of a body that many ranks share, gathered on the first."""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import numpy as np

Fields = Mapping[str, np.ndarray]


class Gathered:
    """A shared mesh, whole on rank 0; collective.

    Parameters
    ----------
    system : forms.System
        With `sharing`.

    Attributes
    ----------
    comm : MPI communicator
    body
        On rank 0 the whole mesh, for `write_xdmf`; on others None.
    """

    def __init__(self, system: Any):
        sharing = system.sharing
        self.comm, ids, self._own, self._cells = sharing.comm, sharing.mesh_ids, sharing.own, sharing.cells
        self.body: Any = None
        parts = (ids[self._own], system.points[self._own], ids[system.cells[self._cells]])
        places = self.comm.gather(parts)
        if self.comm.rank:
            return
        numbers, points, corners = (np.concatenate(part) for part in zip(*places))
        order = np.argsort(numbers)
        corners = np.searchsorted(numbers[order], corners)
        mesh, vertices = _mesh(points[order], corners, system.mesh.topology.cell_name())
        self._nodes = order[mesh.geometry.input_global_indices]
        self._original = mesh.topology.original_cell_index
        self.body = SimpleNamespace(mesh=mesh, cells=vertices)

    def fields(self, nodes: Fields, cells: Fields) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
        """Return fields of the nodes and the cells that each rank holds, on rank 0; collective."""
        at_nodes = self.comm.gather({name: values[self._own] for name, values in nodes.items()})
        in_cells = self.comm.gather({name: values[self._cells] for name, values in cells.items()})
        if self.comm.rank:
            return {}, {}
        return (
            {name: np.concatenate([part[name] for part in at_nodes])[self._nodes] for name in nodes},
            {name: np.concatenate([part[name] for part in in_cells])[self._original] for name in cells},
        )


def gathered_if_shared(body: Any) -> Gathered | None:
    """Gather the mesh of a BodyOnRoad, or of a system, that ranks share; collective."""
    system = getattr(body, "system", body)
    return Gathered(system) if getattr(system, "sharing", None) is not None else None


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
