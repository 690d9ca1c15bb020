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
from typing import Any

import numpy as np
from scipy.linalg import solve_triangular
from scipy.linalg.lapack import dgecon, dgetrf

from model.node_loop.node_loop import NodeLoop
from model.node_loop.status import Status
from model.problem.linear_limits import PACKAGE
from model.problem.rigid_modes import BALANCE, SEEN, null_space
from model.solvers.contact_solver import ContactSolver, Solution
from model.solvers.small_problem import block_diagonal, bordered_inverse, symmetric
from model.solvers.static_condensation import Condensation

STEP = 1e-6  # relative: differences of a friction law are good to it
SURE = 1e-8  # of the largest, once all rows are scaled alike: half of the digits


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
    loop = solver.loop
    if loop.friction is not None and turning is not None and solver.rigid.count:
        return False  # where the body is carried off there may be no answer, and the sum another
    look = _on_hill if loop.friction is None else _beside_others
    try:
        said = look(solver, solution, _of_free(turning, loop))
    except np.linalg.LinAlgError:  # rounding has left nothing of the stiffness
        return False
    if said:
        kind = UnstableBalance if loop.friction is None else SeveralAnswers
        warnings.warn(said, kind, skip_file_prefixes=(PACKAGE,))
    return bool(said)


def _of_free(turning: Callable[[], np.ndarray] | None, loop: NodeLoop) -> np.ndarray:
    """C (n, d, d) of what is not prescribed; zero on planes."""
    free = ~loop.uncoupled[loop.nodes]
    both = free[:, :, None] & free[:, None, :]
    return np.zeros(both.shape) if turning is None else np.where(both, turning(), 0.0)


def _on_hill(solver: ContactSolver, solution: Solution, turning: np.ndarray) -> str:
    """Say that a body without friction is balanced on a hill, if it is proved."""
    touching = np.flatnonzero(solution.gap <= 0.0)
    hills = touching[np.linalg.eigvalsh(turning[touching])[:, 0] < 0.0]
    if not hills.size:
        return ""
    frame, d = solver.loop.frame[touching], turning.shape[1]
    tangents = np.arange(touching.size * d).reshape(-1, d)[:, 1:].ravel()
    J = reduced_tangent(
        *_stiffness(solver.correction, touching, frame),
        tangents,
        block_diagonal((frame @ turning[touching] @ frame.transpose(0, 2, 1))[:, 1:, 1:]),
    )
    if np.linalg.eigvalsh(0.5 * (J + J.T))[0] > -SURE:
        return ""
    return (
        f"The body is balanced on a hill of the road, {touching.size} of its nodes touching it: the tangent "
        "has a negative eigenvalue, so that the smallest push would move it away, downhill; hold it by a "
        "support, or let it start on the side to which it shall go."
    )


def _beside_others(solver: ContactSolver, solution: Solution, turning: np.ndarray) -> str:
    """Say that there are other answers with friction, if it is proved."""
    loop, status, pressure = solver.loop, solution.status, solution.pressure_force
    touching = np.flatnonzero(status != Status.FREE)
    slips = np.flatnonzero(status[touching] == Status.SLIP)
    degenerate = (solution.gap <= 0.0) & (pressure <= SEEN * pressure.max(initial=0.0))
    if not slips.size or degenerate.any() or loop.given[touching[slips]].any():
        return ""
    frame, d = loop.frame[touching], loop.shape[1]
    tangents = (slips[:, None] * d + np.arange(1, d)).ravel()
    nodes = touching[slips]
    slip = solution.displacement[loop.nodes[nodes]] - solver.posed.reference[nodes]
    slip = np.einsum("cab,cb->ca", loop.frame[nodes], slip)
    least = SEEN * max(np.abs(solution.displacement).max(), np.abs(solver.posed.reference).max())
    if np.linalg.norm(slip[:, 1:], axis=1).min() <= least:
        return ""
    by_pressure, support = _friction(solver, solution.pressure_force[nodes], nodes, slip, turning)
    S, G = _stiffness(solver.correction, touching, frame)
    rubbed = (by_pressure[:, :, None] * S[slips * d][:, None, tangents]).reshape(tangents.size, -1)
    if not is_negative(reduced_tangent(S, G, tangents, block_diagonal(support), rubbed)):
        return ""
    posed, rigid = solver.posed, solver.rigid
    if rigid.count and not rigid.bears(posed.load, loop.normal, 0.0, BALANCE):
        return ""
    mu = float(np.max(loop.coefficient[touching]))
    return (
        f"There are other answers than this one: with mu = {mu:g} and {slips.size} of {touching.size} nodes "
        "that touch in slip, the determinant of the tangent is negative, while the signs of all answers add "
        "up to 1. No load that only grows leads to this one; take load steps, or more of them, or a smaller "
        "mu, or prescribe the motion in place of the force."
    )


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
    S: np.ndarray, G: np.ndarray, moves: np.ndarray, added: np.ndarray, rubbed: np.ndarray | None = None
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
    rubbed : (t, t), optional
        Likewise, by friction that follows the forces S u.

    Returns
    -------
    (t, t)
        With the sign of the determinant, and if it is symmetric as many negative eigenvalues, as (1).

    Raises
    ------
    LinAlgError
        If rounding has left nothing of S in some motion.
    """
    resists, N = S[np.ix_(moves, moves)], np.zeros((moves.size, 0))
    if G.shape[1]:
        N = np.linalg.qr(G[moves] @ null_space(np.delete(G, moves, axis=0), 1.0))[0]
    J, m = added if rubbed is None else added + rubbed, N.shape[1]
    if m:
        Q = np.linalg.qr(N, mode="complete")[0]
        resists, J = Q[:, m:].T @ resists @ Q[:, m:], Q.T @ J @ Q
        J[:, :m] = Q.T @ added @ Q[:, :m]  # no force S u follows a rigid motion
    L = np.linalg.cholesky(resists)
    J = np.vstack([J[:m], solve_triangular(L, J[m:], lower=True)])
    J = np.hstack([J[:, :m], solve_triangular(L, J[:, m:].T, lower=True).T])
    J[m:, m:] += np.eye(len(L))
    size = np.maximum(np.abs(J).max(axis=0), np.abs(J).max(axis=1))
    scale = 1.0 / np.sqrt(np.where(size > 0.0, size, 1.0))
    return np.asarray(scale[:, None] * J * scale)


def is_negative(J: np.ndarray) -> bool:
    """Whether the determinant of J (t, t) is negative, by more than rounding."""
    factor, swaps, _ = dgetrf(J)
    if dgecon(factor, np.abs(J).sum(axis=0).max())[0] <= SURE:
        return False
    odd = np.count_nonzero(swaps != np.arange(swaps.size)) + np.count_nonzero(factor.diagonal() < 0.0)
    return odd % 2 == 1


def _friction(
    solver: ContactSolver,
    pressure: np.ndarray,
    nodes: np.ndarray,
    slip: np.ndarray,
    turning: np.ndarray,
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
        C = (loop.frame[c] @ turning[c] @ loop.frame[c].T)[1:, 1:]
        support[row] = (farther - beta) / (STEP * s) * along + across
        support[row] += C + (beta / p) ** 2 * along @ C + across @ C * (slip[row, 0] / p)
    return by_pressure, support
