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
from scipy.sparse import bsr_array, csc_array, csr_array
from scipy.sparse.csgraph import dijkstra
from scipy.sparse.linalg import spsolve

from model.dynamics.block_sums import block_among, scaled_by_nodes
from model.dynamics.initial_acceleration import mass_inverse
from model.dynamics.midpoint import Midpoint
from model.dynamics.moving_body import MovingBody
from model.dynamics.time_integrator import State, StepSolver
from model.node_loop.status import Status
from model.problem.contact_problem import ContactProblem
from model.problem.rigid_modes import rigid_motions

FADING = 0.5  # of the change of mass, from one layer of nodes to the next


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
        self._M = redistributed(body.M, body.coordinates, body.contact_nodes, body.prescribed)
        body = with_weight(body, self._M)
        super().__init__(body, dt, **options)
        d, nodes = body.dim, body.contact_nodes
        self._own = block_among(body.K, nodes)
        rest = np.zeros((nodes.size, d))
        gap, normal = body.gaps(np.zeros_like(body.coordinates))
        problem = ContactProblem(
            self._own,
            rest,
            body.coordinates[nodes],
            np.arange(nodes.size),
            normal,
            np.maximum(gap, 0.0),
            body.friction,
        )
        self.solvers["massless"] = StepSolver(problem, "direct", self.tolerance, 1.0 / self.dt, body.places)

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
        a[:] = mass_inverse(self.M, self.body.missing_force(0.0, state.displacement, v))
        follow = (self.body.K @ a.ravel()).reshape(a.shape)[nodes]
        a[nodes] = -spsolve(csc_array(self._own), follow.ravel()).reshape(follow.shape)
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
        after.memory = mean
        after.seconds = perf_counter() - began
        return after

    def _settle(self, state: State) -> float:
        """Bring the massless nodes of `state` into equilibrium in place; return the energy that this adds."""
        nodes = self.body.contact_nodes
        missing = self.body.missing_force(state.time, state.displacement)[nodes]
        gap, normal = self.ground(state)
        touch = self.solvers["massless"].solve(missing, gap, normal, np.zeros_like(missing), state)
        e, force = touch.increment, touch.force
        state.displacement[nodes] += e
        state.contact_force, state.status, state.gap, state.count = (
            force,
            touch.status,
            touch.gap,
            touch.count,
        )
        state.residual = max(state.residual, touch.residual)
        added = 0.5 * float(e.ravel() @ (self._own @ e.ravel())) - float(np.vdot(missing, e))
        if callable(self.body.load) and state.step:
            # the load does its work here as it is at the end of the step, not in the middle
            late = self.body.load_at(state.time) - self.body.load_at(state.time - 0.5 * self.dt)
            state.work.load += float(np.vdot(late[nodes], e))
        if self.body.friction is None:
            return added
        tangential = force - np.einsum("ca,ca,cb->cb", force, normal, normal)
        slipped = float(np.vdot(tangential, e))
        state.work.friction += slipped
        return added - slipped


def with_weight(body: MovingBody, M: bsr_array) -> MovingBody:
    """Let the weight go with the mass: a load body.M g becomes M g, so that free fall strains nothing.

    Any other load stays as it is.
    """
    if callable(body.load) or body.prescribed.any():
        return body
    load = body.load_at(0.0)
    d = body.dim
    ones = np.tile(np.eye(d), (load.shape[0], 1))
    per_axis = body.M @ ones
    gravity = np.linalg.lstsq(ones.T @ per_axis, load.sum(axis=0))[0]
    if np.abs(per_axis @ gravity - load.ravel()).max() > 1e-9 * np.abs(load).max():
        return body
    return replace(body, load=(M @ (ones @ gravity)).reshape(load.shape))


def redistributed(M: Any, coordinates: np.ndarray, nodes: np.ndarray, prescribed: np.ndarray) -> bsr_array:
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
    if np.unique(nodes).size == N:
        raise ValueError("Every node may touch, so none is left to carry the mass; name fewer contact nodes.")
    A = bsr_array(M, blocksize=(d, d))
    graph = csr_array((np.ones(A.indices.size), A.indices, A.indptr), shape=(N, N))
    layer = dijkstra(graph, unweighted=True, indices=nodes, min_only=True)
    fading = np.where(layer > 0.0, FADING**layer, 0.0)
    shapes = fading[:, None] * _quadratics(coordinates)
    motions, kept = _kept_motions(coordinates, prescribed)
    wanted = (motions.T @ (A @ motions))[kept]
    s = (layer > 0.0).astype(np.float64)
    for _ in range(50):
        scaled = A @ (np.repeat(s, d)[:, None] * motions)
        missing = wanted - ((np.repeat(s, d)[:, None] * motions).T @ scaled)[kept]
        off = float(np.abs(missing).max() / np.abs(wanted).max())
        if off < 1e-15:
            break
        columns = []
        for shape in shapes.T:
            half = (np.repeat(shape, d)[:, None] * motions).T @ scaled
            columns.append((half + half.T)[kept])
        s += shapes @ np.linalg.lstsq(np.stack(columns, axis=1), missing)[0]
    if not off < 1e-10:
        raise ValueError(
            f"The mass of the {np.unique(nodes).size} nodes that may touch finds no place in the other "
            f"{np.count_nonzero(layer)}: mass or moments of inertia stay off by {off:.1e}; "
            "give the body three cells or more across, or name fewer contact nodes."
        )
    return scaled_by_nodes(A, s)


def _kept_motions(coordinates: np.ndarray, prescribed: np.ndarray) -> tuple[np.ndarray, tuple]:
    """Return motions (N d, d + m), and which of their products (rows, columns) shall keep their mass.

    The translations of what is free along each axis count by themselves, the m rigid motions that vanish at
    all prescribed unknowns with each other: moments of motions that the supports forbid move nothing.
    """
    N, d = coordinates.shape
    rigid = rigid_motions(coordinates).reshape(N * d, -1)
    fixed = prescribed.ravel()
    _, size, ways = np.linalg.svd(np.linalg.qr(rigid[fixed], mode="r"))  # small, however many are fixed
    forbidden = np.count_nonzero(size > 1e-9 * np.sqrt(N))
    allowed = rigid @ ways[forbidden:].T
    allowed[fixed] = 0.0  # what rounding has left
    moving = np.where(fixed[:, None], 0.0, rigid[:, :d])
    moving = moving[:, moving.any(axis=0)]
    first, second = np.triu_indices(allowed.shape[1])
    alone, shift = np.arange(moving.shape[1]), moving.shape[1]
    kept = np.concatenate([alone, first + shift]), np.concatenate([alone, second + shift])
    return np.hstack([moving, allowed]), kept


def _quadratics(coordinates: np.ndarray) -> np.ndarray:
    """1, x, y, ..., x^2, x y, ... at the nodes, (N, 6) or (N, 10), scaled to the body's size."""
    x = coordinates - coordinates.mean(axis=0)
    x = x / (np.abs(x).max() or 1.0)
    first, second = np.triu_indices(x.shape[1])
    return np.column_stack([np.ones(len(x)), x, x[:, first] * x[:, second]])
