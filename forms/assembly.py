"""Forms to arrays: checked, compiled and assembled."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import scipy.sparse as sparse

from geometry import compat  # before dolfinx

import basix.ufl  # isort: skip
import ufl  # isort: skip
from dolfinx import fem, la  # isort: skip
from dolfinx import mesh as dolfinx_mesh  # isort: skip

ROUNDING = 1e-10  # of sqrt(a_ii a_jj): quadrature rounds u and v differently, by some 1e-15 a term


def compiled(form: Any, name: str, rank: int) -> Any:
    """Compile a form of the given rank with real scalars; refused as by `check_form`."""
    check_form(form, name, rank)
    return fem.form(form, dtype=np.float64) if isinstance(form, ufl.Form) else form


def check_form(form: Any, name: str, rank: int) -> None:
    """Refuse, under its `name`, what is no form of the given rank with real scalars.

    Parameters
    ----------
    form : ufl.Form or dolfinx.fem.Form
    name : what the user calls it, say "a(u, v)"
    rank : 2 for a bilinear form, 1 for a linear one

    Raises
    ------
    TypeError
        if it is no form
    ValueError
        if it has another rank, complex or single precision data, or lives on several meshes
    """
    if isinstance(form, ufl.Form):
        arguments = len(form.arguments())
        if any(argument.part() is not None for argument in form.arguments()):
            raise ValueError(f"{name} is on a mixed space; eliminate the other fields.")
        for data in (*form.constants(), *form.coefficients()):
            kind = getattr(data, "dtype", np.dtype(np.float64))
            if kind != np.float64:
                raise ValueError(
                    f"{name} holds data of the type {kind}; make it with real numbers in double precision, "
                    "say dolfinx.fem.Constant(mesh, numpy.float64(1.0))."
                )
        if len(form.ufl_domains()) > 1:
            raise ValueError(f"{name} lives on {len(form.ufl_domains())} meshes; write it on one mesh.")
    elif isinstance(form, fem.Form):
        arguments = form.rank
        if form.dtype != np.float64:
            raise ValueError(
                f"{name} is compiled for numbers of the type {form.dtype}; compile it with "
                "dolfinx.fem.form(..., dtype=numpy.float64)."
            )
    else:
        raise TypeError(
            f"{name} is a {type(form).__name__}; give a UFL form or what dolfinx.fem.form returns."
        )
    if arguments != rank:
        kinds = {0: "a functional", 1: "a linear form", 2: "a bilinear form"}
        raise ValueError(f"{name} is {kinds[arguments]}; it must be {kinds[rank]}.")


def space_of(form: Any) -> fem.FunctionSpace:
    """Return the space of a form's test function; of a compiled form, one that wraps the same C++ space."""
    if isinstance(form, ufl.Form):
        return form.arguments()[0].ufl_function_space()
    space = form.function_spaces[0]
    mesh = space.mesh
    kind = mesh.topology.cell_type.name
    variant = compat.geometry_variant(mesh)
    domain = ufl.Mesh(
        basix.ufl.element("Lagrange", kind, 1, shape=(mesh.geometry.dim,), lagrange_variant=variant)
    )
    raw = basix.finite_element.FiniteElement(space.element.basix_element)
    element: Any = basix.ufl._BasixElement(raw)
    if space.dofmap.bs > 1:
        element = basix.ufl.blocked_element(element, shape=(int(space.dofmap.bs),))
    return fem.FunctionSpace(dolfinx_mesh.Mesh(mesh, domain), element, space)


def check_space(V: fem.FunctionSpace) -> None:
    """Refuse a space that the node loop cannot work on.

    Raises
    ------
    ValueError
        one sentence, with what would do
    """
    mesh, element = V.mesh, V.ufl_element()
    dim, topology = compat.space_dimension(mesh), mesh.topology
    if topology.dim != dim:
        raise ValueError(
            f"The mesh has cells of {topology.dim} dimensions in a space of {dim}; bodies need cells of as "
            "many dimensions as the space (make the mesh with gdim equal to that of the cells)."
        )
    if topology.cell_name() not in ("triangle", "quadrilateral", "tetrahedron", "hexahedron"):
        raise ValueError(
            f"The mesh has cells of the type {topology.cell_name()}; use triangles, quadrilaterals, "
            "tetrahedra or hexahedra."
        )
    if mesh.geometry.x.dtype != np.float64:
        raise ValueError("The mesh is in single precision; make it with dtype=numpy.float64.")
    if compat.geometry_degree(mesh) != 1:
        raise ValueError(
            f"The mesh has cells with a geometry of degree {compat.geometry_degree(mesh)}; make it with "
            "straight edges (degree 1, in gmsh Mesh.ElementOrder = 1)."
        )
    wanted = f'dolfinx.fem.functionspace(mesh, ("Lagrange", 1, ({dim},)))'
    family = getattr(element, "family_name", None)
    if type(element).__name__ == "_MixedElement":
        raise ValueError(f"The space is a mixed one; eliminate the other field and use {wanted}.")
    if family != "P" or element.discontinuous or element.degree != 1:
        what = f"of the kind {family}, degree {element.degree}"
        what = "a discontinuous one" if element.discontinuous else what
        raise ValueError(f"The space is {what}; contact at the nodes needs degree 1: use {wanted}.")
    shape = tuple(element.reference_value_shape)
    if shape != (dim,) or V.dofmap.index_map_bs != dim:
        raise ValueError(f"The space has values of the shape {shape}; displacements need {wanted}.")


def node_positions(V: fem.FunctionSpace) -> np.ndarray:
    """Return the positions (N, dim) of a space's nodes: the mesh's own, without a rounding error.

    On many ranks of the nodes of this one, and its ghosts.
    """
    nodes = V.dofmap.index_map
    positions = np.empty((nodes.size_local + nodes.num_ghosts, V.mesh.topology.dim))
    positions[V.dofmap.list] = V.mesh.geometry.x[compat.geometry_dofmap(V.mesh)][:, :, : positions.shape[1]]
    return positions


def matrix(form: Any) -> sparse.bsr_array:
    """Assemble a bilinear form; blocked if the space is."""
    return rows_and_columns(form)[0]


def rows_and_columns(form: Any) -> tuple[sparse.bsr_array, np.ndarray, np.ndarray]:
    """Assemble the rows that this rank owns; return them, and number and rank of the node of each column."""
    A = fem.assemble_matrix(form if isinstance(form, fem.Form) else fem.form(form, dtype=np.float64))
    A.scatter_reverse()
    return A.to_scipy().copy(), *numbers_and_ranks(A.index_map(1), A.index_map(1).comm)


def numbers_and_ranks(nodes: Any, comm: Any) -> tuple[np.ndarray, np.ndarray]:
    """Return number and rank of the nodes of a dolfinx index map, ghosts last."""
    count = nodes.size_local + nodes.num_ghosts
    numbers = nodes.local_to_global(np.arange(count, dtype=np.int32))
    ranks = np.concatenate([np.full(nodes.size_local, comm.rank), nodes.owners])
    return numbers.astype(np.int64), ranks.astype(np.int64)


def vector(form: Any) -> np.ndarray:
    """Assemble a linear form; a row for each node of the space, its data read anew at each call."""
    if not isinstance(form, fem.Form):
        form = fem.form(form, dtype=np.float64)
    block = form.function_spaces[0].dofmap.index_map_bs
    b = fem.assemble_vector(form)
    if form.mesh.comm.size > 1:
        b.scatter_reverse(la.InsertMode.add)
        b.scatter_forward()
    return b.array.reshape(-1, block).copy()


def symmetric_matrix(form: Any, name: str) -> sparse.bsr_array:
    """Assemble a bilinear form (of `name` "a(u, v)", say) that must be symmetric.

    Raises
    ------
    ValueError
        if entries are not finite, the form is not symmetric, or has negative diagonal entries
    """
    return symmetric_rows(form, name)[0]


def symmetric_rows(form: Any, name: str) -> tuple[sparse.bsr_array, np.ndarray, np.ndarray]:
    """As `rows_and_columns`, of a form that must be symmetric: among the nodes of this rank."""
    A, numbers, ranks = rows_and_columns(form)
    A = sparse.bsr_array(A)
    check_symmetric(A if A.shape[0] == A.shape[1] else A.tocsr()[:, : A.shape[0]], name)
    return A, numbers, ranks


def check_symmetric(A: Any, name: str) -> None:
    """Refuse a matrix that is not finite, not symmetric, or has a negative diagonal entry (ValueError)."""
    if not np.isfinite(A.data).all():
        raise ValueError(f"{name} gives a matrix with entries that are not finite numbers.")
    diagonal = A.diagonal()
    if (diagonal < 0).any():
        raise ValueError(
            f"{name} has negative diagonal entries, the least {diagonal.min():g}; check its sign."
        )
    skew = (A - A.T).tocoo()
    scale = np.sqrt(diagonal[skew.row] * diagonal[skew.col])
    off = np.abs(skew.data) > ROUNDING * scale
    if off.any():
        worst = int(np.argmax(np.abs(skew.data)))
        raise ValueError(
            f"{name} is not symmetric: it differs from {name.replace('u, v', 'v, u')} by "
            f"{abs(skew.data[worst]):.2g} where its entries are {scale[worst]:.2g}; only symmetric forms can "
            "be used (no convection, no follower loads)."
        )


def at_midpoints(
    expression: Callable[[Any], Any], V: fem.FunctionSpace
) -> Callable[[np.ndarray], np.ndarray]:
    """Return a function that evaluates a UFL expression of the displacement in the middle of each cell.

    Parameters
    ----------
    expression : of a dolfinx Function in V, say the stress `sigma(u)`

    Returns
    -------
    from displacements (N, dim) to values (cells, ...)
    """
    mesh, u = V.mesh, fem.Function(V)
    reference = basix.geometry(getattr(basix.CellType, mesh.topology.cell_name()))
    tensor = expression(u)
    if getattr(tensor, "ufl_shape", None) not in ((2, 2), (3, 3)):
        what = getattr(tensor, "ufl_shape", type(tensor).__name__)
        raise ValueError(f"stress(u) is {what}; return a tensor of UFL, (2, 2) or (3, 3).")
    compiled_expression = fem.Expression(tensor, reference.mean(axis=0)[None], dtype=np.float64)
    cells = np.arange(mesh.topology.index_map(mesh.topology.dim).size_local, dtype=np.int32)

    def values(displacement: np.ndarray) -> np.ndarray:
        u.x.array[:] = np.asarray(displacement).ravel()
        return np.asarray(compiled_expression.eval(mesh, cells)).reshape(len(cells), *tensor.ufl_shape)

    return values
