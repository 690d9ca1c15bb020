"""A body in motion above a road: the semi-discrete equation M u'' + C u' + K u = load + contact forces."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy.sparse import bsr_array, issparse

from checks import is_contact, is_road, node_numbers, numbers
from model.node_loop.blocks import block_matrix, defect
from model.node_loop.friction_laws import as_law
from model.node_loop.node_loop import uncoupled_unknowns
from model.one_rank import ONE_RANK
from model.problem.contact_problem import ContactProblem, length_scale
from model.problem.held_below_road import held_along
from model.problem.linear_limits import LinearLimits
from model.problem.rigid_modes import centre_and_size, rigid_motions
from model.problem.varying_friction import placed
from model.ranks.shared_problem import SharedProblem

UNSTRAINED = 1e-10  # of the largest stiffness: a translation that meets less meets rounding, no support
Load = np.ndarray | Callable[[float], np.ndarray]


@dataclass
class MovingBody:
    """What the time integrators need to know; N nodes, n of which may touch, d = 2 or 3.

    Units are the user's own, as long as they agree (kg, m, s and N, say).

    Parameters
    ----------
    M, K : sparse (N d, N d)
        Mass and stiffness, symmetric; a prescribed unknown keeps a row and column with a diagonal entry alone
        in every matrix.
    load : (N, d), or callable of the time that returns it
        Nodal forces; at a prescribed unknown, diagonal entry of K times its value: so supports are held, or
        moved as a function of time, their velocity and acceleration by differences over a step.
    coordinates : (N, d)
        Node positions at zero displacement.
    contact_nodes : (n,)
        Nodes that may touch the road.
    road : Road
        Its `closest(points)` returns gap, normal and closest point. One that moves, say a `MovingRoad`, has
        `at(time)`, the road as it is then, and `carried(points, start, end)`: where points that go with it
        come to be.
    C : sparse (N d, N d), optional
        Damping, symmetric and positive semi-definite.
    friction : FrictionLaw, float or None
        A law, Coulomb's coefficient, or None for a frictionless road; as for `BodyOnRoad` it may vary. Laws
        that ask for it get the slip speed.
    prolongations : sequence of sparse
        Nested meshes, finest first; for the multigrid correction only.
    node_of : (nodes of the mesh,), optional
        Node that each node of a mesh has become where platens tie some together; default the node itself.
    motion : callable, optional
        Of the time: prescribed displacements (N, d); default what the load says of them.
    support_force : callable, optional
        Of velocity and acceleration (N, d) of moving supports: what their inertia and damping put on the free
        unknowns, (N, d).
    limits : LinearLimits, optional
        Looks at the displacement after each step, and says once where linear strain is not true to it.
    exchanges, ids : sequences, optional
        Where many ranks share the body, as for `SharedProblem`: N are then the nodes held here, the owned
        ones first, rows of the others are empty, and the n candidates are owned.
    points : (n, d), optional
        Positions of the nodes that may touch, at zero displacement; default their coordinates. For a rigid
        foot, which is one node, that of its lowest point.

    Raises
    ------
    ValueError
        If matrices or load do not fit the nodes or are not finite.

    Examples
    --------
    >>> from forms import Elasticity, Isotropic
    >>> from geometry import Body, Plane, rectangle
    >>> from model import MovingBody, Newmark
    >>> elasticity = Elasticity(Body.from_grid(rectangle(2.0, 1.0, 4, 2)), Isotropic(E=1e4, nu=0.3))
    >>> weight = elasticity.body_force((0.0, -10.0))
    >>> scheme = Newmark(MovingBody.from_forms(elasticity, 1.0, weight, Plane(), "bottom"), dt=0.01)
    >>> state = scheme.run(scheme.start(), 3)
    >>> state.step, bool(state.gap.min() == 0.0)
    (3, True)
    """

    M: Any
    K: Any
    load: Load
    coordinates: np.ndarray
    contact_nodes: np.ndarray
    road: Any
    C: Any = None
    friction: Any = None
    prolongations: Any = ()
    node_of: np.ndarray | None = None
    motion: Callable[[float], np.ndarray] | None = None
    support_force: Callable[[np.ndarray, np.ndarray], np.ndarray] | None = None
    limits: Any = None
    exchanges: Any = ()
    ids: Any = ()
    points: np.ndarray | None = None
    dim: int = field(init=False)
    finite_strain = False  # so that every scheme knows whom it moves

    def __post_init__(self) -> None:
        """Check at the door, so that no step need."""
        self.coordinates = np.atleast_2d(numbers("coordinates", self.coordinates)).copy()
        N, self.dim = self.coordinates.shape
        size = N * self.dim
        for name in ("M", "K", "C"):
            A = getattr(self, name)
            if A is None and name == "C":
                continue
            if not issparse(A) or A.shape != (size, size):
                shape = getattr(A, "shape", None)
                raise ValueError(f"{name} must be a sparse ({size}, {size}) matrix, not of shape {shape}.")
            if not np.all(np.isfinite(A.data)):
                raise ValueError(f"{name} has entries that are not finite.")
            A = bsr_array(A, blocksize=(self.dim, self.dim))
            A.sort_indices()
            setattr(self, name, A)
        is_road(self.road)
        self.contact_nodes = node_numbers(self.contact_nodes)
        self.friction = as_law(self.friction)
        self._at_rest = self.coordinates[self.contact_nodes] if self.points is None else self.points
        self._K, self._C = block_matrix(self.K), None if self.C is None else block_matrix(self.C)
        self._defect = defect(self.dim)
        force = self.load_at(0.0)
        if force.shape != (N, self.dim) or not np.all(np.isfinite(force)):
            raise ValueError(f"The load must be {N} x {self.dim} finite nodal forces.")

    @classmethod
    def from_contact(cls, contact: Any) -> "MovingBody":
        """Set a scene of statics in motion.

        Parameters
        ----------
        contact : BodyOnRoad
            Of a system with mass, and damping if there is any:
            `forms.assemble(a, L, bcs, mass=m, damping=c)`. Supports are those of the system, in all matrices.
            A load or prescribed displacements that depend on time are read at the times of the steps.

        Raises
        ------
        ValueError
            If the system has no mass.

        Examples
        --------
        >>> from forms import Elasticity, Isotropic, Support
        >>> from geometry import Body, Plane, rectangle
        >>> from model import BodyOnRoad, MassRedistribution
        >>> elasticity = Elasticity(Body.from_grid(rectangle(2.0, 1.0, 4, 4)), Isotropic(E=1e4, nu=0.3))
        >>> support = Support(elasticity.body).fix("top", x=0.0, y=lambda t: -0.01 * t)
        >>> system = elasticity.system(elasticity.body_force((0.0, 0.0)), support, density=1.0)
        >>> body = MovingBody.from_contact(BodyOnRoad(system, "bottom", Plane()))
        >>> scheme = MassRedistribution(body, dt=0.01)
        >>> state = scheme.run(scheme.start(), 10)
        >>> float(state.displacement[:, 1].min().round(6))
        -0.001
        """
        is_contact(contact)
        return cls._of(contact.system, contact.nodes, contact.road, contact.problem.friction, contact.limits)

    @classmethod
    def from_forms(
        cls,
        elasticity: Any,
        density: float,
        load: Load,
        road: Any,
        boundary: str | Sequence[str],
        support: Any = None,
        damping: tuple[float, float] | None = None,
        friction: Any = None,
    ) -> "MovingBody":
        """Assemble mass, stiffness and, if asked for, damping of an elastic body.

        Parameters
        ----------
        elasticity : forms.Elasticity
        density : float
            Mass per volume.
        load : (nodes of the mesh, d), or callable of the time that returns it
            Nodal forces.
        road : Road
        boundary : str or sequence of str
            Boundary that may touch; nodes that a platen shares with it are left out.
        support : forms.Support, optional
        damping : (alpha, beta), optional
            Rayleigh's, C = alpha M + beta K.
        friction : FrictionLaw, float or None
        """
        system = elasticity.system(load, support, density, damping)
        limits = LinearLimits(system.shape_gradients, system.cells)
        return cls._of(system, system.candidates(boundary, road)[0], road, friction, limits)

    @classmethod
    def _of(cls, system: Any, nodes: np.ndarray, road: Any, friction: Any, limits: Any) -> "MovingBody":
        if system.elastic is not None and not cls.finite_strain:
            raise ValueError(
                "The system is one of finite strain (Hyperelasticity), which a MovingBody would take for a "
                "linear one; take FiniteBody."
            )
        if system.turning is not None:
            raise ValueError("A platen that tilts is there for bodies at rest only; leave its tilt out.")
        if system.M is None:
            raise ValueError("The system has no mass; give forms.assemble(..., mass=m) the form m(u, v).")
        friction = placed(friction, system, nodes, road)
        shared = len(system.exchanges) > 0
        tied = shared or len(system.node_of) > len(system.coordinates)
        points, nodes = system.points[nodes], system.node_of[nodes]
        return cls(
            system.M,
            system.A,
            system.load_at if system.varies else system.load_at(),
            system.coordinates,
            nodes[nodes < system.exchanges[0].owned] if shared else nodes,
            road,
            system.C,
            friction,
            system.prolongations,
            system.node_of if tied else None,
            system.prescribed_at if system.varies or shared else None,
            system.support_force if system.varies else None,
            limits,
            system.exchanges,
            system.ids,
            None if shared else points,
        )

    @property
    def ranks(self) -> Any:
        """Who shares the body."""
        return self.exchanges[0] if self.exchanges else ONE_RANK

    def expand(self, values: np.ndarray) -> np.ndarray:
        """Return what a field (N, d) is at the nodes of the mesh."""
        return values if self.node_of is None else values[self.node_of]

    def load_at(self, time: float) -> np.ndarray:
        """Nodal forces (N, d) at a time."""
        force = self.load(time) if callable(self.load) else self.load
        return np.asarray(force, dtype=np.float64)

    def missing_force(self, time: float, u: np.ndarray, v: np.ndarray | None = None) -> np.ndarray:
        """Load less elastic and damping forces, (N, d), at displacement `u` and velocity `v` (N, d).

        None is missing at prescribed unknowns.
        """
        r = np.empty(u.shape)
        self._defect(self._K, self.load_at(time), self._strained(u), r)
        if self._C is not None and v is not None:
            self._defect(self._C, r.copy(), v, r)
        if self.supported:
            r[self.prescribed] = 0.0
        self.ranks.update(r)
        return r

    def problem(
        self,
        A: Any,
        b: np.ndarray,
        nodes: np.ndarray,
        normal: np.ndarray,
        gap: np.ndarray,
        friction: Any = True,
        reference: np.ndarray | None = None,
    ) -> Any:
        """Return the contact problem of the body with another matrix A, for some of its candidates.

        `friction` is whether there is any, or another law than the body's.
        """
        law = (self.friction if friction else None) if isinstance(friction, bool) else friction
        given = (A, b, self.coordinates, nodes, normal, gap, law, reference, self.prolongations)
        if self.exchanges:
            return SharedProblem(*given, exchanges=self.exchanges, ids=self.ids)
        return ContactProblem(*given)

    def prescribed_at(self, time: float) -> np.ndarray:
        """Displacements (N, d) of prescribed unknowns at a time, 0 at others."""
        if self.motion is not None:
            return np.where(self.prescribed, self.motion(time), 0.0)
        return self.load_at(time) / self._resistance

    def prescribed_rates(self, time: float, dt: float) -> tuple[np.ndarray, np.ndarray]:
        """Velocity and acceleration (N, d) of prescribed unknowns, by differences of second order over dt.

        Central ones; at the start, before which nothing is known of the motion, forward ones.
        """
        if not self.supports_move:
            return np.zeros_like(self.coordinates), np.zeros_like(self.coordinates)
        h, before = 0.5 * dt, time < 0.5 * dt
        g = [self.prescribed_at(time + h * k) for k in ((0, 1, 2, 3) if before else (-1, 0, 1))]
        if before:
            return rates_at_start(g, h)
        return (g[2] - g[0]) / dt, (g[0] - 2.0 * g[1] + g[2]) / h**2

    def in_steps(self, dt: float) -> "MovingBody":
        """Return the body with the inertia and damping of moving supports in its load, for steps of dt."""
        force = self.support_force
        if force is None or not self.supported:
            return self

        def load(time: float) -> np.ndarray:
            return self.load_at(time) + force(*self.prescribed_rates(time, dt))

        return replace(self, load=load, support_force=None)

    def strain_energy(self, u: np.ndarray) -> float:
        """Elastic energy at displacement u (N, d) of what is not prescribed, which is a load on the rest."""
        x = np.where(self.prescribed, 0.0, self._strained(u)).ravel()
        return 0.5 * float(self.ranks.sum(x @ (self.K @ x)))

    def stiffness_at(self, u: np.ndarray) -> Any:
        """Stiffness (N d, N d) at displacement u (N, d)."""
        return self.K

    def positions(self, u: np.ndarray) -> np.ndarray:
        """Positions (n, d) of the nodes that may touch, at displacement u (N, d)."""
        return self._at_rest + u[self.contact_nodes]

    def gaps(self, u: np.ndarray, time: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
        """Gap (n,) to the road at a time and normal (n, d) of the nodes that may touch, at u (N, d)."""
        gap, normal, _ = self.road_at(time).closest(self.positions(u))
        return gap, normal

    @property
    def road_moves(self) -> bool:
        """Whether the road is another one at another time."""
        return hasattr(self.road, "at")

    def road_at(self, time: float) -> Any:
        """Return the road as it is at a time."""
        return self.road.at(time) if self.road_moves else self.road

    def carried(self, points: np.ndarray, start: float, end: float) -> np.ndarray:
        """Where points (n, d) that go with the road from a time on are at another."""
        return self.road.carried(points, start, end) if self.road_moves else points

    def places(self, state: Any) -> np.ndarray:
        """Points (n, d) of the road nearest to the nodes that may touch at a state of motion.

        Of a road that moves, as they lie at time 0.
        """
        foot = self.road_at(state.time).closest(self.positions(state.displacement))[2]
        return np.asarray(self.carried(foot, state.time, 0.0))

    @cached_property
    def size(self) -> float:
        """A length that rounding errors of positions can be measured by."""
        return self.ranks.max(length_scale(self.coordinates))

    @cached_property
    def prescribed(self) -> np.ndarray:
        """Which unknowns (N, d) are prescribed."""
        alone = uncoupled_unknowns(self._K)
        self.ranks.update(alone)
        return alone

    @cached_property
    def supported(self) -> bool:
        """Whether any unknown is prescribed."""
        return self.ranks.any(bool(self.prescribed.any()))

    @cached_property
    def supports_move(self) -> bool:
        """Whether what is prescribed may be another at another time."""
        return self.supported and (callable(self.load) or self.motion is not None)

    @cached_property
    def led(self) -> np.ndarray:
        """Nodes that may touch, (k,) of the n, and that supports may lead below the road."""
        held = self.prescribed[self.contact_nodes]
        if not getattr(self.road, "flat", False):
            return np.flatnonzero(held.any(axis=1))
        normal = self.gaps(np.zeros_like(self.coordinates))[1]
        return np.flatnonzero(held_along(normal, held) & self.supports_move)

    @cached_property
    def floats(self) -> bool:
        """Whether the body can be moved without straining it: then a common translation is left out of K u.

        Of a body that has travelled far, strain would otherwise be rounding error alone.
        """
        ones = np.tile(np.eye(self.dim), (self.coordinates.shape[0], 1))
        ranks = self.ranks
        largest = ranks.max(np.abs(self.K.diagonal()).max())
        return bool(ranks.max(np.abs(self.K @ ones).max()) < UNSTRAINED * largest)

    @cached_property
    def _resistance(self) -> np.ndarray:
        """What a prescribed unknown (N, d) resists by itself, infinity at others."""
        diagonal = self.K.diagonal().reshape(self.coordinates.shape)
        return np.where(self.prescribed, diagonal, np.inf)

    def _strained(self, u: np.ndarray) -> np.ndarray:
        return u - self.ranks.first(u[0]) if self.floats else u


def rates_at_start(g: Sequence[np.ndarray], h: float) -> tuple[np.ndarray, np.ndarray]:
    """Return first and second derivatives at the first of four values, h apart, to second order."""
    return (4.0 * g[1] - 3.0 * g[0] - g[2]) / (2.0 * h), (2.0 * g[0] - 5.0 * g[1] + 4.0 * g[2] - g[3]) / h**2


class RigidPart:
    """The rigid part of a motion, by projection with a mass matrix: what is left is deformation.

    Parameters
    ----------
    M : sparse (N d, N d)
    coordinates : (N, d)
    ranks : Exchange, optional
        Who shares the nodes.
    """

    def __init__(self, M: Any, coordinates: np.ndarray, ranks: Any = ONE_RANK):
        N, d = coordinates.shape
        self.motions = rigid_motions(coordinates, ranks).reshape(N * d, 3 * d - 3)
        self._size = centre_and_size(coordinates, ranks)[1]
        self._weighted, self._ranks = M @ self.motions, ranks
        self._gram = ranks.sum(self.motions.T @ self._weighted)

    def amounts(self, u: np.ndarray) -> np.ndarray:
        """Translation (d,) of the mean of the nodes, then linearised rotation: 1 angle in 2-D, 3 in 3-D."""
        amounts = self._fitted(u)
        amounts[u.shape[1] :] /= self._size
        return amounts

    def deformation(self, u: np.ndarray) -> np.ndarray:
        """What of u (N, d) is not rigid, (N, d)."""
        return u - (self.motions @ self._fitted(u)).reshape(u.shape)

    def _fitted(self, u: np.ndarray) -> np.ndarray:
        return np.linalg.solve(self._gram, self._ranks.sum(self._weighted.T @ u.ravel()))
