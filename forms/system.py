"""From weak forms and supports to the matrices and loads of the contact loop: the one way in."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from numbers import Real
from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sparse

from checks import numbers
from geometry import Body, compat

from dolfinx import fem  # isort: skip
from dolfinx import mesh as dolfinx_mesh  # isort: skip

from forms.assembly import node_positions
from forms.facets import Facets, facet_indices, nodal_areas, plane_of
from forms.sharing import Sharing, block_rows
from forms.tilting import Tilting, spreading


class Eliminated(NamedTuple):
    """A matrix after the supports, and what it couples prescribed unknowns to."""

    A: sparse.bsr_array
    coupling: sparse.csr_array
    diagonal: np.ndarray


@dataclass
class System:
    """Matrices and loads after the supports; made by `forms.assemble`, or by `Support.apply`.

    R nodes of the system, N of the space, dim dimensions; they differ where a platen makes one node of many.

    Attributes
    ----------
    A : (R dim, R dim) stiffness in dim x dim blocks. A prescribed unknown keeps its place as a row and column
        with a diagonal entry alone, its effect moved to the load.
    M, C : likewise mass and damping, or None
    load : (R, dim), as it was when assembled; `load_at` reads it anew
    coordinates : (R, dim); of a platen, the mean of its nodes
    node_of : (N,) the node of the system that each node of the space has become
    prolongations : between the meshes, finest first, with platens as one node on each; to be truncated at
        prescribed unknowns by the solver
    fixed : (R, dim) which unknowns are prescribed
    space : dolfinx function space of the displacement
    varies : whether load or prescribed displacements depend on time
    elasticity : the `Elasticity` that made the system, or None
    elastic : the `Hyperelasticity` of a system of finite strain, of which A is the tangent at rest; else None
    exchanges, ids : where many ranks share the mesh, of each mesh, finest first: the exchange of values, and
        the numbers of the nodes that all ranks agree on. Nodes of the system are then those that this rank
        owns, followed by those that it holds a copy of, whose rows are empty.
    sharing : how many ranks share the nodes, or None
    turning : (R,) of the nodes that hold the small angles of platens that tilt, the length by which these are
        multiplied, 0 at others; None where no platen tilts. The first component in the plane, in space all.
    axisymmetric : whether areas are those of a body of revolution, x being the distance from its axis

    Examples
    --------
    >>> from forms import Elasticity, Isotropic, Support
    >>> from geometry import Body, rectangle
    >>> elasticity = Elasticity(Body.from_grid(rectangle(2.0, 1.0, 4, 2)), Isotropic(E=1e3, nu=0.3))
    >>> support = Support(elasticity.body).platen("top")  # its five nodes become one
    >>> system = elasticity.system(elasticity.body_force((0.0, -1.0)), support)
    >>> system.load.shape, float(system.load[:, 1].sum().round(9))
    ((11, 2), -2.0)
    """

    A: sparse.bsr_array
    load: np.ndarray
    coordinates: np.ndarray
    node_of: np.ndarray
    prolongations: list[sparse.csr_array]
    fixed: np.ndarray
    space: Any = None
    M: sparse.bsr_array | None = None
    C: sparse.bsr_array | None = None
    varies: bool = False
    axisymmetric: bool = False
    body: Body | None = None
    stress: Callable[[np.ndarray], np.ndarray] | None = None
    elasticity: Any = None
    elastic: Any = None
    exchanges: Sequence[Any] = ()
    ids: Sequence[np.ndarray] = ()
    sharing: Sharing | None = None
    turning: np.ndarray | None = None
    _spread: sparse.bsr_array | None = field(default=None, repr=False)
    _loads: Callable[[float | None], np.ndarray] = field(default=lambda t: np.zeros(0), repr=False)
    _values: Callable[[float | None], np.ndarray] = field(default=lambda t: np.zeros(0), repr=False)
    _eliminated: dict[str, Eliminated] = field(default_factory=dict, repr=False)
    _held: np.ndarray = field(default_factory=lambda: np.zeros(0, dtype=np.int64), repr=False)
    _rows: dict[str, sparse.bsr_array] = field(default_factory=dict, repr=False)
    _rigid: dict[str, np.ndarray] = field(default_factory=dict, repr=False)
    _centre: np.ndarray = field(default_factory=lambda: np.zeros(0), repr=False)

    @property
    def mesh(self) -> dolfinx_mesh.Mesh:
        """The dolfinx mesh."""
        return self.space.mesh

    @property
    def cells(self) -> np.ndarray:
        """Nodes (cells, k) of each cell, in dolfinx's order."""
        return np.asarray(self.space.dofmap.list)

    @cached_property
    def points(self) -> np.ndarray:
        """Positions (N, dim) of the nodes of the space."""
        return node_positions(self.space)

    def expand(self, u: np.ndarray) -> np.ndarray:
        """Return displacements (N, dim) of the space's nodes from those of the system (R, dim)."""
        if self._spread is not None:
            return np.asarray((self._spread @ np.ravel(u)).reshape(len(self.node_of), -1))
        return np.asarray(u)[self.node_of]

    def whole(self, u: np.ndarray) -> np.ndarray:
        """Return what `expand` does, and after it what else rows of matrices name on many ranks, (C, dim)."""
        return self.expand(u) if self.sharing is None else np.asarray(u)[self.sharing.node_of]

    def reduce(self, load: np.ndarray) -> np.ndarray:
        """Return forces (R, dim) on the system from forces (N, dim) on the space; a platen has their sum."""
        if self.sharing is not None:
            return self.sharing.reduce(load)
        if self._spread is not None:
            return np.asarray((self._spread.T @ np.ravel(load)).reshape(self.fixed.shape))
        return _summed(load, self.node_of, len(self.coordinates))

    def prescribed_at(self, time: float | None = None) -> np.ndarray:
        """Return the prescribed displacements (R, dim), 0 where free.

        At a time, or (None) by the values that the user's boundary conditions have now.
        """
        return np.where(self.fixed, self._values(time), 0.0)

    def load_at(self, time: float | None = None) -> np.ndarray:
        """Return the load (R, dim), assembled anew.

        At a time, or (None) by the values that the user's constants, functions and boundary conditions have
        now. At a prescribed unknown it is diagonal entry of A times its value.
        """
        stiffness, g = self._eliminated["A"], self.prescribed_at(time)
        load = self.reduce(self._loads(time))
        if g.any():
            load = load - (stiffness.coupling @ g.ravel()).reshape(g.shape)
        return np.where(self.fixed, stiffness.diagonal * g, load)

    def external_load(self, time: float | None = None) -> np.ndarray:
        """Return the load (R, dim) as `load_at` does, without what prescribed displacements strain.

        For bodies of finite strain, whose tangent changes.
        """
        diagonal = self._eliminated["A"].diagonal
        return np.where(self.fixed, diagonal * self.prescribed_at(time), self.reduce(self._loads(time)))

    def support_force(self, velocity: np.ndarray, acceleration: np.ndarray) -> np.ndarray:
        """Return what inertia and damping of moving supports put on the free unknowns, (R, dim)."""
        force = np.zeros(self.fixed.shape)
        for name, rate in (("C", velocity), ("M", acceleration)):
            if name in self._eliminated and rate.any():
                force -= (self._eliminated[name].coupling @ rate.ravel()).reshape(force.shape)
        return force

    def nodal_load(self, time: float | None = None, load: np.ndarray | None = None) -> np.ndarray:
        """Return the forces (N, dim) on the nodes of the space at a time, or check those that are given."""
        return check_load(self._loads(time) if load is None else load, self.points.shape)

    def reactions(self, motion: dict[str, np.ndarray], applied: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the nodes (h,) that supports and platens hold, and their force (h, dim) on each.

        Parameters
        ----------
        motion : {"A": displacement, "C": velocity, "M": acceleration}, each as `whole` gives it
        applied : (N, dim) all other forces
        """
        force = -applied[self._held]
        for name, values in motion.items():
            force += (self._rows[name] @ values.ravel()).reshape(force.shape)
        tied = self._tied[self._held]
        return self._held, np.where(self.fixed[self.node_of[self._held]] | tied[:, None], force, 0.0)

    def resultant(self, name: str, values: np.ndarray, about: np.ndarray) -> np.ndarray:
        """Return the sum of the forces A u, C v or M a and their moment about a point, (3,) or (6,).

        On many ranks, of what is this rank's own.

        Parameters
        ----------
        name : "A", "C" or "M"
        values : (C, dim), as `whole` gives them
        about : (dim,)
        """
        dim = values.shape[1]
        own = slice(None) if self.sharing is None else self.sharing.own
        rigid = self._rigid[name].reshape(-1, dim, self._rigid[name].shape[1])[own]
        whole = np.einsum("nam,na->m", rigid, values[: len(self.node_of)][own])
        centre = np.pad(self._centre - about, (0, 3 - dim))
        shift = np.cross(centre, np.pad(whole[:dim], (0, 3 - dim)))
        return np.concatenate([whole[:dim], whole[dim:] + shift[2 * (dim == 2) :]])

    def function(self, u: np.ndarray) -> fem.Function:
        """Return displacements (R, dim) as a dolfinx function in the space."""
        function = fem.Function(self.space, name="displacement")
        function.x.array[:] = self.expand(u).ravel()
        return function

    def candidates(self, facets: Facets, road: Any = None) -> tuple[np.ndarray, np.ndarray]:
        """Return the nodes (n,) of boundary facets, sorted, and the area (n,) that belongs to each.

        Nodes that a platen shares with them move with the platen and are left out; but where whole facets
        belong to a platen, it is a rigid foot, and the node of it that is lowest stands for all.

        Parameters
        ----------
        facets : indices of facets, as `tags.find(2)` gives them, or the name of a boundary of the body, or
            several names
        road : what they may touch; one node stands for a foot only on a plane that does not turn

        Raises
        ------
        ValueError
            if there are none, they are no outer facets, or a foot tilts or is not above a plane
        """
        indices = facet_indices(facets, self.mesh, self.body, self.sharing is not None)
        nodes = fem.locate_dofs_topological(self.space, self.mesh.topology.dim - 1, indices)
        nodes = np.unique(nodes).astype(np.int64)
        free = ~self._tied[nodes]
        area = nodal_areas(self.space, indices, self.axisymmetric)
        if free.all():
            return nodes, area[nodes]
        feet = self._feet(indices)
        if feet and self.turning is not None and self.turning.any():
            raise ValueError(
                "A platen is the contact boundary, and one tilts; how a rigid face presses on a rigid road "
                "is not determined: give a platen that does not tilt, or a stiff material."
            )
        plane = plane_of(road)
        if feet and plane is None:
            raise ValueError(
                "A platen is the contact boundary, a rigid foot; it needs a plane as a road, or a moving one "
                "that does not turn: take another road, or a stiff material instead of the platen."
            )
        for facets_of, foot in feet:
            lowest = foot[np.argmin(plane.closest(self.points[foot])[0])]
            free |= nodes == lowest
            area[lowest] = nodal_areas(self.space, facets_of, self.axisymmetric)[foot].sum()
        return nodes[free], area[nodes[free]]

    def _feet(self, indices: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
        """Facets of which all nodes are of one platen, and these nodes, for each such platen."""
        if self.sharing is not None:
            return []
        mesh, number = self.mesh, np.empty(len(self.points), dtype=np.int64)
        number[compat.geometry_dofmap(mesh)] = self.cells
        rows = number[dolfinx_mesh.entities_to_geometry(mesh, mesh.topology.dim - 1, indices)]
        platen = self.node_of[rows]
        whole = self._tied[rows].all(axis=1) & (platen == platen[:, :1]).all(axis=1)
        each = [whole & (platen[:, 0] == one) for one in np.unique(platen[whole])]
        return [(indices[here], np.unique(rows[here])) for here in each]

    def gradient(self, u: np.ndarray) -> np.ndarray:
        """Return the gradient du_i / dx_j (cells, dim, dim) in the middle of each cell, of u (N, dim)."""
        return np.asarray(np.einsum("cki,ckj->cij", np.asarray(u)[self.cells], self.shape_gradients))

    @cached_property
    def _tied(self) -> np.ndarray:
        """Which nodes (N,) of the space platens tie to others."""
        return tied_nodes(self.node_of, self.sharing)

    @cached_property
    def shape_gradients(self) -> np.ndarray:
        """Gradients of the shape functions in the middle of each cell, (cells, k, dim)."""
        return shape_gradients(self.points[self.cells])


def constrained(
    space: Any,
    A: sparse.bsr_array,
    loads: Callable[[float | None], np.ndarray],
    fixed: np.ndarray,
    values: Callable[[float | None], np.ndarray],
    node_of: np.ndarray | None = None,
    mass: sparse.bsr_array | None = None,
    damping: sparse.bsr_array | None = None,
    sharing: Sharing | None = None,
    tilts: Sequence[Tilting] = (),
) -> System:
    """Apply supports to assembled matrices, all in the same way.

    Parameters
    ----------
    space : dolfinx function space of N nodes
    A, mass, damping : (N dim, N dim), symmetric
    loads : of the time (None: now), nodal forces (N, dim)
    fixed : (R, dim) which unknowns of the system are prescribed
    values : of the time, prescribed displacements (R, dim)
    node_of : (N,) node of the system that each node of the space becomes; default the node itself
    sharing : how many ranks share the nodes
    tilts : platens that tilt; the last nodes of the system are theirs
    """
    dim = fixed.shape[1]
    if node_of is None:
        node_of = np.arange(len(fixed)) if sharing is None else sharing.node_of
    points = node_positions(space)
    N, R = len(points), len(fixed)
    places, own, tied = node_of, np.arange(N), tied_nodes(node_of[:N], sharing)
    if sharing is not None:
        own = sharing.own
    held = own[(tied | fixed.any(axis=1)[node_of[:N]])[own]]
    coordinates = points
    if sharing is not None:
        counts = sharing.spread(sharing.reduce(np.ones((N, 1))))
        coordinates = sharing.spread(sharing.reduce(points)) / np.maximum(counts, 1.0)
        points = np.concatenate([points, coordinates[places[N:]]])
    elif tied.any():
        counts = np.maximum(np.bincount(node_of, minlength=R), 1)[:, None]
        coordinates = _summed(points, node_of, R) / counts
    spread, turning = (spreading(node_of, tilts), np.zeros(R)) if tilts else (None, None)
    for number, platen in enumerate(tilts, start=R - len(tilts)):
        coordinates[number] = coordinates[node_of[platen.nodes[0]]]
        turning[number] = platen.size  # type: ignore[index]
    centre = _mean(points[own], sharing)
    motions = _rigid_motions(points - centre)
    eliminated, rows, rigid = {}, {}, {}
    for name, matrix in (("A", A), ("M", mass), ("C", damping)):
        if matrix is not None:
            matrix = sparse.bsr_array(matrix, blocksize=(dim, dim))
            rows[name], rigid[name] = block_rows(matrix, held), matrix @ motions
            if sharing is not None:
                matrix = sharing.matrix(matrix)
            elif spread is not None:
                matrix = _on_platens(matrix, spread, fixed)
            elif tied.any():
                matrix = _renumber(matrix, node_of, R)
            eliminated[name] = _eliminate(matrix, fixed)
            if sharing is not None:
                sharing.spread(eliminated[name].diagonal)
    for name, missing, form in (("A", "stiffness", "a(u, v)"), ("M", "mass", "m(u, v)")):
        bare = (eliminated[name].diagonal <= 0) & ~fixed if name in eliminated else np.zeros(1, dtype=bool)
        trouble = ""
        if bare.any():
            node = int(np.argmax(bare.reshape(R, -1).any(axis=1)))
            trouble = (
                f"{np.count_nonzero(bare)} unknowns have no {missing}, the first at node {node}; integrate "
                f"{form} over the whole mesh, or prescribe them."
            )
        refuse(trouble, sharing)
    system = System(
        eliminated["A"].A,
        np.zeros((R, dim)),
        coordinates,
        node_of[:N],
        [],
        fixed,
        space,
        eliminated["M"].A if mass is not None else None,
        eliminated["C"].A if damping is not None else None,
        sharing=sharing,
        turning=turning,
        _spread=spread,
        _loads=loads,
        _values=values,
        _eliminated=eliminated,
        _held=held,
        _rows=rows,
        _rigid=rigid,
        _centre=centre,
    )
    system.load = system.load_at()
    return system


def tied_nodes(node_of: np.ndarray, sharing: Sharing | None) -> np.ndarray:
    """Which nodes (N,) of a space are tied to others; collective where ranks share them."""
    if sharing is None:
        return np.bincount(node_of)[node_of] > 1
    counts = sharing.reduce(np.ones((len(node_of), 1)))
    return sharing.spread(counts)[node_of, 0] > 1.5


def refuse(trouble: str, sharing: Sharing | None) -> None:
    """Raise a ValueError that says what is wrong, if anything is; on all ranks that share a system."""
    if sharing is not None:
        sharing.exchange.agree(trouble)
    if trouble:
        raise ValueError(trouble)


def _mean(points: np.ndarray, sharing: Sharing | None) -> np.ndarray:
    """Mean (dim,) of points (N, dim), each counted once on all ranks."""
    if sharing is None:
        return np.asarray(points.mean(axis=0))
    total, count = (sharing.comm.allreduce(x) for x in (points.sum(axis=0), len(points)))
    return np.asarray(total / count)


def shape_gradients(corners: np.ndarray) -> np.ndarray:
    """Gradients (cells, k, dim) of the shape functions in the middle of cells of corners (cells, k, dim)."""
    _, k, dim = corners.shape
    reference: np.ndarray
    if k == dim + 1:
        reference = np.vstack([-np.ones(dim), np.eye(dim)])
    else:
        corner = np.arange(2**dim)[:, None] >> np.arange(dim) & 1
        reference = (2 * corner - 1) * 0.5 ** (dim - 1)
    jacobian = np.einsum("cki,kj->cij", corners, reference)
    return np.einsum("kj,cji->cki", reference, np.linalg.inv(jacobian))


def check_load(load: Any, shape: tuple[int, int]) -> np.ndarray:
    """Return nodal forces as floats, or refuse them (TypeError, ValueError)."""
    if not isinstance(load, np.ndarray | list | tuple | Real):
        raise TypeError(
            f"The load is a {type(load).__name__}; give a linear form L(v), a function of the time, or an "
            f"array {shape} of forces on the nodes."
        )
    force = numbers("load", load)
    if force.shape != shape:
        raise ValueError(f"The load has the shape {force.shape}; these nodes need forces of {shape}.")
    if not np.isfinite(force).all():
        raise ValueError("The load has entries that are not finite numbers.")
    return force


def _on_platens(matrix: sparse.bsr_array, spread: sparse.bsr_array, fixed: np.ndarray) -> sparse.bsr_array:
    """The matrix of a system with platens that tilt; unknowns without a motion get a diagonal."""
    dim = fixed.shape[1]
    reduced = sparse.csr_array(spread.T @ matrix @ spread)
    bare = np.where((reduced.diagonal() == 0.0) & fixed.ravel(), float(matrix.diagonal().mean()), 0.0)
    reduced = sparse.bsr_array(reduced + sparse.diags_array(bare), blocksize=(dim, dim))
    reduced.sort_indices()
    return reduced


def _summed(values: np.ndarray, node_of: np.ndarray, R: int) -> np.ndarray:
    summed = np.zeros((R, values.shape[1]))
    np.add.at(summed, node_of, values)
    return summed


def _rigid_motions(x: np.ndarray) -> np.ndarray:
    """Translations and turns (N dim, 3 or 6) about the origin of points (N, dim)."""
    N, dim = x.shape
    axes = [(0, 1)] if dim == 2 else [(1, 2), (2, 0), (0, 1)]
    motions = np.zeros((N, dim, dim + len(axes)))
    motions[:, range(dim), range(dim)] = 1.0
    for k, (a, b) in enumerate(axes):
        motions[:, a, dim + k], motions[:, b, dim + k] = -x[:, b], x[:, a]
    return motions.reshape(N * dim, dim + len(axes))


def _renumber(A: sparse.bsr_array, node_of: np.ndarray, R: int) -> sparse.bsr_array:
    """Add up the blocks of nodes that have become one."""
    rows = np.repeat(node_of, np.diff(A.indptr))
    key = rows.astype(np.int64) * R + node_of[A.indices]
    order = np.argsort(key, kind="stable")  # quick: nearly sorted already
    key = key[order]
    start = np.flatnonzero(np.concatenate([[True], key[1:] != key[:-1]]))
    data = np.add.reduceat(A.data[order], start, axis=0)
    rows, columns = np.divmod(key[start], R)
    indptr = np.concatenate([[0], np.cumsum(np.bincount(rows, minlength=R))])
    dim = A.blocksize[0]
    columns, indptr = columns.astype(np.int32), indptr.astype(np.int32)
    return sparse.bsr_array((data, columns, indptr), shape=(R * dim, R * dim))


def _eliminate(A: sparse.bsr_array, fixed: np.ndarray) -> Eliminated:
    """Leave prescribed unknowns a diagonal entry alone, and keep what they act on others with."""
    dim = A.blocksize[0]
    diagonal = A.diagonal().reshape(fixed.shape)
    if not fixed.any():
        return Eliminated(A, sparse.csr_array(A.shape), diagonal)
    rows = np.repeat(np.arange(len(fixed)), np.diff(A.indptr))
    held = fixed.any(axis=1)
    near = np.flatnonzero(held[rows] | held[A.indices])
    data = A.data.copy()
    rows, columns = rows[near], A.indices[near]
    row_fixed, column_fixed = fixed[rows][:, :, None], fixed[columns][:, None, :]
    acting = np.where(column_fixed & ~row_fixed, data[near], 0.0)
    b, i, j = np.nonzero(acting)
    places = (rows[b] * dim + i, columns[b] * dim + j)
    coupling = sparse.csr_array(sparse.coo_array((acting[b, i, j], places), shape=A.shape))
    blocks = np.where(row_fixed | column_fixed, 0.0, data[near])
    own, component = np.nonzero((rows == columns)[:, None] & fixed[rows])
    blocks[own, component, component] = diagonal[rows[own], component]
    data[near] = blocks
    return Eliminated(sparse.bsr_array((data, A.indices, A.indptr), shape=A.shape), coupling, diagonal)
