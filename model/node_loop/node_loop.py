"""The node loop with its arrays.

One object that relaxes, judges, and is used on fine, coarse and condensed problems alike.
"""

from collections.abc import Callable
from math import sqrt
from time import perf_counter
from typing import Any

import numpy as np
from numba import njit

from model.node_loop.blocks import (
    BlockMatrix,
    diagonal_blocks,
    diagonal_positions,
    generalised_inverses,
    node_order,
)
from model.node_loop.contact_sweep import Candidates, contact_sweeps, frames, place_all_on_surface
from model.node_loop.friction_laws import FrictionLaw
from model.node_loop.natural_residual import natural_residual
from model.node_loop.status import Status
from model.one_rank import ONE_RANK


class NodeLoop:
    """The contact loop on one matrix, for changing loads, gaps and stick positions.

    Parameters
    ----------
    A : BlockMatrix
        Matrix of N block rows of size d.
    contact_nodes : (n,)
        Candidates.
    normal : (n, d)
        Unit normals, from the road into the body.
    friction : FrictionLaw or None
        None compiles and runs the frictionless loop.
    order : (N,), optional
        The order in which nodes are visited.

    Attributes
    ----------
    sweeps : int
        Sweeps done so far.
    springs : (n, d, d) or None
        Stiffness of springs that hold the candidates for the time being; A has it too.
    carry : callable
        Takes over a rigid motion (N, d), from where displacements u (N, d) then count; returns what is left.
    R, force, scale : (N, d), (n, d), float
        What is missing from equilibrium, the admissible contact forces, and the size of the forces at work,
        at the last call of `residual`.
    field_shape : (2,)
        Shape of displacements: (N, d), or with the copies of other ranks' nodes.
    """

    ranks: Any = ONE_RANK

    def __init__(
        self, A: BlockMatrix, contact_nodes: Any, normal: Any, friction: FrictionLaw | None, order: Any = None
    ):
        N, d = A.indptr.size - 1, A.data.shape[1]
        self.A, self.friction, self.shape, self.field_shape = A, friction, (N, d), (N, d)
        self.order = node_order(order, N)
        rows = np.arange(N)
        self.diagonal = np.zeros((N, d, d))
        diagonal_blocks(A, rows, self.diagonal)
        self.inverse = np.empty_like(self.diagonal)
        generalised_inverses(self.diagonal, rows, self.inverse)
        self.uncoupled = uncoupled_unknowns(A)
        self.loaded, self.prescribed = ~self.uncoupled, np.flatnonzero(self.uncoupled)
        own = np.einsum("iaa->ia", self.diagonal)[self.uncoupled]
        # of a coarser mesh, unknowns that the truncation at supports has left nothing stay where they are
        self._prescriber = np.where(own == 0.0, 1.0, own)
        self.nodes = np.asarray(contact_nodes, dtype=np.int64)
        number = np.full(N, -1, dtype=np.int32)
        number[self.nodes] = np.arange(self.nodes.size)
        self.number = number
        self.springs: np.ndarray | None = None
        self.carry: Callable[[np.ndarray, np.ndarray], Any] = lambda motion, u: motion
        self.b = np.zeros((N, d))
        self.update_normals(normal)
        self._sweeps = contact_sweeps(d, friction is not None)
        self._residual = natural_residual(d, friction is not None)
        self._bound = None if friction is None else friction.address
        self.R, self.force = np.zeros((N, d)), np.zeros((self.nodes.size, d))
        self.sweeps, self.slip_rate = 0, 1.0
        self.seconds_of_passes, self.passes = 0.0, 0

    def update_normals(self, normal: np.ndarray) -> None:
        """Set the normals (n, d) of the candidates.

        A node whose motion is prescribed in part meets the road along the rest of the normal:

            g + n . u = (g + n_p . u_p) + n_f . u_f,

        so that n_f, made a unit vector, and the gap in brackets, as many times larger, say the same.
        """
        self.normal = np.asarray(normal, dtype=np.float64)
        alone = self.uncoupled[self.nodes]
        self.given = alone & ~alone.all(axis=1, keepdims=True)
        free = np.where(self.given, 0.0, self.normal)
        part = np.linalg.norm(free, axis=1)
        self.cannot_move = part < 1e-8  # square root of rounding: a normal's square is 1 but for that
        self.part = np.where(self.cannot_move, 1.0, part)
        self.frame = frames(np.where(self.cannot_move[:, None], self.normal, free / self.part[:, None]))
        self.block = np.einsum("cab,cbe,cfe->caf", self.frame, self.diagonal[self.nodes], self.frame)
        # who is prescribed in part and free obliquely to the road, by more than rounding; who is free along a
        # line alone
        self.oblique = self.given.any(axis=1) & ~self.cannot_move & (self.part < 1.0 - 1e-12)
        self.guided = (self.given.sum(axis=1) == self.shape[1] - 1) & ~self.cannot_move

    def put_springs(self, springs: np.ndarray | None) -> None:
        """Hold candidates by springs (n, d, d), or take them away; A and what is made from it follow.

        Unknowns that are prescribed get none.
        """
        if springs is not None:
            free = ~self.uncoupled[self.nodes]
            springs = np.where(free[:, :, None] & free[:, None, :], springs, 0.0)
        elif self.springs is None:
            return
        if self.springs is None:
            self._bare = self.diagonal[self.nodes]
        self.springs = springs
        blocks = self._bare if springs is None else self._bare + springs
        self.A.data[diagonal_positions(self.A)[self.nodes]] = blocks
        self.diagonal[self.nodes] = blocks
        generalised_inverses(self.diagonal, self.nodes, self.inverse)
        self.block = np.einsum("cab,cbe,cfe->caf", self.frame, blocks, self.frame)

    def pull(self, ends: np.ndarray) -> None:
        """Let the springs pull the candidates to displacements `ends` (n, d); the load's size stays."""
        assert self.springs is not None
        self.b = self.b.copy()
        self.b[self.nodes] += np.einsum("cab,cb->ca", self.springs, ends)

    def _rub_guided(self, force: np.ndarray, pressure: np.ndarray, slip: np.ndarray) -> None:
        """Add to forces (n, d) and pressure (n,), in place, the friction of nodes guided along a line.

        Such a node, free along d alone with n . d > 0, is where its gap puts it, with friction or without: it
        holds the force p' along d. Where its slip s (n, d) along the road is not zero, friction opposes it,

            f = p (n - mu s / |s|),     p = p' / (n . d - mu d . s / |s|),

        and the support bears what is across d. A node that does not slip gets no friction: any within the
        cone would do, for the support bears the rest. Where friction would jam it, p < 0, it gets none.
        """
        rounding = 16 * np.finfo(np.float64).eps * np.linalg.norm(slip, axis=1)
        slip = along_road(np.where(self.oblique[:, None] | self.given, slip, 0.0), self.normal)
        size = np.linalg.norm(slip, axis=1)
        rubs = np.flatnonzero(self.guided & (pressure > 0.0) & (size > rounding))
        friction = self.coefficient[rubs, None] * slip[rubs] / size[rubs, None]
        along = np.einsum("ca,ca->c", self.frame[rubs, 0], friction)
        holds = along < self.part[rubs]
        rubs, friction, along = rubs[holds], friction[holds], along[holds]
        pressure[rubs] *= self.part[rubs] / (self.part[rubs] - along)
        force[rubs] = pressure[rubs, None] * (self.normal[rubs] - friction)

    def set_load(
        self,
        b: np.ndarray,
        gap: np.ndarray,
        reference: np.ndarray | None = None,
        state: np.ndarray | None = None,
    ) -> None:
        """Set what changes from step to step.

        Load (N, d), gap (n,), stick position (n, d; global), what the friction law is told (n, 1 + m).
        """
        n, d = self.force.shape
        self.b = b
        if self.given.any():
            u = np.zeros(self.shape)
            self.prescribe(b, u)
            there = u[self.nodes]
            along = np.einsum("ca,ca->c", self.normal, np.where(self.given, there, 0.0))
            gap = (gap + np.where(self.part < 1.0, along, 0.0)) / self.part
            reference = np.where(self.given, there, 0.0 if reference is None else reference)
        local = (
            np.zeros((n, d - 1))
            if reference is None
            else np.einsum("cab,cb->ca", self.frame[:, 1:], reference)
        )
        if state is None:
            state = self.told(np.zeros(n))
        self.contact = Candidates(self.nodes, self.number, self.frame, self.block, gap, local, state)
        self.load_size = length(b[self.loaded] if self.prescribed.size else b)

    def told(self, slipped: np.ndarray, places: np.ndarray | None = None) -> np.ndarray:
        """Return what the friction law is told of the candidates, (n, 1 + m); see `FrictionLaw.nodes`."""
        return slipped[:, None] if self.friction is None else self.friction.nodes(slipped, places)

    @property
    def coefficient(self) -> Any:
        """Coefficients (n,) of friction at rest under the present load, or 0 without friction."""
        return 0.0 if self.friction is None else self.contact.state[:, 1]

    def start(self, u: np.ndarray, status: np.ndarray | None = None) -> np.ndarray:
        """Make `u` (N, d) admissible in place: prescribed unknowns at their values, no node below the road.

        Return the status (n,).
        """
        self.prescribe(self.b, u)
        status = np.zeros(self.nodes.size, dtype=np.int8) if status is None else status.astype(np.int8)
        place_all_on_surface(self.contact, u, status)
        return status

    def prescribe(self, b: np.ndarray, u: np.ndarray) -> None:
        """Set the prescribed unknowns of u (N, d) to their values under the load b (N, d)."""
        u.flat[self.prescribed] = b.flat[self.prescribed] / self._prescriber

    def sweep(self, u: np.ndarray, status: np.ndarray, count: int = 1) -> None:
        """Sweep `count` times over all nodes, updating u (N, d) and status (n,) in place."""
        begin = perf_counter()
        self._sweeps(
            count,
            self.A,
            self.inverse,
            self.b,
            u,
            self.order,
            self.contact,
            status,
            self._bound,
            self.slip_rate,
        )
        self.sweeps += count
        self.seconds_of_passes += perf_counter() - begin
        self.passes += count

    def residual(self, u: np.ndarray, status: np.ndarray) -> float:
        """Natural residual of `u` (N, d), dimensionless: |R| over |load| + |contact force|."""
        begin = perf_counter()
        self._residual(
            self.A, self.b, u, self.contact, status, self._bound, self.slip_rate, self.R, self.force
        )
        missing, self.scale = length(self.R), self.load_size + length(self.force)
        self.seconds_of_passes += perf_counter() - begin
        self.passes += 1
        return 0.0 if missing == 0.0 else missing / (self.scale or missing)

    def reaction(self, slip: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Forces (n, d) of the road on the body at the last residual, and their normal parts (n,), >= 0.

        At a node whose motion is prescribed in part the support takes what the loop does not see: friction
        too, where it is guided along a line and slips by `slip` (n, d).
        """
        pressure = np.maximum(np.einsum("ca,ca->c", self.frame[:, 0], self.force), 0.0)
        if not self.given.any():
            return self.force.copy(), pressure
        pressure /= self.part
        force = self.force + pressure[:, None] * np.where(self.given, self.normal, 0.0)
        if self.friction is not None:
            self._rub_guided(force, pressure, slip)
        return force, pressure

    def confirm(self, status: np.ndarray) -> None:
        """Let nodes touch that lie on the road without having been put there, and press on it, in place."""
        pressure = np.einsum("ca,ca->c", self.frame[:, 0], self.force)
        lies = (status == Status.FREE) & (pressure > 0.0)
        status[lies] = Status.SLIP if self.friction is None else Status.STICK

    def sticking_place(self, numbers: np.ndarray) -> np.ndarray:
        """Displacement (k, d) at which the given candidates stick on the road."""
        contact = self.contact
        tangential = np.einsum("cab,ca->cb", contact.frame[numbers, 1:], contact.reference[numbers])
        return tangential - contact.gap[numbers, None] * contact.frame[numbers, 0]

    def gaps(self, u: np.ndarray, status: np.ndarray) -> np.ndarray:
        """Gaps (n,) at displacement u: exactly zero at nodes in contact."""
        gap = self.contact.gap + np.einsum("ca,ca->c", self.frame[:, 0], u[self.nodes])
        gap[status != Status.FREE] = 0.0
        return gap


def length(x: np.ndarray) -> float:
    """Euclidean norm of an array of any shape and size; quicker on small ones than numpy's."""
    square = np.vdot(x, x)
    if 1e-290 < square < 1e290:  # no square has been lost below 1e-308 or above 1e308
        return sqrt(square)
    largest = float(np.abs(x).max(initial=0.0))
    if not 0.0 < largest < np.inf:
        return largest
    return largest * sqrt(np.vdot(x / largest, x / largest))


def along_road(x: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Return what of vectors x (n, d) is across the unit normals (n, d)."""
    return x - np.einsum("ca,ca,cb->cb", x, normal, normal)


def place_on_road(loop: NodeLoop, u: np.ndarray, status: np.ndarray) -> None:
    """Put whatever is below the road back on it after a correction of u (N, d), to stick or to slip.

    As in the loop, what a node's own stiffness makes of the way back decides: a node drawn from afar to where
    it would stick, if it then slips, disturbs its surroundings more than the correction has mended. The
    status (n,) is updated in place.
    """
    gap = loop.gaps(u, status)
    place_all_on_surface(loop.contact, u, status)
    back = np.flatnonzero(gap < 0.0)
    if loop.friction is not None and back.size:
        way = loop.sticking_place(back) - u[loop.nodes[back]]
        way -= gap[back, None] * loop.frame[back, 0]
        force = np.einsum("cab,cbe,ce->ca", loop.block[back], loop.frame[back], way)
        bound = loop.coefficient[back] * force[:, 0]
        status[back[np.linalg.norm(force[:, 1:], axis=1) <= bound]] = Status.STICK
    place_all_on_surface(loop.contact, u, status)


def stop_slip_that_turned(loop: NodeLoop, u: np.ndarray, status: np.ndarray) -> bool:
    """Let nodes stick which a correction of u (N, d) has moved the way their friction force pushes.

    The friction force of the last residual belongs to slip the other way; between the two lies rest. Return
    whether there were any; the status (n,) is updated in place.
    """
    slipping = np.flatnonzero(status == Status.SLIP)
    slip = u[loop.nodes[slipping]] - loop.sticking_place(slipping)
    tangents = loop.frame[slipping, 1:]
    friction, slip = (np.einsum("cab,cb->ca", tangents, v) for v in (loop.force[slipping], slip))
    turned = slipping[np.einsum("ca,ca->c", friction, slip) > 0.0]
    status[turned] = Status.STICK
    return turned.size > 0


@njit(cache=True)
def uncoupled_unknowns(A):
    """Which unknowns (N, d) are alone in their row.

    Prescribed ones, whose value is load over diagonal entry.
    """
    d = A.data.shape[1]
    alone = np.ones((A.indptr.size - 1, d), dtype=np.bool_)
    for i in range(alone.shape[0]):
        left = d
        for k in range(A.indptr[i], A.indptr[i + 1]):
            for a in range(d):
                for b in range(d):
                    if A.data[k, a, b] != 0.0 and (a != b or A.indices[k] != i) and alone[i, a]:
                        alone[i, a] = False
                        left -= 1
            if left == 0:
                break
    return alone
