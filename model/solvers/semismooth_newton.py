"""A small dense contact problem in which every node is a candidate: the node loop, helped by Newton steps.

The loop alone would solve it; Newton steps on what the loop has decided (free, slip, stick) make it quick. A
chain of steps that does not lower the natural residual is dropped, and the loop goes on alone for longer:
contact sets that flip for ever are left to it. All of it is compiled, for it runs once or more a time step.

Everything here is in the frames of the nodes: component 0 along the normal, the others along the tangents.
`bound` is the address of the friction law, None without friction.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from scipy.linalg.lapack import dpotrf, dpotri

from model.node_loop.blocks import BlockMatrix, generalised_inverses
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
from model.node_loop.natural_residual import admissible_traction
from model.solvers.pivoting import contact_by_pivoting
from model.solvers.projected_newton import project_newton

CHAIN = 12  # Newton steps that may pass before the residual must have fallen
PATIENCE = 20  # chains that may fail


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
    sides : int
        s.
    friction : FrictionLaw or None
        The law; None where s = 1.
    """

    def __init__(
        self, W: np.ndarray, G: np.ndarray, resistance: np.ndarray, sides: int, friction: FrictionLaw | None
    ):
        k = W.shape[0] // sides
        S, Y, Z = bordered_inverse(W, G, resistance)
        free = G[:, np.abs(resistance).sum(axis=0) == 0.0]
        self.arrays = Condensed(
            S,
            W if G.shape[1] == 0 else np.empty((0, 0)),
            Y,
            Z,
            free,
            BlockMatrix(
                np.arange(0, k * k + 1, k, dtype=np.uint64),
                np.tile(np.arange(k, dtype=np.uint32), k),
                np.empty((k * k, sides, sides)),
            ),
            np.arange(k),
            *(np.empty((k, sides, sides)) for _ in range(5)),
        )
        prepare(self.arrays)
        self._bound = None if friction is None else friction.address

    def solve(
        self,
        whole: Candidates,
        active: np.ndarray,
        u: np.ndarray,
        free: np.ndarray,
        power: np.ndarray,
        gap: np.ndarray,
        after: np.ndarray,
        known: np.ndarray,
        status: np.ndarray,
        slip_rate: float,
        tolerance: float,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Find the forces that the nodes miss, all others in equilibrium.

        Parameters
        ----------
        whole : Candidates
            All candidates, n of them.
        active : (k,)
            The numbers among them of the nodes of this problem.
        u, free : (N, d)
            Displacement, and where it would go from there with the known forces alone and the pins at rest.
        power : (p,)
            Work of the known forces when the pins move by a unit.
        gap, after : (n,)
            Gaps at u, and as they would be by what has been found so far: where to start.
        known : (n, d)
            Known forces of the road.
        status : (n,)
            First guess, updated in place.
        slip_rate : float
            What slip is multiplied by for the friction law.
        tolerance : float
            Natural residual at which to stop; rounding may stop it earlier, which the caller's own residual
            will tell.

        Returns
        -------
        force : (k, d)
            Forces of the road that are missing.
        pins : (p,)
            Displacements of the pins.
        """
        force, pins = np.empty((active.size, u.shape[1])), np.empty(power.size)
        solve_active(
            self.arrays,
            whole,
            active,
            u,
            free,
            power,
            gap,
            after,
            known,
            status,
            force,
            pins,
            self._bound,
            slip_rate,
            tolerance,
        )
        return force, pins


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


class Condensed(NamedTuple):
    """The arrays of a small problem.

    Attributes
    ----------
    S : (k s, k s) stiffness
    W : (k s, k s) its inverse; empty where there are pins
    Y, Z : (k s, p), (p, p) what moves the pins
    G : (k s, m) rigid modes, S G = 0
    blocks : BlockMatrix, S once more
    nodes : (k,) 0, 1, 2, ...
    frame : (k, s, s) unit matrices: the problem is in the nodes' frames already
    block, inverse : (k, s, s) diagonal blocks of S, and their inverses
    alone, yielding : (k, s, s) inverses of the diagonal blocks of W, and these
    """

    S: np.ndarray
    W: np.ndarray
    Y: np.ndarray
    Z: np.ndarray
    G: np.ndarray
    blocks: BlockMatrix
    nodes: np.ndarray
    frame: np.ndarray
    block: np.ndarray
    inverse: np.ndarray
    alone: np.ndarray
    yielding: np.ndarray


@njit(cache=True, error_model="numpy")
def prepare(arrays):
    """Fill in the stiffness from its lower triangle, and the rest."""
    S = arrays.S
    k, s = arrays.block.shape[:2]
    for i in range(k * s):
        for j in range(i):
            S[j, i] = S[i, j]
    for c in range(k):
        for e in range(k):
            for a in range(s):
                for b in range(s):
                    arrays.blocks.data[c * k + e, a, b] = S[c * s + a, e * s + b]
        for a in range(s):
            for b in range(s):
                arrays.frame[c, a, b] = 1.0 if a == b else 0.0
                arrays.block[c, a, b] = S[c * s + a, c * s + b]
                arrays.yielding[c, a, b] = 0.0 if arrays.W.size == 0 else arrays.W[c * s + a, c * s + b]
    generalised_inverses(arrays.block, arrays.nodes, arrays.inverse)
    if arrays.W.size:
        generalised_inverses(arrays.yielding, arrays.nodes, arrays.alone)


@njit(cache=True, error_model="numpy")
def solve_active(
    arrays, whole, active, u, free, power, gap, after, known, status, force, pins, bound, slip_rate, tolerance
):
    """Fill `force` (k, d), `pins` and the status (n,) of the active candidates, in global components."""
    k, s = arrays.block.shape[:2]
    d = force.shape[1]
    target, b, move, local = np.empty(k * s), np.zeros((k, s)), np.zeros((k, s)), np.zeros((k, s))
    gaps, state, found = np.empty(k), np.empty(k), np.empty((k, s))
    reference, decided = np.empty((k, s - 1)), np.empty(k, dtype=status.dtype)
    for j in range(k):
        c = active[j]
        i = whole.nodes[c]
        gaps[j], state[j], decided[j] = gap[c], whole.state[c], status[c]
        for a in range(s):
            go, been = 0.0, 0.0
            for e in range(d):
                go += whole.frame[c, a, e] * free[i, e]
                been += whole.frame[c, a, e] * u[i, e]
                local[j, a] += whole.frame[c, a, e] * known[c, e]
            target[j * s + a] = go
            b[j, a] -= local[j, a]
            if a > 0:
                reference[j, a - 1] = whole.reference[c, a - 1] - been
    for i in range(k * s):
        for j in range(k * s):
            b[i // s, i % s] += arrays.S[i, j] * target[j]
        for q in range(power.size):
            b[i // s, i % s] += arrays.Y[i, q] * power[q]
    contact = Candidates(arrays.nodes, arrays.nodes, arrays.frame, arrays.block, gaps, reference, state)
    if bound is None:
        move[:, 0] = after[active] - gaps
        project_newton(arrays, contact, b[:, 0], move, decided, found, tolerance)
    else:
        solve_small(arrays, contact, b, move, decided, found, bound, slip_rate, tolerance)
    for q in range(power.size):
        pins[q] = 0.0
        for e in range(power.size):
            pins[q] -= arrays.Z[q, e] * power[e]
        for i in range(k * s):
            pins[q] += arrays.Y[i, q] * (move[i // s, i % s] - target[i])
    for j in range(k):
        c = active[j]
        status[c] = decided[j]
        for e in range(d):
            force[j, e] = 0.0
            for a in range(s):
                force[j, e] += whole.frame[c, a, e] * (found[j, a] - local[j, a])


@njit(cache=True, error_model="numpy")
def hold_sticking(contact, u, status):
    """Place sticking nodes exactly where they stick: rounding must not look like slip."""
    for c in range(status.size):
        if status[c] == STICK:
            u[c, 0] = -contact.gap[c]
            for a in range(1, u.shape[1]):
                u[c, a] = contact.reference[c, a - 1]


@njit(cache=True, error_model="numpy")
def linear_unknowns(status, d):
    """Numbers of the unknowns that are linear at present: free nodes whole, slip nodes along the surface."""
    numbers = np.empty(status.size * d, dtype=np.int64)
    count = 0
    for c in range(status.size):
        for a in range(d):
            if status[c] == FREE or (status[c] == SLIP and a > 0):
                numbers[count] = c * d + a
                count += 1
    return numbers[:count]


@njit(cache=True, error_model="numpy")
def follow_friction(J, S, contact, u, force, status, bound, slip_rate, numbers):
    """Subtract from J, which is S at `numbers`, the derivative of each slipping node's friction force."""
    d = u.shape[1]
    for row in range(numbers.size):
        c, a = numbers[row] // d, numbers[row] % d
        if status[c] != SLIP:
            continue
        size, slip = 0.0, 0.0
        for e in range(1, d):
            size += force[c, e] ** 2
            slip += (u[c, e] - contact.reference[c, e - 1]) ** 2
        size, m = np.sqrt(size), slip_rate * np.sqrt(slip)
        if size == 0.0:
            continue
        p, state = force[c, 0], contact.state[c]
        dp, dm = 1e-6 * p + 1e-300, 1e-6 * m + 1e-300
        at = allowed(bound, p, m, state)
        by_pressure = (allowed(bound, p + dp, m, state) - at) / dp * force[c, a] / size
        by_slip = slip_rate * (allowed(bound, p, m + dm, state) - at) / dm
        turning = slip_rate * size / m if m > 0.0 else 0.0
        for column in range(numbers.size):
            J[row, column] -= by_pressure * S[c * d, numbers[column]]
            if numbers[column] // d == c:  # the force opposes the slip: |slip| grows by -direction . slip
                e = numbers[column] % d
                both = force[c, a] * force[c, e] / size**2
                J[row, column] += by_slip * both + turning * ((1.0 if a == e else 0.0) - both)


@njit(cache=True, error_model="numpy")
def judge(S, contact, b, u, status, R, force, bound, slip_rate):
    """Fill R and the admissible forces; return the natural residual and what rounding makes of it."""
    k, d = u.shape
    load, reaction, missing, rounding = 0.0, 0.0, 0.0, 0.0
    for c in range(k):
        for a in range(d):
            s, size = b[c, a], 0.0
            for j in range(k):
                for e in range(d):
                    product = S[c * d + a, j * d + e] * u[j, e]
                    s -= product
                    size += abs(product)
            R[c, a] = s
            force[c, a] = -s
            load += b[c, a] ** 2
            rounding += size**2
        gap = 0.0 if status[c] != FREE else contact.gap[c] + u[c, 0]
        p = max(force[c, 0] - contact.block[c, 0, 0] * gap, 0.0)
        force[c, 0] = p
        if bound is not None:
            admissible_traction(contact, c, u, p, status[c] == STICK, bound, slip_rate, force[c])
        for a in range(d):
            if bound is None and a > 0:
                force[c, a] = 0.0
            R[c, a] += force[c, a]
            missing += R[c, a] ** 2
            reaction += force[c, a] ** 2
    scale = np.sqrt(load) + np.sqrt(reaction)
    if scale == 0.0:
        return (0.0 if missing == 0.0 else 1.0), 0.0
    return np.sqrt(missing) / scale, 4e-16 * np.sqrt(rounding) / scale


@njit(cache=True, error_model="numpy")
def sweep(count, S, contact, inverse, b, u, status, bound, slip_rate):
    """Visit every node `count` times."""
    k, d = u.shape
    r = np.empty(d)
    for _ in range(count):
        for c in range(k):
            for a in range(d):
                s = b[c, a]
                for j in range(k):
                    for e in range(d):
                        s -= S[c * d + a, j * d + e] * u[j, e]
                r[a] = s
            if bound is not None:
                status[c] = stick_or_slip(contact, c, inverse, r, u, bound, slip_rate)
            else:
                status[c] = close_gap(contact, c, inverse, r, u)


@njit(cache=True, error_model="numpy")
def sweep_forces(count, arrays, contact, b, u, status, bound, slip_rate):
    """Visit every node `count` times: find its force, the others' given, and let all nodes move with it."""
    k, d = u.shape
    force, own, nothing = np.empty((k, d)), np.empty(d), np.zeros(d)
    lone = Candidates(
        contact.nodes,
        contact.number,
        contact.frame,
        arrays.alone,
        contact.gap,
        contact.reference,
        contact.state,
    )
    for i in range(k * d):
        s = -b[i // d, i % d]
        for j in range(k * d):
            s += arrays.S[i, j] * u[j // d, j % d]
        force[i // d, i % d] = s
    for _ in range(count):
        for c in range(k):
            for a in range(d):
                own[a] = u[c, a]
                for e in range(d):
                    own[a] -= arrays.yielding[c, a, e] * force[c, e]
            last, here = force[c].copy(), u[c].copy()
            u[c], nothing[:] = own, 0.0
            if bound is not None:
                status[c] = stick_or_slip(lone, c, arrays.yielding, nothing, u, bound, slip_rate)
            else:
                status[c] = close_gap(lone, c, arrays.yielding, nothing, u)
            for a in range(d):
                force[c, a] = 0.0
                for e in range(d):
                    force[c, a] += arrays.alone[c, a, e] * (u[c, e] - own[e])
            u[c] = here
            for a in range(d):
                change = force[c, a] - last[a]
                for j in range(k * d):
                    u[j // d, j % d] += arrays.W[j, c * d + a] * change


@njit(cache=True, error_model="numpy")
def part_until_rest(S, contact, u, R, force, status, numbers, step):
    """Part of a Newton step at which elastic energy and friction's work (present pressures) are least.

    Slip that would turn round stops instead: where friction alone holds the body, Newton's step has no end.
    """
    d = u.shape[1]
    slope, curvature = 0.0, 0.0
    for row in range(numbers.size):
        c, a = numbers[row] // d, numbers[row] % d
        slope -= step[row] * (R[c, a] - (force[c, a] if status[c] == SLIP else 0.0))
        for column in range(numbers.size):
            curvature += step[row] * S[numbers[row], numbers[column]] * step[column]
    low, high = 0.0, 1.0
    for count in range(100):
        part = 0.5 * (low + high) if count > 1 else 1.0 - count  # both ends first
        power, row = slope + part * curvature, 0
        while row < numbers.size:
            c = numbers[row] // d
            if status[c] != SLIP:
                row += 1
                continue
            friction, speed, slip = 0.0, 0.0, 0.0
            for a in range(1, d):  # of a slipping node all tangential unknowns are among the numbers
                s = u[c, a] - contact.reference[c, a - 1] + part * step[row]
                friction += force[c, a] ** 2
                speed += s * step[row]
                slip += s * s
                row += 1
            if slip > 0.0:
                power += np.sqrt(friction / slip) * speed
        if (count == 0 and power <= 0.0) or (count == 1 and power >= 0.0):
            return 1.0  # downhill all the way, or not at all
        if power > 0.0:
            high = part
        else:
            low = part
    return high


@njit(cache=True, error_model="numpy")
def newton_step(S, contact, u, status, R, force, bound, slip_rate):
    """Solve for the unknowns that are linear at present, the friction force of slipping nodes following."""
    d = u.shape[1]
    numbers = linear_unknowns(status, d)
    if numbers.size == 0:
        return
    J = np.empty((numbers.size, numbers.size))
    missing = np.empty(numbers.size)
    largest = 0.0
    for row in range(numbers.size):
        missing[row] = R[numbers[row] // d, numbers[row] % d]
        for column in range(numbers.size):
            J[row, column] = S[numbers[row], numbers[column]]
        largest = max(largest, abs(J[row, row]))
    if bound is not None:
        follow_friction(J, S, contact, u, force, status, bound, slip_rate, numbers)
    touching = np.count_nonzero(status)
    for row in range(numbers.size):  # what too few nodes hold falls as loaded, not as rounding has it
        J[row, row] += (1e-10 if touching < u.shape[1] else 1e-13) * largest
    try:
        step = np.linalg.solve(J, missing)
        if np.sum((1e-13 * largest * step) ** 2) > 0.01 * np.sum(missing**2):
            # the body slides or falls: not so far that rounding rules
            slides = touching == status.size or (touching > 1 and not np.any(status == STICK))
            for row in range(numbers.size):
                J[row, row] += (1e-5 if slides else 1e-9) * largest
            step = np.linalg.solve(J, missing)
    except Exception:  # no unique slip: leave it to the loop
        return
    part = 1.0 if bound is None else part_until_rest(S, contact, u, R, force, status, numbers, step)
    for row in range(numbers.size):
        u[numbers[row] // d, numbers[row] % d] += part * step[row]


@njit(cache=True, error_model="numpy")
def solve_small(arrays, contact, b, u, status, force, bound, slip_rate, tolerance):
    """Fill u (k, d), status (k,) and force (k, d) with the solution, status being the first guess as well."""
    S, inverse = arrays.S, arrays.inverse
    R = np.empty_like(u)
    place_all_on_surface(contact, u, status)
    hold_sticking(contact, u, status)
    best, rounding = judge(S, contact, b, u, status, R, force, bound, slip_rate)
    trial, trial_status, before = np.empty_like(u), np.empty_like(status), np.empty_like(status)
    sweeps, idle, lowest = 1, 0, best  # a sweep may undo what Newton steps have done, and they do it again
    while best > max(tolerance, min(rounding, 1e-8)) and idle < PATIENCE:
        trial[:], trial_status[:], after = u, status, best
        for _ in range(CHAIN):
            before[:] = trial_status
            newton_step(S, contact, trial, trial_status, R, force, bound, slip_rate)
            place_all_on_surface(contact, trial, trial_status)
            for c in range(status.size):
                if before[c] == FREE and trial_status[c] == SLIP:
                    trial_status[c] = STICK  # who touches sticks a priori; the sweep decides
            hold_sticking(contact, trial, trial_status)
            sweep(1, S, contact, inverse, b, trial, trial_status, bound, slip_rate)
            after, trial_rounding = judge(S, contact, b, trial, trial_status, R, force, bound, slip_rate)
            if after < best:
                break
        if after < best:
            idle = 0 if after < 0.5 * lowest else idle + 1
            lowest = min(after, lowest)
            u[:], status[:], best, rounding, sweeps = trial, trial_status, after, trial_rounding, 1
            continue
        idle += 1
        trial[:], trial_status[:] = u, status
        sweep(sweeps, S, contact, inverse, b, u, status, bound, slip_rate)
        best, rounding = judge(S, contact, b, u, status, R, force, bound, slip_rate)
        if arrays.W.size:  # a body that moves almost as one relaxes slowly, its forces quickly
            sweep_forces(sweeps, arrays, contact, b, trial, trial_status, bound, slip_rate)
            place_all_on_surface(contact, trial, trial_status)
            hold_sticking(contact, trial, trial_status)
            after, trial_rounding = judge(S, contact, b, trial, trial_status, R, force, bound, slip_rate)
            if after < best:
                u[:], status[:], best, rounding = trial, trial_status, after, trial_rounding
            else:
                judge(S, contact, b, u, status, R, force, bound, slip_rate)
        sweeps = min(4 * sweeps, 1024)
    if bound is not None and u.shape[1] == 2 and best > max(tolerance, min(rounding, 1e-8)):
        try_pivoting(S, contact, b, u, status, R, force, bound, slip_rate, best)
    judge(S, contact, b, u, status, R, force, bound, slip_rate)


@njit(cache=True, error_model="numpy")
def try_pivoting(S, contact, b, u, status, R, force, bound, slip_rate, best):
    """Start anew from what pivoting finds for the coefficients of friction at hand; keep the better end."""
    mu = np.empty(status.size)
    for c in range(mu.size):
        mu[c] = allowed(bound, 1.0, 0.0, contact.state[c])
    trial, decided, found = contact_by_pivoting(S, b, contact.gap, contact.reference, mu)
    if not found:
        return
    trial_status = decided.astype(status.dtype)
    for _ in range(CHAIN):
        place_all_on_surface(contact, trial, trial_status)
        hold_sticking(contact, trial, trial_status)
        after, _ = judge(S, contact, b, trial, trial_status, R, force, bound, slip_rate)
        if after < best:
            u[:], status[:], best = trial, trial_status, after
        newton_step(S, contact, trial, trial_status, R, force, bound, slip_rate)
