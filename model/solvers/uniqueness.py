"""Whether an answer is one of several, or a balance that no push leaves in place: the sign of its tangent.

At a solution the touching nodes feel the stiffness J on the motions that are left to them, a normal never and
where they stick no tangent being among them:

    J = S_tt + (d beta / d p) t S_nt + (d beta / d s) t t^T + (beta / |s|) (I - t t^T) + C,               (1)

S being the body's own stiffness, all that does not touch in equilibrium, beta the bound of friction, t the
direction of slip s, and C = - p grad n how a curved road turns the force as the node moves.

**With friction** the index of a solution is the sign of det J. The map whose zeros are the solutions has the
degree 1, which is the sum of their indices: without friction they are the one minimum of a convex function,
of index 1, and while friction grows none comes from infinity, for of far solutions u A u <= b u, since
neither pressure nor friction does work on a node that goes away or slips (J. M. Ortega and W. C. Rheinboldt,
Iterative Solution of Nonlinear Equations in Several Variables, 1970, ch. 6; for when friction lets there be
several A. Klarbring, Ingenieur-Archiv 60 (1990) 529). So an index of -1 proves that there are others, and
two of them at least unless they are degenerate. A load that grows from nothing leads along indices of 1 only:
where the index changes, the load turns back. An index of 1 proves nothing.

**Without friction** J on a curved road is how the energy curves; where it has a negative eigenvalue the body
is at a saddle, not at rest.

A zero that rounding may have made proves nothing, nor does a node that touches without pressure where there
is friction.
"""

import warnings
from collections.abc import Callable
from ctypes import POINTER, c_double
from pathlib import Path
from typing import Any

import numpy as np

from model.node_loop.node_loop import NodeLoop
from model.node_loop.status import Status
from model.problem.rigid_modes import BALANCE, SEEN, null_space
from model.solvers.contact_solver import ContactSolver, Solution
from model.solvers.small_problem import block_diagonal, bordered_inverse, symmetric
from model.solvers.static_condensation import Condensation

STEP = 1e-6  # relative: differences of a friction law are good to it
SURE = 1e-8  # of the largest singular value, once all are scaled alike: half of the digits
PACKAGE = str(Path(__file__).parents[1])  # a warning points to the line that called the package


class SeveralAnswers(UserWarning):
    """Friction is so large that there are other answers than the one that was found."""


class UnstableBalance(UserWarning):
    """The body is balanced on a hill of the road, and the smallest push would move it away."""


def look_for_others(solver: Any, solution: Solution, turning: Callable[[], np.ndarray] | None = None) -> bool:
    """Warn where a solution, the last of a solver, is proved to be one of several, or an unstable balance.

    Only the correction `direct` knows the stiffness that touching nodes feel: of others nothing is said.

    Parameters
    ----------
    solver : ContactSolver
    solution : Solution
    turning : callable, optional
        Returns C (n, d, d) at the candidates, on a curved road.

    Returns
    -------
    bool
        Whether a warning was given.

    Warns
    -----
    SeveralAnswers, UnstableBalance
        With how many nodes touch and slip, and what to do.
    """
    if not isinstance(solver, ContactSolver) or not isinstance(solver.correction, Condensation):
        return False
    if solver.loop.friction is None:
        return turning is not None and _says_unstable(solver, solution, _of_free(turning(), solver.loop))
    if not np.any(solution.status == Status.SLIP) or (turning is not None and solver.rigid.count):
        return False
    return _says_several(solver, solution, None if turning is None else _of_free(turning(), solver.loop))


def _of_free(turning: np.ndarray, loop: NodeLoop) -> np.ndarray:
    """C (n, d, d) of what is not prescribed."""
    free = ~loop.uncoupled[loop.nodes]
    return np.where(free[:, :, None] & free[:, None, :], turning, 0.0)


def _says_unstable(solver: ContactSolver, solution: Solution, turning: np.ndarray) -> bool:
    """Warn of a balance on a hill, without friction."""
    touching = np.flatnonzero(solution.gap <= 0.0)
    hills = touching[np.linalg.eigvalsh(turning[touching])[:, 0] < 0.0]
    if not hills.size:
        return False
    frame, d = solver.loop.frame[touching], turning.shape[1]
    tangents = np.arange(touching.size * d).reshape(-1, d)[:, 1:].ravel()
    J = reduced_tangent(
        *_stiffness(solver.correction, touching, frame),
        tangents,
        block_diagonal((frame @ turning[touching] @ frame.transpose(0, 2, 1))[:, 1:, 1:]),
    )
    if np.linalg.eigvalsh(0.5 * (J + J.T))[0] > -SURE * max(np.abs(J).max(initial=0.0), 1e-300):
        return False
    warnings.warn(
        f"The body is balanced on a hill of the road, {touching.size} of its nodes touching it: the tangent "
        "has a negative eigenvalue, so that the smallest push would move it away, downhill; hold it by a "
        "support, or let it start on the side to which it shall go.",
        UnstableBalance,
        skip_file_prefixes=(PACKAGE,),
    )
    return True


def _says_several(solver: ContactSolver, solution: Solution, turning: np.ndarray | None) -> bool:
    """Warn of other answers, with friction."""
    loop, status, pressure = solver.loop, solution.status, solution.pressure_force
    touching = np.flatnonzero(status != Status.FREE)
    slips = np.flatnonzero(status[touching] == Status.SLIP)
    degenerate = (solution.gap <= 0.0) & (pressure <= SEEN * pressure.max(initial=0.0))
    if degenerate.any() or loop.given[touching[slips]].any():
        return False
    frame, d = loop.frame[touching], loop.shape[1]
    tangents = (slips[:, None] * d + np.arange(1, d)).ravel()
    nodes = touching[slips]
    slip = solution.displacement[loop.nodes[nodes]] - solver.posed.reference[nodes]
    slip = np.einsum("cab,cb->ca", loop.frame[nodes], slip)
    least = SEEN * max(np.abs(solution.displacement).max(), np.abs(solver.posed.reference).max())
    if np.linalg.norm(slip[:, 1:], axis=1).min() <= least:
        return False
    by_pressure, support = _friction(solver, solution.pressure_force[nodes], nodes, slip, turning)
    S, G = _stiffness(solver.correction, touching, frame)
    rubbed = np.zeros((tangents.size, S.shape[0]))
    rows = np.arange(tangents.size).reshape(slips.size, d - 1)
    rubbed[rows, (slips * d)[:, None]] = by_pressure
    J = reduced_tangent(S, G, tangents, block_diagonal(support), rubbed)
    sizes = np.linalg.svd(J, compute_uv=False)
    if sizes[-1] <= SURE * sizes[0] or np.linalg.slogdet(J)[0] > 0.0:
        return False
    posed, rigid = solver.posed, solver.rigid
    if rigid.count and not rigid.bears(posed.load, loop.normal, 0.0, BALANCE):
        return False
    mu = float(np.max(loop.coefficient[touching]))
    warnings.warn(
        f"There are other answers than this one: with mu = {mu:g} and {slips.size} of {touching.size} nodes "
        "that touch in slip, the determinant of the tangent is negative, while the signs of all answers add "
        "up to 1. No load that only grows leads to this one; take load steps, or more of them, or a smaller "
        "mu, or prescribe the motion in place of the force.",
        SeveralAnswers,
        skip_file_prefixes=(PACKAGE,),
    )
    return True


def _stiffness(
    correction: Condensation, touching: np.ndarray, frame: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """S (k d, k d) of touching nodes (k,) in their frames, and orthonormal motions that it leaves."""
    W = correction.flexibility(touching, frame)
    shapes = correction.shapes.reshape(*correction.loop.shape, -1)[correction.loop.nodes[touching]]
    G, R = np.einsum("cab,cbp->cap", frame, shapes).reshape(len(W), -1), correction.resistance
    scale = np.abs(G).max(initial=0.0) / (np.abs(R).max(initial=0.0) or 1.0)
    _, sizes, directions = np.linalg.svd(np.concatenate([G, scale * R]), full_matrices=False)
    seen = directions[sizes > SEEN * sizes.max(initial=0.0)].T
    R = seen.T @ R @ seen
    free = np.abs(R).sum(axis=0) == 0.0
    return symmetric(bordered_inverse(W, G @ seen, R)[0]), np.linalg.qr(G @ seen[:, free])[0]


def reduced_tangent(
    S: np.ndarray,
    G: np.ndarray,
    moves: np.ndarray,
    added: np.ndarray,
    rubbed: np.ndarray | None = None,
) -> np.ndarray:
    """(1), by a congruence that makes S the unit matrix where it resists, and all rows alike in size.

    Parameters
    ----------
    S : (l, l)
    G : (l, m)
        Orthonormal, S G = 0.
    moves : (t,)
        Unknowns that may move.
    added : (t, t)
        What is added to the rows and columns of these.
    rubbed : (t, l), optional
        Friction by the forces S u.

    Returns
    -------
    (t, t)
        With the sign of the determinant, and if it is symmetric as many negative eigenvalues, as (1).
    """
    held = np.ones(len(S), dtype=bool)
    held[moves] = False
    N = np.zeros((moves.size, 0))
    if G.shape[1]:
        N = np.linalg.qr(G[moves] @ null_space(G[held], 1.0))[0]
    P = np.linalg.svd(N)[0][:, N.shape[1] :] if N.shape[1] else np.eye(moves.size)
    sizes, axes = np.linalg.eigh(P.T @ S[np.ix_(moves, moves)] @ P)
    P = (P @ axes) / np.sqrt(np.maximum(sizes, SEEN**2 * sizes.max(initial=0.0) + 1e-300))
    B, m = np.hstack([N, P]), N.shape[1]
    J = B.T @ added @ B
    J[m:, m:] += np.eye(P.shape[1])
    if rubbed is not None:
        J[:, m:] += B.T @ rubbed @ S[:, moves] @ P
    size = np.maximum(np.abs(J).max(axis=0), np.abs(J).max(axis=1))
    scale = 1.0 / np.sqrt(np.where(size > 0.0, size, 1.0))
    return np.asarray(scale[:, None] * J * scale)


def _friction(
    solver: ContactSolver,
    pressure: np.ndarray,
    nodes: np.ndarray,
    slip: np.ndarray,
    turning: np.ndarray | None,
) -> tuple[np.ndarray, np.ndarray]:
    """How friction of candidates (k,) grows by pressure, (k, d - 1), and (1) without S, (k, d - 1, d - 1).

    Slips (k, d) are in the frames; on a curved road normal and slip turn as a node goes along it.
    """
    loop, state, d = solver.loop, np.ascontiguousarray(solver.posed.state), slip.shape[1]
    assert loop.friction is not None
    by_pressure, support = np.empty((nodes.size, d - 1)), np.empty((nodes.size, d - 1, d - 1))
    for row, (c, p) in enumerate(zip(nodes, pressure)):
        s, told = float(np.linalg.norm(slip[row, 1:])), state[c].ctypes.data_as(POINTER(c_double))
        beta, more, farther = (
            loop.friction.bound.ctypes(x * p, loop.slip_rate * y * s, told)
            for x, y in ((1.0, 1.0), (1.0 + STEP, 1.0), (1.0, 1.0 + STEP))
        )
        t = slip[row, 1:] / s
        along, across = np.outer(t, t), beta / s * (np.eye(d - 1) - np.outer(t, t))
        by_pressure[row] = (more - beta) / (STEP * p) * t
        support[row] = (farther - beta) / (STEP * s) * along + across
        if turning is not None:
            C = (loop.frame[c] @ turning[c] @ loop.frame[c].T)[1:, 1:]
            support[row] += C + (beta / p) ** 2 * along @ C + across @ C * (slip[row, 0] / p)
    return by_pressure, support
