"""Semismooth Newton for the small dense contact problem.

A Newton step solves for what has been decided (free, slip, stick), the friction force of slipping nodes
following their pressure and slip; a sweep of the node loop then decides again. Steps go on as long as the
natural residual falls (with a watchdog, Chamberlain et al., Math. Program. Study 16 (1982)); one that would
raise it, as where friction turns to and fro, is shortened.

Everything here is in the frames of the nodes: component 0 along the normal, the others along the tangents.
`bound` is the address of the friction law, None without friction.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from model.node_loop.contact_sweep import (
    FREE,
    SLIP,
    Candidates,
    close_gap,
    place_all_on_surface,
    slip_along,
    stick_or_slip,
)
from model.node_loop.friction_laws import allowed
from model.node_loop.friction_tangent import friction_tangent
from model.node_loop.natural_residual import admissible_force, jump
from model.problem.rigid_modes import free_modes
from model.solvers.convergence_record import ASTRAY
from model.solvers.iterative_refinement import ROUNDING

CHAIN = 5  # Newton steps that may pass before the residual must have halved
TRIALS = 4  # parts of a step, each half of the last, of which one is taken
QUICK = 0.1  # of the residual: after a Newton step that leaves no more a sweep must not raise it by rounding


class Condensed(NamedTuple):
    """The arrays of a small problem.

    Attributes
    ----------
    S, bare : (k s, k s) stiffness, with springs and without
    Y, Z : (k s, p), (p, p) what moves the pins
    G : (k s, m) rigid modes, orthonormal, S G = 0
    nodes : (k,) 0, 1, 2, ...
    frame : (k, s, s) unit matrices: the problem is in the nodes' frames already
    block, inverse : (k, s, s) diagonal blocks of S, and their inverses
    steps : (2,) steps of Newton and changes along paths so far; the most in one small problem
    """

    S: np.ndarray
    bare: np.ndarray
    Y: np.ndarray
    Z: np.ndarray
    G: np.ndarray
    nodes: np.ndarray
    frame: np.ndarray
    block: np.ndarray
    inverse: np.ndarray
    steps: np.ndarray


class Found(NamedTuple):
    """Displacement, status and force with the least residual that was found, and whether it is enough."""

    u: np.ndarray
    status: np.ndarray
    force: np.ndarray
    converged: bool


@njit(cache=True, error_model="numpy")
def newton(arrays, contact, b, start, start_status, bound, slip_rate, tolerance, slight, chain=CHAIN):
    """Take Newton's steps from a displacement (k, d) and status (k,) as long as the residual falls."""
    u, status, R, pushed = start.copy(), start_status.copy(), np.empty_like(start), np.empty_like(start)
    place_all_on_surface(contact, u, status)
    after = best = residual_of(arrays, contact, b, u, status, R, pushed, bound, slip_rate)
    trial, decided, force, mark, idle = u.copy(), status.copy(), pushed.copy(), best, 0
    while idle < chain and best > max(tolerance, rounding_of(arrays, b, u, force, 0.0)):
        step, driven = newton_step(arrays, contact, trial, decided, R, pushed, bound, slip_rate, slight)
        if driven:
            break
        after = search(arrays, contact, b, trial, step, decided, R, pushed, bound, slip_rate, after)
        quick = after <= QUICK * best
        if after < best:
            u[:], status[:], force[:], best = trial, decided, pushed, after
        sweep(arrays, contact, b, trial, decided, bound, slip_rate)
        after = residual_of(arrays, contact, b, trial, decided, R, pushed, bound, slip_rate)
        if after < best:
            u[:], status[:], force[:], best = trial, decided, pushed, after
        elif quick:
            trial[:], decided[:] = u, status
            after = residual_of(arrays, contact, b, trial, decided, R, pushed, bound, slip_rate)
        idle += 1
        if best < 0.5 * mark:
            mark, idle = best, 0
    return Found(u, status, force, best <= max(tolerance, rounding_of(arrays, b, u, force, slight)))


@njit(cache=True, error_model="numpy")
def search(arrays, contact, b, u, step, status, R, force, bound, slip_rate, before):
    """Take a step, or the part of it that leaves less residual than before; else the part that leaves least.

    Return the residual; R and force belong to it.
    """
    start, least, best = u.copy(), np.inf, 1.0
    for trial in range(TRIALS + 1):
        part = 0.5**trial if trial < TRIALS else best
        u[:] = start + part * step
        place_all_on_surface(contact, u, status)
        after = residual_of(arrays, contact, b, u, status, R, force, bound, slip_rate)
        if after < least:
            least, best = after, part
        if after < before:
            break
    return after


@njit(cache=True, error_model="numpy")
def newton_step(arrays, contact, u, status, R, force, bound, slip_rate, slight):
    """Step (k, d) for the unknowns that are linear at present, friction following the pressure and slip.

    Nodes that graze do so after the step, or leave the road or press on it, in status, R and force too.
    Return whether the load drives a rigid mode that is free at present as well.
    """
    while True:
        step, driven = linear_step(arrays, contact, u, status, R, force, bound, slip_rate, slight)
        if bound is None or not graze_no_more(arrays.S, contact, u, step, status, R, force, bound, slip_rate):
            return step, driven


@njit(cache=True, error_model="numpy")
def linear_step(arrays, contact, u, status, R, force, bound, slip_rate, slight):
    """Solve for a step as `newton_step` with the nodes that graze at present."""
    (k, d), S = u.shape, arrays.S
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
        missing[row] -= by_pressure[c, a] * R[c, 0]
        for column in range(numbers.size):
            J[row, column] = S[numbers[row], numbers[column]]
            if status[c] == SLIP:
                J[row, column] -= by_pressure[c, a] * S[c * d, numbers[column]]
            if numbers[column] // d == c:
                rubbed[row, column] = support[c, a, numbers[column] % d]
    J += rubbed
    if bound is not None:
        let_graze(contact, u, S, R, force, status, numbers, J, missing)
    largest = max(np.abs(J).max(), 1e-300)
    N = free_modes(arrays.G, ~moves.reshape(k * d))
    if N.shape[1]:  # friction resists that it would have to turn with the slip
        sizes, directions = np.linalg.eigh(N.T @ rubbed @ N)
        N = N @ directions[:, sizes <= ROUNDING * largest].copy()
    drive = N.T @ missing
    if np.sum(drive**2) > slight**2 + 1e-3 * np.sum(missing**2):
        return step.reshape(k, d), True
    arrays.steps[0] += 1
    try:
        step[numbers] = np.linalg.solve(J + largest * (N @ N.T), missing - N @ drive)
    except Exception:  # exactly singular: these slips have no unique answer, and a sweep or the path decides
        step[:] = 0.0
    return step.reshape(k, d), False


@njit(cache=True, error_model="numpy")
def let_graze(contact, u, S, R, force, status, numbers, J, missing):
    """Where nodes graze, ask in the rows of J along their slip for no pressure, not for given friction."""
    d = force.shape[1]
    for c in range(status.size):
        if is_grazing(status[c], force[c]):
            t, _ = direction_of_slip(contact, c, u)
            first = np.searchsorted(numbers, c * d + 1)
            mine = slice(first, first + d - 1)
            missing[mine] += t * (R[c, 0] - t @ missing[mine])
            for column in range(numbers.size):
                J[mine, column] += t * (S[c * d, numbers[column]] - np.sum(t * J[mine, column]))


@njit(cache=True, error_model="numpy")
def graze_no_more(S, contact, u, step, status, R, force, bound, slip_rate):
    """Lift grazing nodes whose friction would drive them after a step, press those that need more of it.

    Return whether there were any.
    """
    d, changed = force.shape[1], False
    for c in range(status.size):
        if not is_grazing(status[c], force[c]):
            continue
        t, slip = direction_of_slip(contact, c, u)
        after = force[c] - R[c] + S[c * d : (c + 1) * d] @ step.reshape(step.size)
        friction, slip = -t @ after[1:], max(slip + t @ step[c, 1:], 0.0)
        if friction < 0.0:
            status[c] = FREE
            R[c] -= force[c]
            force[c] = 0.0
        elif friction > jump(bound, slip_rate * slip, contact.state[c]):
            force[c, 0] = np.sqrt(np.sum(force[c] ** 2))  # any pressure: the step is from there
            R[c, 0] += force[c, 0]
        else:
            continue
        changed = True
    return changed


@njit(cache=True, error_model="numpy")
def is_grazing(status, force):
    """Whether a node bears friction without pressure."""
    return status == SLIP and force[0] == 0.0 and np.any(force != 0.0)


@njit(cache=True, error_model="numpy")
def direction_of_slip(contact, c, u):
    """Unit vector (d - 1,) of a node's slip, and its length."""
    s = np.empty(u.shape[1] - 1)
    for a in range(s.size):
        s[a] = slip_along(contact, c, u, a + 1)
    length = np.sqrt(np.sum(s**2))
    return s / length, length


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
        p = max(force[c, 0] - contact.block[c, 0, 0] * gap, 0.0)
        if bound is None:
            force[c, 0], force[c, 1:] = p, 0.0
        else:
            admissible_force(contact, c, u, p, status[c], bound, slip_rate, force[c])
    R += force
    missing = np.sqrt(np.sum(R**2))
    scale = np.sqrt(np.sum(b**2)) + np.sqrt(np.sum(force**2))
    return missing / scale if scale > 0.0 else 0.0  # nothing pushes, nothing is missing


@njit(cache=True, error_model="numpy")
def rounding_of(arrays, b, u, force, slight):
    """Natural residual that the rounding of S u alone may leave, or slight forces."""
    size = np.abs(arrays.S) @ np.abs(u).reshape(u.size)
    scale = np.sqrt(np.sum(b**2)) + np.sqrt(np.sum(force**2))
    if scale == 0.0:
        return 1.0
    return max(min(2 * ROUNDING * np.sqrt(np.sum(size**2)) / scale, ASTRAY), slight / scale)


@njit(cache=True, error_model="numpy")
def secants(contact, u, status, force, bound, slip_rate, edges):
    """Ratios (k,) of friction to pressure; ways (k, m, d - 1) along the road, the first against friction.

    m is the number of edges in space, 2 in the plane, 0 without friction.
    """
    k, d = u.shape
    mu, edges = np.zeros(k), 0 if bound is None else 2 if d == 2 else edges
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
