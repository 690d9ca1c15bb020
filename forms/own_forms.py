"""The user's own forms, checked, compiled, assembled, and made a system with supports."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np

from forms.assembly import at_midpoints, check_form, check_space, compiled, space_of, symmetric_rows, vector
from forms.sharing import of_system, share, share_space, take_levels
from forms.system import System, check_load, constrained
from forms.transfer import nested_prolongations
from geometry.partition import shared_of

import ufl  # isort: skip
from ufl.core.expr import Expr  # isort: skip
from dolfinx import fem  # isort: skip


def assemble(
    a: Any,
    L: Any = None,
    bcs: Sequence[fem.DirichletBC] | None = None,
    *,
    mass: Any = None,
    damping: Any = None,
    update: Callable[[float], None] | None = None,
    coarser: Sequence[Any] = (),
    stress: Callable[[Any], Any] | None = None,
) -> System:
    """Assemble the user's own forms for the contact loop.

    Parameters
    ----------
    a : bilinear form a(u, v), symmetric: elasticity of any constant material, Robin terms, ...; UFL, or
        compiled by `dolfinx.fem.form`. On a space of vectors of degree 1 with as many components as the mesh
        has dimensions.
    L : linear form L(v); or a callable of the time (or load parameter) that returns one, or nodal forces (N,
        dim) in the order of the space's nodes; None for no load
    bcs : DirichletBCs on the space or its components, or None. They are applied once, to all matrices; their
        values, and the data of L, are read anew by each `solve`, load step and time step.
    mass, damping : bilinear forms m(u, v) and c(u, v), symmetric, for motion
    update : called with the time (or load parameter) before values of that time are read: sets the user's
        Constants and Functions
    coarser : meshes, or spaces on them, of which this one is a nested refinement
        (`dolfinx.mesh.refine`, `uniform_refine`), in any order; for the multigrid correction
    stress : sigma(u) in UFL, for output only; (3, 3) if von Mises' stress shall be written too

    Returns
    -------
    System

    Raises
    ------
    TypeError, ValueError
        in one sentence, before anything is assembled where that is possible: forms that are not symmetric or
        not bilinear, complex numbers, spaces of another kind or degree, boundary conditions of another
        space, meshes that are not nested

    Examples
    --------
    >>> import numpy as np, ufl
    >>> from mpi4py import MPI
    >>> from dolfinx import fem, mesh
    >>> square = mesh.create_unit_square(MPI.COMM_SELF, 4, 4)
    >>> V = fem.functionspace(square, ("Lagrange", 1, (2,)))
    >>> u, v = ufl.TrialFunction(V), ufl.TestFunction(V)
    >>> a = ufl.inner(ufl.sym(ufl.grad(u)), ufl.sym(ufl.grad(v))) * ufl.dx
    >>> L = ufl.inner(fem.Constant(square, (0.0, -1.0)), v) * ufl.dx
    >>> left = fem.locate_dofs_geometrical(V, lambda x: np.isclose(x[0], 0.0))
    >>> system = assemble(a, L, bcs=[fem.dirichletbc(np.zeros(2), left, V)])
    >>> system.A.shape, int(system.fixed.sum())
    ((50, 50), 10)
    """
    check_form(a, "a(u, v)", 2)
    V = space_of(a)
    check_space(V)
    for name, function in (("update", update), ("stress", stress)):
        if isinstance(function, Expr) or not (function is None or callable(function)):
            raise TypeError(f"{name} is a {type(function).__name__}; give a function, or leave it out.")
    form = compiled(a, "a(u, v)", 2)
    space = V._cpp_object
    parts = {"mass m(u, v)": mass, "damping c(u, v)": damping}
    others = {name: compiled(part, name, 2) for name, part in parts.items() if part is not None}
    loads = _loads(L, V, update)
    for name, other in others.items():
        _same_space(name, other, space)
    _same_space("a(u, v)", form, space)
    bcs = _checked_bcs(bcs, V)
    many = V.mesh.comm.size > 1
    if many and len(coarser):
        raise ValueError(
            "Coarser meshes are not shared among ranks but by Body.from_grid(grid, refinements); leave "
            "`coarser` out, or run on one rank."
        )
    prolongations = nested_prolongations(V, coarser)
    names = ["a(u, v)", *others]
    rows = [symmetric_rows(one, name) for name, one in zip(names, [form, *others.values()])]
    matrices, sharing = [A for A, _, _ in rows], None
    levels: list[Any] = []
    if many:
        sharing, matrices = share_space(V, rows)
    elif shared := shared_of(V.mesh):
        sharing, levels = share(shared, matrices)
    assembled = dict(zip(names, matrices))
    nodes, dim = V.dofmap.index_map, V.dofmap.index_map_bs
    count = nodes.size_local + nodes.num_ghosts
    fixed = np.zeros(count * dim, dtype=bool)
    for bc in bcs:
        fixed[bc.dof_indices()[0]] = True
    fixed = of_system(fixed.reshape(count, dim), sharing)

    def values(time: float | None) -> np.ndarray:
        if time is not None and update is not None:
            update(time)
        x = np.zeros(count * dim)
        for bc in bcs:
            bc.set(x)
        if not np.isfinite(x).all():
            raise ValueError("A boundary condition has a value that is not a finite number.")
        return of_system(x.reshape(count, dim), sharing)

    system = constrained(
        V,
        assembled["a(u, v)"],
        loads,
        fixed,
        values,
        mass=assembled.get("mass m(u, v)"),
        damping=assembled.get("damping c(u, v)"),
        sharing=sharing,
    )
    system.prolongations = prolongations
    if sharing is not None:
        take_levels(system, levels)
    system.varies = update is not None or (callable(L) and not isinstance(L, ufl.Form))
    if stress is not None:
        system.stress = at_midpoints(stress, V)
    return system


def _checked_bcs(bcs: Any, V: fem.FunctionSpace) -> list[fem.DirichletBC]:
    """Boundary conditions as a list that can be read again and again, or a sentence."""
    if bcs is None:
        return []
    if not isinstance(bcs, Iterable):
        raise TypeError(
            f"bcs is a {type(bcs).__name__}; give a list of what dolfinx.fem.dirichletbc returns."
        )
    known = list(bcs)
    nodes = V.dofmap.index_map
    count = (nodes.size_local + nodes.num_ghosts) * V.dofmap.index_map_bs
    for bc in known:
        if not isinstance(bc, fem.DirichletBC):
            raise TypeError(f"bcs holds a {type(bc).__name__}; give what dolfinx.fem.dirichletbc returns.")
        if not V._cpp_object.contains(bc.function_space):
            raise ValueError("A boundary condition is on another space than the forms; make it on theirs.")
        dofs = bc.dof_indices()[0]
        if dofs.size and not 0 <= dofs.min() <= dofs.max() < count:
            raise ValueError(
                f"A boundary condition names the unknown {dofs.max()}, of {count} that there are; give what "
                "dolfinx.fem.locate_dofs_topological returns."
            )
    return known


def _same_space(name: str, form: fem.Form, space: Any) -> None:
    for other in form.function_spaces:
        if not space.contains(other):
            raise ValueError(f"{name} has test or trial functions of another space than a(u, v)'s; use one.")


def _loads(L: Any, V: fem.FunctionSpace, update: Any) -> Callable[[float | None], np.ndarray]:
    """Nodal forces (N, dim) as a function of the time (None: now)."""
    nodes = V.dofmap.index_map
    shape = (nodes.size_local + nodes.num_ghosts, V.dofmap.index_map_bs)

    def nodal(load: Any) -> np.ndarray:
        if isinstance(load, (ufl.Form, fem.Form)):
            form = compiled(load, "L(v)", 1)
            _same_space("L(v)", form, V._cpp_object)
            load = vector(form)
        return check_load(load, shape)

    if L is None:
        return lambda time: np.zeros(shape)
    if isinstance(L, (ufl.Form, fem.Form)):
        form = compiled(L, "L(v)", 1)
        _same_space("L(v)", form, V._cpp_object)

        def loads(time: float | None) -> np.ndarray:
            if time is not None and update is not None:
                update(time)
            return check_load(vector(form), shape)

        return loads
    if callable(L) and not isinstance(L, Expr):
        return lambda time: nodal(L(0.0 if time is None else time))
    return lambda time: nodal(L)
