"""Prolongations between nested meshes, for the multigrid correction."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
import scipy.sparse as sparse
from scipy.spatial import cKDTree

from forms.assembly import node_positions
from geometry.body import narrow
from geometry.grid import PATTERN, number_rows

from dolfinx import fem  # isort: skip
from dolfinx import mesh as dolfinx_mesh  # isort: skip


def nested_prolongations(V: fem.FunctionSpace, coarser: Sequence[Any]) -> list[sparse.csr_array]:
    """Return prolongations from coarser meshes to that of a space, finest first, each (N_fine, N_coarse).

    A finer mesh is nested if each of its nodes is a node of the next coarser one or the mean of the corners
    of one of its edges, faces or cells, and each coarse node is a fine one: so `dolfinx.mesh.refine` and
    `uniform_refine` make them. Nodes may then have been moved onto a curved boundary.

    Parameters
    ----------
    V : space of degree 1 of the finest mesh
    coarser : meshes or spaces, in any order

    Raises
    ------
    ValueError
        if the meshes are not nested
    """
    if not isinstance(coarser, Iterable):
        raise TypeError(f"coarser is a {type(coarser).__name__}; give a list of coarser meshes.")
    levels = [_nodes_and_cells(V)]
    levels += sorted((_nodes_and_cells(_space(mesh)) for mesh in coarser), key=lambda level: -len(level[0]))
    order = np.arange(len(levels[0][0]))
    prolongations = []
    for (points, _, _), (coarse, cells, cell) in pairwise(levels):
        if len(coarse) >= len(points):
            raise ValueError(
                f"coarser holds a mesh of {len(coarse)} nodes, not fewer than the {len(points)} of the next "
                "finer one; give only those that this mesh, and each other, were refined from."
            )
        P = _means(cells, cell)
        chosen = _chosen(P @ coarse, points, len(coarse))
        P = P[chosen][order]
        # coarse nodes in the order in which they appear on the finer mesh, which keeps neighbours near
        first = np.full(len(coarse), -1)
        copies = np.flatnonzero(np.diff(P.indptr) == 1)
        first[P.indices[P.indptr[copies]]] = copies
        order = np.argsort(first, kind="stable")
        prolongations.append(narrow(sparse.csr_array(P[:, order])))
    return prolongations


def _space(mesh: Any) -> Any:
    """Return the space of a mesh, or the space itself."""
    if isinstance(mesh, fem.FunctionSpace):
        return mesh
    if not isinstance(mesh, dolfinx_mesh.Mesh):
        raise TypeError(f"coarser holds a {type(mesh).__name__}; give meshes, or spaces on them.")
    return fem.functionspace(mesh, ("Lagrange", 1))


def _nodes_and_cells(V: fem.FunctionSpace) -> tuple[np.ndarray, np.ndarray, str]:
    return node_positions(V), np.asarray(V.dofmap.list), V.mesh.topology.cell_name()


def _means(cells: np.ndarray, cell: str) -> sparse.csr_array:
    """Means of vertices, a row each, that may be nodes after refinement; the vertices themselves first."""
    count = int(cells.max()) + 1
    rows = [sparse.eye_array(count, format="csr")]
    patterns = [mean for mean in PATTERN[cell][0] if len(mean) > 1]
    for size in sorted({len(mean) for mean in patterns}):
        local = np.array([mean for mean in patterns if len(mean) == size])
        vertices = np.sort(cells[:, local].reshape(-1, size), axis=1)
        vertices = vertices[number_rows(vertices)[0]]
        shape = (len(vertices), count)
        starts = np.arange(0, vertices.size + 1, size)
        rows.append(
            sparse.csr_array((np.full(vertices.size, 1.0 / size), vertices.ravel(), starts), shape=shape)
        )
    return sparse.csr_array(sparse.vstack(rows, format="csr"))


def _chosen(offered: np.ndarray, points: np.ndarray, coarse: int) -> np.ndarray:
    """Which of the offered places each point is; one for each, all coarse nodes among them."""
    chosen = cKDTree(offered).query(points)[1]
    counts = np.bincount(chosen, minlength=len(offered))
    if counts.max() > 1 or counts[:coarse].min() < 1:
        bad = int(np.argmax(counts)) if counts.max() > 1 else int(np.argmin(counts[:coarse]))
        raise ValueError(
            f"The meshes are not nested: near {offered[bad]} a mesh has {counts[bad]} nodes where the next "
            "coarser one has one node, edge, face or cell to be halved; give all meshes of a chain "
            "of refinements."
        )
    return chosen
