"""The small dense contact problem: semismooth Newton, and the path to the solution where it fails.

A Newton step solves for what has been decided (free, slip, stick), the friction force of slipping nodes
following their pressure and slip; a sweep of the node loop then decides again. Steps go on as long as the
natural residual falls (with a watchdog, Chamberlain et al., Math. Program. Study 16 (1982)). Where it does
not, a path is followed to the solution, which it reaches after finitely many changes: from the first guess,
then from all nodes pressed to the road. On it friction is proportional to pressure, in space on a polygon
that touches the disc where the friction points; Newton's steps go on from there.

Everything here is in the frames of the nodes: component 0 along the normal, the others along the tangents.
`bound` is the address of the friction law, None without friction.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from scipy.linalg.lapack import dpotrf, dpotri

from model.node_loop.blocks import generalised_inverses
from model.node_loop.contact_sweep import (
    FREE,
    SLIP,
    STICK,
    Candidates,
    close_gap,
    place_all_on_surface,
    stick_or_slip,
)
from model.node_loop.friction_laws import FrictionLaw, allowed
from model.node_loop.friction_tangent import friction_tangent
from model.node_loop.natural_residual import admissible_traction
from model.problem.rigid_modes import determinate_unknowns, free_modes, null_space
from model.solvers.iterative_refinement import ROUNDING
from model.solvers.path_following import follow_path

CHAIN = 5  # Newton steps that may pass before the residual must have halved
ENOUGH = 0.1  # of the residual: after a Newton step that leaves no more a sweep must not raise it by rounding
PATHS = 4  # one after the other, each with the last one's friction
EDGES = 6  # of the polygon that stands for a friction disc


class SmallProblem:
    """The contact problem of k nodes with a dense matrix, along s components each: the normal, or all.

    Parameters
    ----------
    W : (k s, k s)
        Displacements under unit forces with the pins at rest, in the frames of the nodes.
    G : (k s, p)
        Displacements when the pins move by a unit.
    resistance : (p, p)
        What the pins resist by themselves.
    springs : (k, s, s) or None
        Springs that hold the nodes, in their frames.
    sides : int
        s.
    friction : FrictionLaw or None
    steps : (1,) int
        Counts steps of Newton and changes along paths.
    """

    def __init__(
        self,
        W: np.ndarray,
        G: np.ndarray,
        resistance: np.ndarray,
        springs: np.ndarray | None,
        sides: int,
        friction: FrictionLaw | None,
        steps: np.ndarray,
    ):
        S, Y, Z = bordered_inverse(W, G, resistance)
        S = total = np.ascontiguousarray(symmetric(S))
        free, k = np.eye(G.shape[1])[:, np.abs(resistance).sum(axis=0) == 0.0], W.shape[0] // sides
        if springs is not None:
            C = block_diagonal(springs)
            total = S + C
            if free.size:
                free = free @ null_space(C @ G @ free, np.abs(C).max() * np.abs(G).max())
        nodes = np.arange(k)
        block = np.ascontiguousarray(total.reshape(k, sides, k, sides)[nodes, :, nodes])
        inverse = np.empty_like(block)
        generalised_inverses(block, nodes, inverse)
        frame = np.tile(np.eye(sides), (k, 1, 1))
        anchors, G = np.zeros(k, dtype=np.bool_), G @ free
        anchors[determinate_unknowns(G) // sides] = True
        self.arrays = Condensed(total, S, Y, Z, G, anchors, nodes, frame, block, inverse, steps)
        self._bound = None if friction is None else friction.address

    def solve(
        self,
        whole: "Whole",
        active: np.ndarray,
        slip_rate: float,
        tolerance: float,
        slight: float,
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Find the forces that the nodes miss, all others in equilibrium.

        Parameters
        ----------
        whole : Whole
            Its status is updated in place.
        active : (k,)
            The numbers among the candidates of the nodes of this problem.
        slip_rate : float
            What slip is multiplied by for the friction law.
        tolerance : float
            Natural residual at which to stop; rounding may stop it earlier, which the caller's own residual
            will tell.
        slight : float
            Force that is taken for rounding where it drives a rigid mode.

        Returns
        -------
        force : (k, d)
            Forces of the road that are missing.
        pins : (p,)
            Displacements of the pins.
        move : (k, s)
            Displacements of the nodes from u, in their frames.
        """
        arrays, candidates, status = self.arrays, whole.candidates, whole.status
        k, s = arrays.block.shape[:2]
        frame, nodes = candidates.frame[active], candidates.nodes[active]
        target, known, been = (
            np.einsum("cab,cb->ca", frame, v)
            for v in (whole.free[nodes], whole.known[active], whole.u[nodes])
        )
        target, known = target[:, :s], known[:, :s]
        b = (arrays.bare @ target.ravel() + arrays.Y @ whole.power).reshape(k, s) - known
        # a node's own stiffness, for that which is left of it in S may be none
        own = arrays.block if self._bound is None else candidates.block[active]
        reference = (candidates.reference[active] - been[:, 1:])[:, : s - 1].copy()
        state = candidates.state[active]
        contact = Candidates(
            nodes=arrays.nodes,
            number=arrays.nodes,
            frame=arrays.frame,
            block=own,
            gap=whole.gap[active],
            reference=reference,
            state=state,
        )
        decided = status[active] if self._bound is not None else np.minimum(status[active], np.int8(SLIP))
        move, found = np.zeros((k, s)), np.empty((k, s))
        solve_small(arrays, contact, b, move, decided, found, self._bound, slip_rate, tolerance, slight)
        status[active] = decided
        pins = arrays.Y.T @ (move - target).ravel() - arrays.Z @ whole.power
        return np.einsum("ca,cab->cb", found - known, frame[:, :s]), pins, move


def block_diagonal(blocks: np.ndarray) -> np.ndarray:
    """The matrix (k d, k d) of blocks (k, d, d) on its diagonal."""
    k, d = blocks.shape[:2]
    full = np.zeros((k, d, k, d))
    full[np.arange(k), :, np.arange(k)] = blocks
    return full.reshape(k * d, k * d)


def symmetric(S: np.ndarray) -> np.ndarray:
    """S with its lower triangle on both sides."""
    return np.tril(S) + np.tril(S, -1).T


def bordered_inverse(
    W: np.ndarray, G: np.ndarray, resistance: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Blocks S (k, k), Y (k, p), Z (p, p) of the inverse of [[W, G], [G^T, -resistance]]."""
    k, p = G.shape
    if p == 0:
        factor, trouble = dpotrf(W, lower=1)
        S = np.linalg.inv(W) if trouble else dpotri(factor, lower=1)[0]
        return S, np.zeros((k, 0)), np.zeros((0, 0))
    w, g = W.diagonal().mean() or 1.0, np.abs(G).max()
    inverse = np.linalg.inv(np.block([[W / w, G / g], [G.T / g, -resistance * (w / g**2)]]))
    return inverse[:k, :k] / w, inverse[:k, k:] / g, inverse[k:, k:] * (w / g**2)


class Whole(NamedTuple):
    """What the small problem is told of the whole.

    Attributes
    ----------
    candidates : Candidates
        All of them, n.
    u, free : (N, d)
        Displacement, and where it would go from there with the known forces alone and the pins at rest.
    power : (p,)
        Work of the known forces when the pins move by a unit.
    gap : (n,)
        Gaps at u.
    known : (n, d)
        Known forces of the road.
    status : (n,)
        First guess.
    """

    candidates: Candidates
    u: np.ndarray
    free: np.ndarray
    power: np.ndarray
    gap: np.ndarray
    known: np.ndarray
    status: np.ndarray


class Condensed(NamedTuple):
    """The arrays of a small problem.

    Attributes
    ----------
    S, bare : (k s, k s) stiffness, with springs and without
    Y, Z : (k s, p), (p, p) what moves the pins
    G : (k s, m) rigid modes, S G = 0
    anchors : (k,) nodes that would hold all modes
    nodes : (k,) 0, 1, 2, ...
    frame : (k, s, s) unit matrices: the problem is in the nodes' frames already
    block, inverse : (k, s, s) diagonal blocks of S, and their inverses
    steps : (1,) steps of Newton and changes along paths so far
    """

    S: np.ndarray
    bare: np.ndarray
    Y: np.ndarray
    Z: np.ndarray
    G: np.ndarray
    anchors: np.ndarray
    nodes: np.ndarray
    frame: np.ndarray
    block: np.ndarray
    inverse: np.ndarray
    steps: np.ndarray


@njit(cache=True, error_model="numpy")
def solve_small(arrays, contact, b, u, status, force, bound, slip_rate, tolerance, slight):
    """Fill u (k, d), status (k,) and force (k, d) with the solution; u and status are the first guess."""
    trial, decided, pushed = u.copy(), status.copy(), force.copy()
    best, driven = newton(arrays, contact, b, u, status, force, bound, slip_rate, tolerance, slight)
    pressed = arrays.anchors & driven
    residual_of(arrays, contact, b, trial, decided, np.empty_like(u), pushed, bound, slip_rate)
    for _ in range(PATHS):
        if best <= max(tolerance, rounding_of(arrays, b, u, force)):
            break
        mu, ways = secants(contact, u, status, force, bound, slip_rate)
        found, count = follow_path(
            arrays.S, b, contact.gap, contact.reference, mu, ways, trial, pushed, decided, pressed
        )
        arrays.steps[0] += count
        pressed = np.full(status.size, not pressed.all())
        if found:
            after, _ = newton(arrays, contact, b, trial, decided, pushed, bound, slip_rate, tolerance, slight)
            if after < best:
                u[:], status[:], force[:], best = trial, decided, pushed, after
        trial, decided, pushed = u.copy(), status.copy(), force.copy()


@njit(cache=True, error_model="numpy")
def newton(arrays, contact, b, u, status, force, bound, slip_rate, tolerance, slight):
    """Bring u (k, d), status (k,) and force (k, d) to the least residual that Newton's steps find.

    Return it, and whether at the start the load drives a rigid mode that nothing holds.
    """
    place_all_on_surface(contact, u, status)
    trial, decided, R, pushed = u.copy(), status.copy(), np.empty_like(u), np.empty_like(u)
    best = residual_of(arrays, contact, b, u, status, R, pushed, bound, slip_rate)
    force[:], mark, idle, steps = pushed, best, 0, 0
    while idle < CHAIN and best > max(tolerance, rounding_of(arrays, b, u, force)):
        step, driven = newton_step(arrays, contact, trial, decided, R, pushed, bound, slip_rate, slight)
        if driven:
            return best, steps == 0
        steps += 1
        trial += step
        place_all_on_surface(contact, trial, decided)
        after = residual_of(arrays, contact, b, trial, decided, R, pushed, bound, slip_rate)
        quick = after <= ENOUGH * best
        if after < best:
            u[:], status[:], force[:], best = trial, decided, pushed, after
        sweep(arrays, contact, b, trial, decided, bound, slip_rate)
        after = residual_of(arrays, contact, b, trial, decided, R, pushed, bound, slip_rate)
        if after < best:
            u[:], status[:], force[:], best = trial, decided, pushed, after
        elif quick:
            trial[:], decided[:] = u, status
            residual_of(arrays, contact, b, trial, decided, R, pushed, bound, slip_rate)
        idle += 1
        if best < 0.5 * mark:
            mark, idle = best, 0
    return best, False


@njit(cache=True, error_model="numpy")
def newton_step(arrays, contact, u, status, R, force, bound, slip_rate, slight):
    """Step (k, d) for the unknowns that are linear at present, friction following the pressure and slip.

    Return whether the load drives a rigid mode that is free at present as well.
    """
    (k, d), S = u.shape, arrays.S
    arrays.steps[0] += 1
    moves = np.empty((k, d), dtype=np.bool_)  # free nodes whole, slip nodes along the surface
    for c in range(k):
        moves[c], moves[c, 0] = status[c] == FREE or status[c] == SLIP, status[c] == FREE
    numbers, step = np.flatnonzero(moves), np.zeros(k * d)
    if numbers.size == 0:
        return step.reshape(k, d), False
    by_pressure, support = np.zeros((k, d)), np.zeros((k, d, d))
    if bound is not None:
        friction_tangent(contact, u, R, force, status, bound, slip_rate, by_pressure, support)
    J = np.empty((numbers.size, numbers.size))
    missing, rubbed = R.reshape(k * d)[numbers], np.zeros((numbers.size, numbers.size))
    for row in range(numbers.size):
        c, a = numbers[row] // d, numbers[row] % d
        for column in range(numbers.size):
            J[row, column] = S[numbers[row], numbers[column]]
            if status[c] == SLIP:
                J[row, column] -= by_pressure[c, a] * S[c * d, numbers[column]]
            if numbers[column] // d == c:
                rubbed[row, column] = support[c, a, numbers[column] % d]
    J += rubbed
    largest = max(np.abs(J).max(), 1e-300)
    N = free_modes(arrays.G, ~moves.reshape(k * d))
    if N.shape[1]:  # friction resists that it would have to turn with the slip
        sizes, directions = np.linalg.eigh(N.T @ rubbed @ N)
        N = N @ directions[:, sizes <= ROUNDING * largest].copy()
    drive = N.T @ missing
    if np.sum(drive**2) > slight**2 + 1e-3 * np.sum(missing**2):
        return step.reshape(k, d), True
    try:
        step[numbers] = np.linalg.solve(J + largest * (N @ N.T), missing - N @ drive)
    except Exception:  # exactly singular: these slips have no unique answer, and a sweep or the path decides
        step[:] = 0.0
    return step.reshape(k, d), False


@njit(cache=True, error_model="numpy")
def sweep(arrays, contact, b, u, status, bound, slip_rate):
    """Visit every node once."""
    k, d = u.shape
    nodes, frame, gap = arrays.nodes, arrays.frame, contact.gap
    condensed = Candidates(nodes, nodes, frame, arrays.block, gap, contact.reference, contact.state)
    for c in range(k):
        r = b[c] - arrays.S[c * d : (c + 1) * d] @ u.reshape(k * d)
        if bound is None:
            status[c] = close_gap(condensed, c, arrays.inverse, r, u)
        else:
            status[c] = stick_or_slip(condensed, c, arrays.inverse, r, u, bound, slip_rate)


@njit(cache=True, error_model="numpy")
def residual_of(arrays, contact, b, u, status, R, force, bound, slip_rate):
    """Fill R and the admissible forces; return the natural residual."""
    k, d = u.shape
    R[:] = b - (arrays.S @ u.reshape(k * d)).reshape(k, d)
    for c in range(k):
        force[c] = -R[c]
        gap = contact.gap[c] + u[c, 0] if status[c] == FREE else 0.0
        force[c, 0] = max(force[c, 0] - contact.block[c, 0, 0] * gap, 0.0)
        if bound is None:
            force[c, 1:] = 0.0
        else:
            sticks = status[c] == STICK
            admissible_traction(contact, c, u, force[c, 0], sticks, bound, slip_rate, force[c])
    R += force
    missing = np.sqrt(np.sum(R**2))
    scale = np.sqrt(np.sum(b**2)) + np.sqrt(np.sum(force**2))
    return missing / scale if scale > 0.0 else 0.0  # nothing pushes, nothing is missing


@njit(cache=True, error_model="numpy")
def rounding_of(arrays, b, u, force):
    """Natural residual that the rounding of S u alone may leave."""
    size = np.abs(arrays.S) @ np.abs(u).reshape(u.size)
    scale = np.sqrt(np.sum(b**2)) + np.sqrt(np.sum(force**2))
    return 2 * ROUNDING * np.sqrt(np.sum(size**2)) / scale if scale > 0.0 else 1.0


@njit(cache=True, error_model="numpy")
def secants(contact, u, status, force, bound, slip_rate):
    """Ratios (k,) of friction to pressure; ways (k, m, d - 1) along the road, the first against friction."""
    k, d = u.shape
    mu, edges = np.zeros(k), 0 if bound is None else 2 if d == 2 else EDGES
    ways = np.empty((k, edges, d - 1))
    for c in range(k):
        if bound is not None:
            p = force[c, 0] if force[c, 0] > 0.0 else 1.0
            slip = np.sqrt(np.sum((u[c, 1:] - contact.reference[c]) ** 2)) if status[c] == SLIP else 0.0
            mu[c] = allowed(bound, p, slip_rate * slip, contact.state[c]) / p
        first = np.arctan2(-force[c, 2], -force[c, 1]) if d == 3 else 0.0
        for a in range(edges):
            angle = first + 2.0 * np.pi * a / edges
            ways[c, a, 0] = np.cos(angle)
            if d == 3:
                ways[c, a, 1] = np.sin(angle)
    return mu, ways
