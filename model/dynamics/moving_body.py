"""A body in motion above a road: the semi-discrete equation M u'' + C u' + K u = load + contact forces."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from scipy.sparse import bsr_array, issparse

from model.node_loop.blocks import block_matrix, defect
from model.node_loop.friction_laws import FrictionLaw, coulomb
from model.node_loop.node_loop import uncoupled_unknowns
from model.problem.rigid_modes import rigid_motions

Load = np.ndarray | Callable[[float], np.ndarray]


@dataclass
class MovingBody:
    """What the time integrators need to know; N nodes, n of which may touch, d = 2 or 3.

    Units are the user's own, as long as they agree (kg, m, s and N, say).

    Parameters
    ----------
    M, K : sparse (N d, N d)
        Mass and stiffness, symmetric; a prescribed unknown keeps a row and column with a lone diagonal entry
        in every matrix, and stays at its initial value.
    load : (N, d), or callable of the time that returns it
        Nodal forces; at a prescribed unknown, diagonal entry of K times its value.
    coordinates : (N, d)
        Node positions at zero displacement.
    contact_nodes : (n,)
        Nodes that may touch the road.
    road : Road
        Its `closest(points)` returns gap, normal and closest point.
    C : sparse (N d, N d), optional
        Damping, symmetric and positive semi-definite.
    friction : FrictionLaw, float or None
        A law, Coulomb's coefficient, or None for a frictionless road. Laws that ask for it get the slip
        speed.
    prolongations : sequence of sparse
        Nested meshes, finest first; for the multigrid correction only.
    node_of : (nodes of the mesh,), optional
        Node that each node of a mesh has become where platens tie some together; default the node itself.

    Raises
    ------
    ValueError
        If matrices or load do not fit the nodes or are not finite.
    """

    M: Any
    K: Any
    load: Load
    coordinates: np.ndarray
    contact_nodes: np.ndarray
    road: Any
    C: Any = None
    friction: FrictionLaw | float | None = None
    prolongations: Any = ()
    node_of: np.ndarray | None = None
    dim: int = field(init=False)

    def __post_init__(self) -> None:
        """Check at the door, so that no step need."""
        self.coordinates = np.array(self.coordinates, dtype=np.float64, ndmin=2)
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
        self.contact_nodes = np.asarray(self.contact_nodes, dtype=np.int64).ravel()
        if self.friction is not None and not isinstance(self.friction, FrictionLaw):
            self.friction = coulomb(self.friction)
        self._at_rest = self.coordinates[self.contact_nodes]
        self._K, self._C = block_matrix(self.K), None if self.C is None else block_matrix(self.C)
        self._defect = defect(self.dim)
        force = self.load_at(0.0)
        if force.shape != (N, self.dim) or not np.all(np.isfinite(force)):
            raise ValueError(f"The load must be {N} x {self.dim} finite nodal forces.")

    @classmethod
    def from_forms(
        cls,
        elasticity: Any,
        density: float,
        load: np.ndarray,
        road: Any,
        boundary: str,
        support: Any = None,
        damping: tuple[float, float] | None = None,
        friction: FrictionLaw | float | None = None,
    ) -> "MovingBody":
        """Assemble mass, stiffness and, if asked for, damping of an elastic body.

        >>> MovingBody.from_forms(elasticity, 1.0, load, Plane(), "outer", friction=0.1)  # doctest: +SKIP

        Parameters
        ----------
        elasticity : forms.Elasticity
        density : float
            Mass per volume.
        load : (nodes of the mesh, d)
            Nodal forces.
        road : Road
        boundary : str
            Boundary that may touch; nodes that a platen shares with it are left out.
        support : forms.Support, optional
        damping : (alpha, beta), optional
            Rayleigh's, C = alpha M + beta K.
        friction : FrictionLaw, float or None
        """
        body = elasticity.body
        nodes, nothing = body.nodes(boundary), np.zeros_like(load)
        K, M = elasticity.stiffness(), elasticity.mass(density)
        C = None if damping is None else elasticity.damping(*damping, density)
        if support is None:
            return cls(M, K, load, body.coordinates, nodes, road, C, friction, body.prolongations)
        system = support.apply(K, load)
        M = support.apply(M, nothing).A
        C = None if C is None else support.apply(C, nothing).A
        nodes = nodes[np.bincount(system.node_of)[system.node_of[nodes]] == 1]
        return cls(
            M,
            system.A,
            system.load,
            system.coordinates,
            system.node_of[nodes],
            road,
            C,
            friction,
            system.prolongations,
            system.node_of,
        )

    def expand(self, values: np.ndarray) -> np.ndarray:
        """Return what a field (N, d) is at the nodes of the mesh."""
        return values if self.node_of is None else values[self.node_of]

    def load_at(self, time: float) -> np.ndarray:
        """Nodal forces (N, d) at a time."""
        force = self.load(time) if callable(self.load) else self.load
        return np.asarray(force, dtype=np.float64)

    def missing_force(self, time: float, u: np.ndarray, v: np.ndarray | None = None) -> np.ndarray:
        """Load less elastic and damping forces, (N, d), at displacement `u` and velocity `v` (N, d)."""
        r = np.empty(u.shape)
        self._defect(self._K, self.load_at(time), self._strained(u), r)
        if self._C is not None and v is not None:
            self._defect(self._C, r.copy(), v, r)
        return r

    def strain_energy(self, u: np.ndarray) -> float:
        """Elastic energy at displacement u (N, d)."""
        x = self._strained(u).ravel()
        return 0.5 * float(x @ (self.K @ x))

    def gaps(self, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Gap (n,) to the road and normal (n, d) of the nodes that may touch, at displacement u (N, d)."""
        gap, normal, _ = self.road.closest(self._at_rest + u[self.contact_nodes])
        return gap, normal

    @cached_property
    def size(self) -> float:
        """A length that rounding errors of positions can be measured by."""
        return float(np.abs(self.coordinates).max() + np.ptp(self.coordinates, axis=0).max())

    @cached_property
    def prescribed(self) -> np.ndarray:
        """Which unknowns (N, d) are prescribed."""
        return uncoupled_unknowns(self._K)

    @cached_property
    def floats(self) -> bool:
        """Whether the body can be moved without straining it: then a common translation is left out of K u.

        A body that has travelled far would otherwise owe all its strain to rounding errors.
        """
        ones = np.tile(np.eye(self.dim), (self.coordinates.shape[0], 1))
        return bool(np.abs(self.K @ ones).max() < 1e-10 * np.abs(self.K.data).max())

    def _strained(self, u: np.ndarray) -> np.ndarray:
        return u - u[0] if self.floats else u


class RigidPart:
    """The rigid part of a motion, by projection with a mass matrix: what is left is deformation.

    Parameters
    ----------
    M : sparse (N d, N d)
    coordinates : (N, d)
    """

    def __init__(self, M: Any, coordinates: np.ndarray):
        N, d = coordinates.shape
        self.motions = rigid_motions(coordinates).reshape(N * d, -1)
        self._size = np.abs(coordinates - coordinates.mean(axis=0)).max() or 1.0
        self._weighted = M @ self.motions
        self._gram = self.motions.T @ self._weighted

    def amounts(self, u: np.ndarray) -> np.ndarray:
        """Translation (d,) of the mean of the nodes, then linearised rotation: 1 angle in 2-D, 3 in 3-D."""
        amounts = np.linalg.solve(self._gram, self._weighted.T @ u.ravel())
        amounts[u.shape[1] :] /= self._size
        return amounts

    def deformation(self, u: np.ndarray) -> np.ndarray:
        """What of u (N, d) is not rigid, (N, d)."""
        amounts = np.linalg.solve(self._gram, self._weighted.T @ u.ravel())
        return u - (self.motions @ amounts).reshape(u.shape)
