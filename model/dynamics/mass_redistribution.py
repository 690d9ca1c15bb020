"""Mass redistribution: nodes that may touch carry no mass, so that an impact has nothing to stop at once.

The mass of the contact nodes is moved inside, M_r = S M S with S diagonal: zero at nodes that may touch, 1
far from them, and in between such that total mass, centre and moments of inertia of the body stay what they
are. The contact force is then a continuous function of time. The midpoint rule carries the masses; the
massless nodes are brought into equilibrium at the end of each step in which contact plays a part, which is a
small contact problem of their own and can only lower the energy.

Source: Khenous, Laborde and Renard, Eur. J. Mech. A/Solids 27 (2008) 918, who choose M_r of the same sparsity
nearest to M in the Frobenius norm; S M S is positive semi-definite whatever S is.
"""

from dataclasses import replace
from time import perf_counter
from typing import Any

import numpy as np
from scipy.sparse import bsr_array, csr_array

from model.dynamics.block_sums import scaled_by_nodes
from model.dynamics.initial_acceleration import mass_inverse
from model.dynamics.massless_nodes import MasslessNodes
from model.dynamics.midpoint import Midpoint
from model.dynamics.moving_body import MovingBody
from model.dynamics.time_integrator import State
from model.node_loop.node_loop import along_road
from model.node_loop.status import Status
from model.one_rank import ONE_RANK
from model.problem.rigid_modes import centred, rigid_motions

FADING = 0.5  # of the change of mass, from one layer of nodes to the next: five layers take 97 % of it
DEEPEST = 60  # layers in which it fades below rounding: 1 / 2^60 is 1e-18
SAME = 1e-9  # relative: a load is a weight, a motion forbidden; far from rounding and from what users mean
KEPT, LOST = 1e-15, 1e-10  # relative error of mass and inertia: reached as a rule, and what is refused


class MassRedistribution(Midpoint):
    """The midpoint rule on a body whose contact nodes carry no mass; parameters as for `TimeIntegrator`.

    Raises
    ------
    ValueError
        If every node may touch, so that no mass is left.

    Examples
    --------
    >>> from forms import Elasticity, Isotropic
    >>> from geometry import Body, Plane, rectangle
    >>> from model import MovingBody, MassRedistribution
    >>> elasticity = Elasticity(Body.from_grid(rectangle(2.0, 1.0, 4, 2)), Isotropic(E=1e4, nu=0.3))
    >>> weight = elasticity.body_force((0.0, -10.0))
    >>> body = MovingBody.from_forms(elasticity, 1.0, weight, Plane(point=(0.0, -0.001)), "bottom")
    >>> scheme = MassRedistribution(body, dt=0.001)
    >>> state = scheme.run(scheme.start(), 20)
    >>> bool(state.gap.min() == 0.0)  # it has landed
    True
    """

    name = "mass redistribution"

    def __init__(self, body: MovingBody, dt: float, **options: Any):
        self._M = redistributed(body.M, body.coordinates, body.contact_nodes, body.prescribed, body.ranks)
        body = with_weight(body, self._M)
        super().__init__(body, dt, **options)
        self.massless = MasslessNodes(body, self.tolerance, 1.0 / self.dt)
        self._own = self.massless.K
        self.solvers["massless"] = self.massless.solver

    def mass(self) -> Any:
        """Return M_r."""
        return self._M

    def start(self, displacement: np.ndarray | None = None, velocity: np.ndarray | None = None) -> State:
        """Return the state at time 0, the massless nodes in equilibrium."""
        state = super().start(displacement, velocity)
        state.displacement = state.displacement.copy()
        self._settle(state)
        state.mean_force = state.contact_force.copy()
        nodes = self.body.contact_nodes
        v, a = state.velocity, state.acceleration
        ranks = self.body.ranks
        a[:] = mass_inverse(self.M, self.body.missing_force(0.0, state.displacement, v), ranks)
        a[nodes] = -self.massless.under((self.body.K @ a.ravel()).reshape(a.shape)[nodes])
        ranks.update(a)
        self.supported(state)
        state.memory = v[nodes] - (0.5 * self.dt) * a[nodes]
        return state

    def accelerate(
        self, u: np.ndarray, v: np.ndarray, gap: np.ndarray, normal: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Leave it to `start`, once the massless nodes are in equilibrium; who touches sticks a priori."""
        touches = Status.SLIP if self.body.friction is None else Status.STICK
        return (
            np.zeros_like(u),
            np.zeros_like(normal),
            np.where(gap == 0.0, touches, Status.FREE).astype(np.int8),
        )

    def step(self, before: State) -> State:
        """Return the state one step later."""
        began = perf_counter()
        after = super().step(before)
        nodes = self.body.contact_nodes
        if callable(self.body.load) or before.count or after.count:
            after.work.numerical += self._settle(after)
        # velocities of the massless nodes, for the record and the next guess only
        mean = (after.displacement[nodes] - before.displacement[nodes]) / self.dt
        memory = mean if before.memory is None else before.memory
        after.velocity[nodes] = np.where(
            (after.status == Status.FREE)[:, None], 1.5 * mean - 0.5 * memory, mean
        )
        after.acceleration[nodes] = (mean - memory) / self.dt
        self.body.ranks.update(after.velocity)
        self.body.ranks.update(after.acceleration)
        after.memory = mean
        after.seconds = perf_counter() - began
        return after

    def _settle(self, state: State) -> float:
        """Bring the massless nodes of `state` into equilibrium in place; return the energy that this adds."""
        nodes, total = self.body.contact_nodes, self.body.ranks.sum
        missing = self.body.missing_force(state.time, state.displacement)[nodes]
        gap, normal = self.ground(state)
        touch, added = self.massless.settle(missing, gap, normal, state)
        e, force = touch.increment, touch.force
        state.displacement[nodes] += e
        self.body.ranks.update(state.displacement)
        # a node that slipped in the step stays where it came to, with its friction still at the limit
        slipped = (state.status == Status.SLIP) & (touch.status == Status.STICK)
        state.status = np.where(slipped, np.int8(Status.SLIP), touch.status)
        state.contact_force, state.gap, state.count = force, touch.gap, touch.count
        state.residual = max(state.residual, touch.residual)
        if callable(self.body.load) and state.step:
            # the load does its work here as it is at the end of the step, not in the middle
            late = self.body.load_at(state.time) - self.body.load_at(state.time - 0.5 * self.dt)
            state.work.load += total(float(np.vdot(late[nodes], e)))
        if self.body.friction is None:
            return added
        tangential = along_road(force, normal)
        friction = total(float(np.vdot(tangential, e)))
        state.work.friction += friction
        return added - friction


def with_weight(body: MovingBody, M: bsr_array) -> MovingBody:
    """Let the weight go with the mass: a load body.M g becomes M g, so that free fall strains nothing.

    Any other load stays as it is.
    """
    if callable(body.load) or body.supported:
        return body
    load, ranks = body.load_at(0.0), body.ranks
    d = body.dim
    ones = np.tile(np.eye(d), (load.shape[0], 1))
    per_axis = body.M @ ones
    gravity = np.linalg.lstsq(ranks.sum(ones.T @ per_axis), ranks.sum(ranks.own(load).sum(axis=0)))[0]
    off = ranks.own((per_axis @ gravity).reshape(load.shape) - load)
    if ranks.max(np.abs(off).max()) > SAME * ranks.max(np.abs(ranks.own(load)).max()):
        return body
    return replace(body, load=(M @ (ones @ gravity)).reshape(load.shape))


def redistributed(
    M: Any, coordinates: np.ndarray, nodes: np.ndarray, prescribed: np.ndarray, ranks: Any = ONE_RANK
) -> bsr_array:
    """Move the mass of some nodes inside.

    Parameters
    ----------
    M : sparse (N d, N d)
        Mass matrix.
    coordinates : (N, d)
    nodes : (n,)
        Nodes that shall carry no mass.
    prescribed : (N, d)
        Unknowns that do not move.
    ranks : OneRank or geometry.exchange.Exchange
        Who shares the nodes.

    Returns
    -------
    bsr_array (N d, N d)
        S M S, of the same mass along each axis, and of the same kinetic energy in every rigid motion that the
        prescribed unknowns leave to the body: for a free body, of the same centre and moments of inertia.

    Raises
    ------
    ValueError
        If no other node is left, or too few to carry all that.

    Examples
    --------
    >>> rod = np.diag([2.0, 4.0, 4.0, 2.0]) + np.diag([1.0] * 3, 1) + np.diag([1.0] * 3, -1)  # linear
    >>> M = bsr_array(np.kron(rod, np.eye(2)), blocksize=(2, 2))
    >>> x = np.column_stack([np.arange(4.0), np.zeros(4)])
    >>> held = np.tile([False, True], (4, 1))  # the rod slides along x and does not turn
    >>> moved = redistributed(M, x, np.array([0]), held).toarray()[::2, ::2]
    >>> float(moved[0, 0]), round(float(moved.sum()), 12)
    (0.0, 18.0)
    """
    N, d = coordinates.shape
    count = ranks.sum(np.unique(nodes).size)
    if count == ranks.sum(len(ranks.own(coordinates))):
        raise ValueError("Every node may touch, so none is left to carry the mass; name fewer contact nodes.")
    A = bsr_array(M, blocksize=(d, d))
    layer = layers(A, nodes, ranks)
    fading = np.where(layer > 0.0, FADING**layer, 0.0)
    shapes = fading[:, None] * _quadratics(coordinates, ranks)
    motions, kept = _kept_motions(coordinates, prescribed, layer == 0.0, ranks)
    wanted = ranks.sum((motions.T @ (_with_held(A) @ motions))[kept])
    s = (layer > 0.0).astype(np.float64)
    for _ in range(50):
        scaled = A @ (np.repeat(s, d)[:, None] * motions)
        missing = wanted - ranks.sum(((np.repeat(s, d)[:, None] * motions).T @ scaled)[kept])
        off = float(np.abs(missing).max() / np.abs(wanted).max())
        if off < KEPT:
            break
        columns = []
        for shape in shapes.T:
            half = (np.repeat(shape, d)[:, None] * motions).T @ scaled
            columns.append((half + half.T)[kept])
        s += shapes @ np.linalg.lstsq(ranks.sum(np.stack(columns, axis=1)), missing)[0]
    if not off < LOST:
        raise ValueError(
            f"The mass of the {count} nodes that may touch finds no place in the other "
            f"{ranks.sum(np.count_nonzero(ranks.own(layer)))}: mass or moments of inertia stay off by "
            f"{off:.1e}; "
            "give the body three cells or more across, or name fewer contact nodes."
        )
    return scaled_by_nodes(A, s)


def _with_held(A: bsr_array) -> bsr_array:
    """Return a mass matrix (N d, N d) with as much along axes that supports hold as along others."""
    own = np.einsum("kaa->ka", A.data)
    largest = np.take_along_axis(own, np.abs(own).argmax(axis=1)[:, None], axis=1)
    data = A.data.copy()
    np.einsum("kaa->ka", data)[:] = np.where(own == 0.0, largest, own)
    return bsr_array((data, A.indices, A.indptr), shape=A.shape)


def layers(A: bsr_array, nodes: np.ndarray, ranks: Any) -> np.ndarray:
    """Return in which layer around some nodes each node is (N,), by the couplings of A; inf if far away."""
    N = A.indptr.size - 1
    coupled = csr_array((np.ones(A.indices.size), A.indices, A.indptr), shape=(N, N))
    layer, near = np.full(N, np.inf), np.zeros(N)
    near[nodes] = 1.0
    for depth in range(DEEPEST):
        ranks.update(near)
        layer[(near > 0.0) & np.isinf(layer)] = depth
        near = np.minimum(coupled @ near, 1.0)
    return layer


def _kept_motions(
    coordinates: np.ndarray, prescribed: np.ndarray, massless: np.ndarray, ranks: Any
) -> tuple[np.ndarray, tuple]:
    """Return motions (N d, d + m), and which of their products (rows, columns) shall keep their mass.

    The translations of what is free along each axis count by themselves, the m rigid motions that vanish at
    all prescribed unknowns with each other: moments of motions that the supports forbid move nothing. Nodes
    that become `massless` (N,) give all their mass away, whatever supports hold of it.
    """
    N, d = coordinates.shape
    rigid = rigid_motions(coordinates, ranks).reshape(N * d, -1)
    fixed = prescribed.ravel()
    own = ranks.own(prescribed).ravel()
    _, size, ways = np.linalg.svd(ranks.tall(np.linalg.qr(rigid[: own.size][own], mode="r")))  # small
    forbidden = np.count_nonzero(size > SAME * np.sqrt(N))
    allowed = rigid @ ways[forbidden:].T
    allowed[fixed] = 0.0  # what rounding has left
    moves = ranks.sum(np.where(fixed[:, None], 0.0, rigid[:, :d]).any(axis=0).astype(int)) > 0
    held = (fixed & ~np.repeat(massless, d))[:, None]
    moving = np.where(held, 0.0, rigid[:, :d])[:, moves]
    first, second = np.triu_indices(allowed.shape[1])
    alone, shift = np.arange(moving.shape[1]), moving.shape[1]
    kept = np.concatenate([alone, first + shift]), np.concatenate([alone, second + shift])
    return np.hstack([moving, allowed]), kept


def _quadratics(coordinates: np.ndarray, ranks: Any) -> np.ndarray:
    """1, x, y, ..., x^2, x y, ... at the nodes, (N, 6) or (N, 10), scaled to the body's size."""
    x = centred(coordinates, ranks)
    first, second = np.triu_indices(x.shape[1])
    return np.column_stack([np.ones(len(x)), x, x[:, first] * x[:, second]])
