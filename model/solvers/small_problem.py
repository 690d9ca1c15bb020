"""The small dense contact problem: semismooth Newton, and proximal points where it fails.

Where Newton's steps fail from the first guess v, springs are added that hold the nodes there,

    S u + spring M (u - v) = b + forces of the road,                                                      (1)

u is the next v, and softer springs follow: the proximal point method (R. T. Rockafellar, SIAM J. Control
Optim. 14 (1976)), or the body in a fluid ever thinner. M takes in what the body resists least: its rigid
modes, where it has any. Newton's steps solve (1) from the last point, or else a path of few changes does from
where they came nearest, or the springs fall less. A point at which other nodes meet the road is the last of
its problem: with them it is the first of the next. The force of the springs goes to zero where there is an
answer, and Newton's steps go on from there without, or a path where they fail; where the load moves the body
for ever, it goes to what drives it. Friction may hold the body all the same, elsewhere or once all slips have
turned: that is tried last, by the path from all nodes pressed to the road. In space a hexagon stands for the
friction disc, and where Newton's steps fail from there a finer polygon, turned to the friction that it gave.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.linalg.lapack import dpotrf, dpotri

from model.node_loop.blocks import generalised_inverses
from model.node_loop.contact_sweep import FREE, SLIP, Candidates
from model.node_loop.friction_laws import FrictionLaw
from model.problem.rigid_modes import null_space
from model.solvers.path_following import follow_path
from model.solvers.semismooth_newton import Condensed, Found, newton, residual_of, secants

ENOUGH = 1e-4  # of what the last springs pulled: residual of a proximal point, a start for the next
AFTER = 2  # Newton steps from a point that may pass before the residual must have halved
POINTS = 40  # at most
FALL = 0.1  # of the springs from one proximal point to the next,
SLOWEST = 0.7  # and where that is too quick its root, up to this
STEADY = 0.05  # change of what springs pull that is none: where it stays below that
FAR = 1e-3  # while the springs fall to so much, and no node comes nearer to the road or to where it sticks
SLOW = 1e-6  # of the motion by more than so much, the motion never ends
EDGES = 6, 24  # of the polygons that stand for a friction disc


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
    steps : (2,) int
        Counts steps of Newton and changes along paths: all, and the most in one solve.

    Attributes
    ----------
    driven : bool
        The last load moves these nodes on for ever.
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
        self._bordered = (W, G, resistance)
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
        modes = np.linalg.qr(G @ free)[0] if free.size else G @ free
        self.arrays = Condensed(total, S, Y, Z, modes, nodes, frame, block, inverse, steps)
        self._bound = None if friction is None else friction.address
        self.driven = False

    def solve(
        self,
        whole: "Whole",
        active: np.ndarray,
        start: np.ndarray,
        spring: float,
        slip_rate: float,
        tolerance: float,
        slight: float,
        meets: Callable[[np.ndarray, np.ndarray, np.ndarray], bool],
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Find the forces that the nodes miss, all others in equilibrium.

        Parameters
        ----------
        whole : Whole
            Its status is updated in place.
        active : (k,)
            The numbers among the candidates of the nodes of this problem.
        start : (n, d)
            Where all candidates go from u at first.
        spring : float
            Stiffness of springs that are too stiff; 0 to try without, and then from what the nodes feel.
        slip_rate : float
            What slip is multiplied by for the friction law.
        tolerance : float
            Natural residual at which to stop; rounding may stop it earlier, which the caller's own residual
            will tell.
        slight : float
            Force that is taken for rounding where it drives a rigid mode.
        meets : callable
            Whether others meet the road after force, pins and move, which then are those of a proximal point,
            its springs among the forces.

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
        target, known, been, first = (
            np.einsum("cab,cb->ca", frame, v)
            for v in (whole.free[nodes], whole.known[active], whole.u[nodes], start[active])
        )
        target, known, first = target[:, :s], known[:, :s], first[:, :s].copy()
        drive, pins_at_rest = self._at_rest(target.ravel(), whole.power)
        b = drive.reshape(k, s) - known
        # S resists rigid motion by its rounding alone
        b -= (arrays.S @ (first.ravel() - arrays.G @ (arrays.G.T @ first.ravel()))).reshape(k, s)
        # a node's own stiffness, for of that which is left of it in S there may be none
        own = np.ascontiguousarray(candidates.block[active][:, :s, :s])
        reference = (candidates.reference[active] - been[:, 1:])[:, : s - 1] - first[:, 1:]
        state = candidates.state[active]
        contact = Candidates(
            nodes=arrays.nodes,
            number=arrays.nodes,
            frame=arrays.frame,
            block=own,
            gap=whole.gap[active] + first[:, 0],
            reference=reference,
            state=state,
        )
        decided = status[active] if self._bound is not None else np.minimum(status[active], np.int8(SLIP))
        law = (self._bound, slip_rate)

        def outcome(u: np.ndarray, force: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
            move = first + u
            pins = pins_at_rest + arrays.Y.T @ move.ravel()
            return np.einsum("ca,cab->cb", force - known, frame[:, :s]), pins, move

        def met(u: np.ndarray, force: np.ndarray) -> bool:
            return meets(*outcome(u, force))

        before = arrays.steps[0]
        end = solved(arrays, contact, b, decided, law, tolerance, slight, spring, met)
        arrays.steps[1] = max(arrays.steps[1], arrays.steps[0] - before)
        status[active], self.driven, self.spring = end.status, end.driven, end.spring
        return outcome(end.u, end.force)

    def _at_rest(self, target: np.ndarray, power: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Forces (k s,) that drive the nodes, and displacements (p,) of the pins, while no node moves.

        A slender body that only contact holds would go far, and its nodes are stiff: what rounding leaves of
        the inverse, 1e-8, was as large as the forces. One step of iterative refinement removes it.
        """
        (W, G, resistance), S, Y, Z = self._bordered, self.arrays.bare, self.arrays.Y, self.arrays.Z
        force, pins = S @ target + Y @ power, -Y.T @ target - Z @ power
        gap, work = target - W @ force + G @ pins, power - G.T @ force - resistance @ pins
        return force + S @ gap + Y @ work, pins - Y.T @ gap - Z @ work


class End(NamedTuple):
    """Displacement (k, s), status (k,) and force (k, s); where none is found, of the last point.

    Then whether the load moves the nodes on for ever, and the springs at a point where others meet the road.
    """

    u: np.ndarray
    status: np.ndarray
    force: np.ndarray
    driven: bool = False
    spring: float = 0.0


def solved(
    arrays: Condensed,
    contact: Candidates,
    b: np.ndarray,
    status: np.ndarray,
    law: tuple[int | None, float],
    tolerance: float,
    slight: float,
    spring: float,
    meets: Callable[[np.ndarray, np.ndarray], bool],
) -> End:
    """Find where the nodes go from zero displacement.

    Parameters
    ----------
    arrays : Condensed
    contact : Candidates
        In their own frames, as b.
    b : (k, s)
    status : (k,)
        First guess; kept.
    law : address, float
        Of friction, None without, and what multiplies its slip.
    tolerance, slight, spring : float
        As for `SmallProblem.solve`.
    meets : callable
        Whether others meet the road at a displacement, and force, of a proximal point.
    """
    last = found = Found(np.zeros_like(b), status, np.zeros_like(b), False)
    if spring == 0.0:
        found = newton(arrays, contact, b, last.u, status, *law, tolerance, slight)
    if found.converged:
        return End(*found[:3])
    Q = arrays.G if arrays.G.shape[1] else np.eye(b.size)
    M, size = Q @ Q.T, max(np.linalg.norm(b), slight) or 1.0
    fall, before, same, driven = FALL, size, np.inf, False
    own, far = np.abs(contact.block).max(), contact.gap.max()
    # S of nodes of a rigid body is rounding: what keeps them within reach
    least = size / far if size < own * far else own
    spring = (spring or max(np.abs(arrays.block).max(), least)) / FALL
    for _ in range(POINTS):
        springs = spring * fall * M
        held = with_springs(arrays, springs)
        pull = b + (springs @ last.u.ravel()).reshape(b.shape)
        enough = max(tolerance, ENOUGH * min(before / size, 1.0))
        point = newton(held, contact, pull, last.u, last.status, *law, enough, slight, AFTER)
        if not point.converged:
            point = by_path(held, contact, pull, point, False, point, law, enough, slight)
        if not point.converged:
            fall = np.sqrt(fall)
            if fall > SLOWEST:
                break
            continue
        settled = np.all(point.status == last.status)
        spring, fall, step, last = spring * fall, FALL, point.u - last.u, point
        force = (arrays.S @ last.u.ravel()).reshape(b.shape) - b
        if meets(last.u, force):
            return End(last.u, last.status, force, spring=spring)
        pulls = spring * np.linalg.norm(M @ step.ravel())
        if settled and pulls < 0.5 * before or pulls <= tolerance * size:
            found = newton(arrays, contact, b, last.u, last.status, *law, tolerance, slight, AFTER)
            if found.converged:
                return End(*found[:3])
            if pulls <= tolerance * size:
                break
        if abs(pulls - before) > STEADY * before:
            same = spring
        elif spring > FAR * same or nearer(contact, last, step, law[0]) > SLOW * np.abs(step).max():
            fall = FALL**2
        else:
            driven = pulls > SLOW * size
            break
        before = pulls
    found = by_path(arrays, contact, b, last, True, found, law, tolerance, slight)
    if found.converged:
        return End(*found[:3])
    force = np.empty_like(b)
    residual_of(arrays, contact, b, last.u, last.status, np.empty_like(b), force, *law)
    return End(last.u, last.status, force, driven)


def nearer(contact: Candidates, last: Found, step: np.ndarray, bound: int | None) -> float:
    """By how much the last step (k, s) brought free nodes nearer to the road, others to where they stick."""
    slip = last.u[:, 1:] - contact.reference
    back = -np.sum(slip * step[:, 1:], axis=1) / np.maximum(np.linalg.norm(slip, axis=1), 1e-300)
    return float(np.where(last.status == FREE, -step[:, 0], back if bound is not None else 0.0).max())


def with_springs(arrays: Condensed, springs: np.ndarray) -> Condensed:
    """The small problem with springs (k s, k s) that leave no rigid mode."""
    k, s = arrays.block.shape[:2]
    S, nodes = arrays.S + springs, arrays.nodes
    block = np.ascontiguousarray(S.reshape(k, s, k, s)[nodes, :, nodes])
    inverse = np.empty_like(block)
    generalised_inverses(block, nodes, inverse)
    return arrays._replace(S=S, G=np.zeros((k * s, 0)), block=block, inverse=inverse)


def by_path(
    arrays: Condensed,
    contact: Candidates,
    b: np.ndarray,
    start: Found,
    pressed: bool,
    guess: Found,
    law: tuple[int | None, float],
    tolerance: float,
    slight: float,
) -> Found:
    """Follow a path from a start, or from all nodes pressed to the road, with the friction of a guess.

    In space the latter may be followed again, with the friction to which it has led.
    """
    for edges in EDGES if pressed else EDGES[:1]:
        mu, ways = secants(contact, guess.u, guess.status, guess.force, *law, edges)
        u, status, force = (v.copy() for v in start[:3])
        everybody = np.full(status.size, pressed)
        arrived, count = follow_path(
            arrays.S, b, contact.gap, contact.reference, mu, ways, u, force, status, everybody
        )
        arrays.steps[0] += count
        if not arrived:
            break
        found = newton(arrays, contact, b, u, status, *law, tolerance, slight)
        if found.converged:
            return found
        guess = Found(u, status, force, False)
    return guess


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
