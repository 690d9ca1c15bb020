"""How a body is held: prescribed displacements and a rigid platen, eliminated symmetrically."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import scipy.sparse as sparse

from checks import function, instance, not_negative, number, refused, said
from forms.sharing import agreed, share, take_levels
from forms.system import System, check_load, constrained
from forms.tilting import Angle, Tilting, prescribed_angles, tilting
from geometry import Body
from geometry.body import narrow

Value = float | Callable[[float], float]
End = Callable[[float], Sequence[float]]


class Support:
    """Supports of a body, collected one by one and applied at once.

    Prescribed displacements are numbers, or functions of the time (or load parameter) that return one.

    Examples
    --------
    >>> from forms import Elasticity, Isotropic
    >>> from geometry import Body, rectangle
    >>> body = Body.from_grid(rectangle(2.0, 1.0, 4, 2))
    >>> elasticity = Elasticity(body, Isotropic(E=1e3, nu=0.3))
    >>> support = Support(body).fix("left", x=0.0).platen("top").fix("top", y=lambda t: -0.01 * t)
    >>> system = support.apply(elasticity.stiffness(), elasticity.body_force((0.0, 0.0)))
    >>> system.A.shape, system.varies
    ((22, 22), True)
    """

    def __init__(self, body: Body):
        instance(Body, body=body)
        self.body = body
        self.value = np.full(body.coordinates.shape, np.nan)
        self.moving: list[tuple[np.ndarray, int, Callable[[float], float], str]] = []
        self.platens: list[np.ndarray] = []
        self.tilting: list[Tilting] = []
        self.springs = np.zeros(body.coordinates.shape)
        self.dashpots = np.zeros(body.coordinates.shape)
        self.ends: list[tuple[np.ndarray, End]] = []

    def fix(
        self,
        name: str | Sequence[str],
        x: Value | None = None,
        y: Value | None = None,
        z: Value | None = None,
    ) -> Support:
        """Prescribe components of the displacement on boundaries; components left out stay free.

        Parameters
        ----------
        name : of a boundary or node set, or of several
        x, y, z : length, or a function of the time (or load parameter) that returns it

        Raises
        ------
        ValueError
            for names that are not there, z in the plane, values that are not finite, or nothing prescribed
        """
        return self._prescribe(self.body.nodes(name), (x, y, z), f"on {name!r}")

    def fix_node(
        self, index: int, x: Value | None = None, y: Value | None = None, z: Value | None = None
    ) -> Support:
        """Prescribe components of the displacement of one node, by its index, as `fix` does.

        Raises
        ------
        ValueError
            for a node that is not there, and as `fix`
        """
        if not isinstance(index, int | np.integer) or isinstance(index, bool):
            raise refused("index", "the number of a node", index)
        if not 0 <= index < len(self.value) and not (index == -1 and self.body.shared is not None):
            raise ValueError(f"There is no node {index}; the body's nodes are 0 to {len(self.value) - 1}.")
        return self._prescribe(np.array([index])[: index + 1], (x, y, z), f"of node {index}")

    def platen(self, name: str | Sequence[str], tilt: Angle | Sequence[Angle] = False) -> Support:
        """Tie the nodes of a boundary, or of several, to each other, as a rigid plate does.

        Parameters
        ----------
        name : of the boundary, or of several
        tilt : by default it translates and does not tilt. True: it tilts as forces will, by small angles. A
            number, or a function of the time (or load parameter): the angle in radians, anticlockwise. In
            space three of these, about the axes x, y and z. What `fix` then prescribes of the whole platen
            is the displacement of its centre, the mean of its nodes.

        Raises
        ------
        ValueError
            for nodes that another platen has, and tilts on many ranks

        Examples
        --------
        >>> from forms import Elasticity, Isotropic
        >>> from geometry import Body, Plane, rectangle
        >>> from model import BodyOnRoad, solve
        >>> elasticity = Elasticity(Body.from_grid(rectangle(2.0, 1.0, 8, 4)), Isotropic(E=1e3, nu=0.0))
        >>> support = Support(elasticity.body).platen("top", tilt=lambda t: 1e-3 * t).fix("top", x=0.0, y=0.0)
        >>> system = elasticity.system(elasticity.body_force((0.0, 0.0)), support)
        >>> contact = BodyOnRoad(system, "left", Plane((-10.0, 0.0), (1.0, 0.0)))
        >>> turned = contact.displacement(solve(contact, time=1.0))[elasticity.body.nodes("top"), 1]
        >>> turned.round(9).tolist()[0] + 0.001 < 1e-12
        True
        """
        nodes = self.body.nodes(name)
        tilted = None if tilt is False else tilting(str(name), nodes, self.body.coordinates[nodes], tilt)
        for other in self.platens:
            if np.intersect1d(nodes, other).size:
                raise ValueError(
                    f"The boundary {name!r} shares nodes with another platen; make them one boundary."
                )
        if tilted is not None:
            if self.body.shared is not None:
                raise ValueError("Platens that tilt are not shared among ranks yet; run on one rank.")
            self.tilting.append(tilted)
        self.platens.append(nodes)
        return self

    def spring(
        self,
        where: int | str | Sequence[str],
        x: float = 0.0,
        y: float = 0.0,
        z: float = 0.0,
        end: End | None = None,
    ) -> Support:
        """Tie a node or boundaries to the ground by springs along the axes.

        Parameters
        ----------
        where : a node, or the name of a boundary, or several; over them the springs are spread evenly
        x, y, z : stiffness of all together, force per length, >= 0
        end : function of the time (or load parameter) that returns the displacement (dim,) of the springs'
            other ends, which pull; default at rest

        Examples
        --------
        >>> from geometry import Body, rectangle
        >>> body = Body.from_grid(rectangle(width=2.0, height=1.0, columns=4, rows=2))
        >>> pulled = Support(body).spring("right", x=50.0, end=lambda t: (0.1 * t, 0.0))
        >>> float(pulled.springs.sum())
        50.0
        """
        stiffness = self._spread(where, (x, y, z), "stiffness of the springs")
        self.springs += stiffness
        if end is not None:
            function(end=end)
            self.ends.append((stiffness, end))
        return self

    def dashpot(
        self, where: int | str | Sequence[str], x: float = 0.0, y: float = 0.0, z: float = 0.0
    ) -> Support:
        """Tie a node or boundaries to the ground by dashpots.

        Parameters
        ----------
        where : a node, or one or several names, as for `spring`
        x, y, z : force per velocity, >= 0, or ValueError is raised
        """
        self.dashpots += self._spread(where, (x, y, z), "damping of the dashpots")
        return self

    def apply(
        self,
        A: sparse.bsr_array,
        load: np.ndarray | Callable[[float], np.ndarray],
        mass: sparse.bsr_array | None = None,
        damping: sparse.bsr_array | None = None,
        stress: Callable[[np.ndarray], np.ndarray] | None = None,
    ) -> System:
        """Return the system with these supports.

        Parameters
        ----------
        A, mass, damping : (N dim, N dim), symmetric, in dim x dim blocks
        load : (N, dim) nodal forces, or a function of the time (or load parameter) that returns them
        stress : of displacements (N, dim), for output; see `forms.Elasticity.system`

        Raises
        ------
        ValueError
            if the sizes do not fit, entries are not finite, or a platen has two different prescribed
            displacements.
        """
        N, dim = self.body.coordinates.shape
        first = check_load(load(0.0) if callable(load) else load, (N, dim))
        for name, matrix in {"A": A, "mass": mass, "damping": damping}.items():
            if matrix is None and name != "A":
                continue
            if not sparse.issparse(matrix) or matrix.shape != (N * dim, N * dim):
                raise refused(name, f"a sparse matrix ({N * dim}, {N * dim})", matrix)
            if not np.isfinite(matrix.data).all():
                raise ValueError(f"The matrix {name} has entries that are not finite numbers.")
        if stress is not None:
            function(stress=stress)
        A = _with_diagonal(A, self.springs)
        if self.dashpots.any():
            damping = _with_diagonal(A * 0 if damping is None else damping, self.dashpots)
        shared = self.body.shared
        levels: list[Any] = []
        matrices = [matrix for matrix in (A, mass, damping) if matrix is not None]
        if shared is None:
            sharing = None
            node_of, chosen = _collapse(len(self.value), self.platens)
            R = len(chosen) + len(self.tilting)
        else:
            sharing, levels = share(shared, matrices, self.platens)
            node_of, R = sharing.node_of, len(sharing.ids)
        given, moving, ends = self.value.copy(), list(self.moving), list(self.ends)
        tilts = list(self.tilting)

        def values(time: float | None) -> np.ndarray:
            value = given.copy()
            for nodes, component, motion, where in moving:
                value[nodes, component] = _finite(motion(0.0 if time is None else time), where)
            whole, value = value, _of_system(value, node_of, R)
            for own, platen in enumerate(tilts, start=R - len(tilts)):
                _require_whole(whole[platen.nodes], platen.name)
                value[own] = prescribed_angles(platen, 0.0 if time is None else time)
            return value if sharing is None else agreed(value, sharing)

        def loads(time: float | None) -> np.ndarray:
            now: Any = load(0.0 if time is None else time) if callable(load) else first
            for stiffness, end in ends:
                now = now + stiffness * np.asarray(end(0.0 if time is None else time), dtype=float)
            return check_load(now, (N, dim))

        fixed = ~np.isnan(values(None))
        system = constrained(
            self.body.space, A, loads, fixed, values, node_of, mass, damping, sharing=sharing, tilts=tilts
        )
        turning = any(callable(angle) for platen in tilts for angle in platen.angles)
        system.varies = bool(moving or ends) or callable(load) or turning
        system.body, system.stress = self.body, stress
        if sharing is None and not tilts:
            system.prolongations = self._prolongations(chosen)
        elif sharing is not None:
            take_levels(system, levels)
        return system

    def _prescribe(self, nodes: np.ndarray, components: Sequence[Value | None], where: str) -> Support:
        dim = self.body.dim
        if dim == 2 and components[2] is not None:
            raise ValueError(f"A displacement z is prescribed {where}, but this body is in the plane.")
        if all(c is None for c in components):
            raise ValueError(
                f"No displacement is prescribed {where}; give at least one of {'x, y, z'[: 3 * dim - 2]}."
            )
        for component, value in enumerate(components):
            if value is None:
                continue
            if callable(value):
                self.moving.append((nodes, component, value, f"{'xyz'[component]} {where}"))
            else:
                self.value[nodes, component] = _finite(value, f"{'xyz'[component]} {where}")
        return self

    def _spread(self, where: int | str | Sequence[str], values: Sequence[float], what: str) -> np.ndarray:
        """Share values of all together (3,) among the nodes of boundaries by their area, (N, dim)."""
        N, dim = self.body.coordinates.shape
        not_negative(**{f"{axis} ({what} at {where!r})": value for axis, value in zip("xyz", values)})
        if not any(values[:dim]) or any(values[dim:]):
            along = "x, y, z"[: 3 * dim - 2]
            raise ValueError(f"The {what} at {where!r} is {values}; give some along {along}.")
        share = np.zeros(N)
        if isinstance(where, bool):
            raise refused("where", "a node, or names of boundaries", where)
        if isinstance(where, int | np.integer):
            if not 0 <= where < N and not (where == -1 and self.body.shared is not None):
                raise ValueError(f"There is no node {where}; the body's nodes are 0 to {N - 1}.")
            share[where] = float(where >= 0)
        else:
            rows = self.body.facet_nodes(where)
            np.add.at(share, rows, (_areas(self.body.coordinates[rows]) / rows.shape[1])[:, None])
        return share[:, None] / self.body.total(share[:, None]) * np.asarray(values[:dim], dtype=float)

    def _prolongations(self, chosen: np.ndarray) -> list[sparse.csr_array]:
        """Prolongations between the meshes with each platen as one node on all of them.

        A node of the platen that is new on its mesh is the mean of coarse nodes of the platen, so its row
        collapses to a weight of 1 on the coarse platen by itself.
        """
        reduced = []
        tied = self.platens
        for P in self.body.prolongations if tied else []:
            coarse_of_copy = np.full(P.shape[0], -1)  # the coarse node that sits on each fine node, if any
            copies = np.flatnonzero(np.diff(P.indptr) == 1)
            coarse_of_copy[copies] = P.indices[P.indptr[copies]]
            tied = [np.sort(coarse_of_copy[nodes][coarse_of_copy[nodes] >= 0]) for nodes in tied]
            coarse_of, coarse_chosen = _collapse(P.shape[1], tied)
            rows = P[chosen]
            shape = (len(chosen), len(coarse_chosen))
            Q = sparse.csr_array((rows.data, coarse_of[rows.indices], rows.indptr), shape=shape)
            Q.sum_duplicates()
            reduced.append(narrow(Q))
            chosen = coarse_chosen
        return reduced if self.platens else list(self.body.prolongations)


def _collapse(N: int, groups: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Make one node of each group; return the new number of each node, the first node of each number."""
    first = np.arange(N)
    for nodes in groups:
        first[nodes] = nodes[0]
    chosen, node_of = np.unique(first, return_inverse=True)
    return node_of, chosen


def _areas(corners: np.ndarray) -> np.ndarray:
    """Lengths or areas (m,) of facets of corners (m, k, dim), quadrilaterals in dolfinx's order."""
    first, last = corners[:, 0], corners[:, -1]
    if corners.shape[1] == 2:
        return np.linalg.norm(last - first, axis=1)
    across = corners[:, 2] - corners[:, 1] if corners.shape[1] == 4 else corners[:, 1] - first
    return np.linalg.norm(np.cross(last - first, across), axis=1) / 2


def _with_diagonal(A: sparse.bsr_array, values: np.ndarray) -> sparse.bsr_array:
    """Add values (N, dim) to the diagonal of a matrix; nothing is copied where they are zero."""
    if not values.any():
        return A
    return sparse.bsr_array(A + sparse.diags_array(values.ravel()), blocksize=(values.shape[1],) * 2)


def _require_whole(value: np.ndarray, name: str) -> None:
    """Refuse displacements (k, dim) that are prescribed at some nodes of a platen that tilts."""
    given = ~np.isnan(value)
    if (given.any(axis=0) & ~given.all(axis=0)).any():
        raise ValueError(
            f"Some nodes of the platen {name}, which tilts, are prescribed by another boundary; prescribe "
            "the whole platen, which is its centre, or leave its nodes out of that boundary."
        )


def _finite(value: float, where: str) -> float:
    if not np.isfinite(number(value)):
        raise ValueError(f"The prescribed displacement {where} is {said(value)}; it must be a finite number.")
    return number(value)


def _of_system(value: np.ndarray, node_of: np.ndarray, R: int) -> np.ndarray:
    """From prescribed displacements (N, dim) of the body those (R, dim) of the system, NaN where free."""
    low, high = np.full((R, value.shape[1]), np.inf), np.full((R, value.shape[1]), -np.inf)
    nodes, components = np.nonzero(~np.isnan(value))
    where = (node_of[nodes], components)
    np.minimum.at(low, where, value[nodes, components])
    np.maximum.at(high, where, value[nodes, components])
    if np.any((high > low) & np.isfinite(high)):
        raise ValueError(
            "Two nodes of one platen have different prescribed displacements; give them the same."
        )
    return np.where(np.isfinite(low), low, np.nan)
