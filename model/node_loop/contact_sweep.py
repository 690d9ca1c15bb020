"""The paper's algorithm.

Visit each node, relax it, and put it in order with the road (figure 2 of the paper).

A node that is not a candidate is relaxed (eq. (9)). A candidate is relaxed as if it were free: if it then
stays above the road it is free, and any tensile force on it is gone. If it would end below the road it is put
back on the surface, g = 0. There it sticks, or, where that takes more than the friction law gives, slips,
with the force at the law's bound, against the slip, and the pressure that of the slipped position. Each
node's little problem is solved exactly.

Displacements are global; each candidate has a frame (rows: normal from the road into the body, then tangents)
in which its block of A is kept as well, so that 2-D, 3-D and inclined roads share the code.
"""

from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numba import njit

from model.node_loop.blocks import (
    FUSED,
    BlockMatrix,
    flat,
    relax,
    relax_2,
    row_defect_2,
    row_defect_3,
    row_defect_any,
)
from model.node_loop.friction_laws import allowed
from model.node_loop.prefetch import AHEAD
from model.node_loop.status import Status

FREE, SLIP, STICK = map(int, Status)  # whole arrays are compared with these in compiled code
SECANTS = 200  # steps at most: guarded by bisection, of which 50 come down to rounding
EXACT = 1e-15  # of the tangential force: some roundings
SLIPS = 1e-300  # a slip that tells a law of friction that the node moves, but not how fast


class Candidates(NamedTuple):
    """What the loop knows of the nodes that may touch, n of N.

    Attributes
    ----------
    nodes : (n,) their block rows
    number : (N,) position of each node in `nodes`, -1 elsewhere
    frame : (n, d, d) rows: normal (from the road into the body), tangents
    block : (n, d, d) the node's diagonal block of A in that frame
    gap : (n,) distance to the road at zero displacement
    reference : (n, d - 1) tangential displacement at which the node sticks, in its frame
    state : (n, 1 + m) what friction laws are told of the node: 1.0 where it slipped at the end of the last
        step, then the law's m parameters
    """

    nodes: np.ndarray
    number: np.ndarray
    frame: np.ndarray
    block: np.ndarray
    gap: np.ndarray
    reference: np.ndarray
    state: np.ndarray


def frames(normal: np.ndarray) -> np.ndarray:
    """Orthonormal frames (n, d, d) whose first rows are the unit normals (n, d)."""
    n, d = normal.shape
    frame = np.empty((n, d, d))
    frame[:, 0] = normal
    if d == 2:
        frame[:, 1, 0], frame[:, 1, 1] = normal[:, 1], -normal[:, 0]
        return frame
    axis = np.eye(3)[np.argmin(np.abs(normal), axis=1)]
    first = axis - np.sum(axis * normal, axis=1, keepdims=True) * normal
    frame[:, 1] = first / np.linalg.norm(first, axis=1, keepdims=True)
    frame[:, 2] = np.cross(normal, frame[:, 1])
    return frame


@njit(cache=True, error_model="numpy")
def close_gap(contact, c, inverse, r, u):
    """Relax candidate `c` with defect `r`.

    Where it penetrates, return it to the surface by the normal force that takes. Return the status.
    """
    i = contact.nodes[c]
    d = r.size
    gap = contact.gap[c]
    compliance = 0.0  # n . D^-1 n
    for a in range(d):
        s = 0.0
        for b in range(d):
            s += inverse[i, a, b] * r[b]
            compliance += contact.frame[c, 0, a] * inverse[i, a, b] * contact.frame[c, 0, b]
        u[i, a] += s
        gap += contact.frame[c, 0, a] * u[i, a]
    if gap >= 0.0:
        return Status.FREE
    force = -gap / compliance
    for a in range(d):
        for b in range(d):
            u[i, a] += inverse[i, a, b] * contact.frame[c, 0, b] * force
    place_on_surface(contact, c, u)
    return Status.SLIP


@njit(cache=True, error_model="numpy")
def place_on_surface(contact, c, u):
    """Set the normal displacement of candidate `c` to exactly minus its gap.

    Its tangential displacement stays.
    """
    i = contact.nodes[c]
    normal = contact.frame[c, 0]
    along = 0.0
    for a in range(normal.size):
        along += normal[a] * u[i, a]
    for a in range(normal.size):
        u[i, a] = (u[i, a] - along * normal[a]) - contact.gap[c] * normal[a]


@njit(cache=True, error_model="numpy")
def place_all_on_surface(contact, u, status):
    """Put every candidate below the road, or held by `status` (n,), on the surface; update `status`.

    Sticking ones are placed exactly where they stick: rounding must not look like slip.
    """
    d = u.shape[1]
    for c in range(status.size):
        i, gap = contact.nodes[c], contact.gap[c]
        for a in range(d):
            gap += contact.frame[c, 0, a] * u[i, a]
        if status[c] == STICK:
            for a in range(d):
                u[i, a] = -contact.gap[c] * contact.frame[c, 0, a]
                for b in range(1, d):
                    u[i, a] += contact.reference[c, b - 1] * contact.frame[c, b, a]
        elif gap < 0.0 or status[c] != FREE:
            place_on_surface(contact, c, u)
            status[c] = SLIP


@njit(cache=True, error_model="numpy")
def slip_along(contact, c, u, a):
    """Slip of candidate c along its tangent a."""
    s = -contact.reference[c, a - 1]
    for b in range(u.shape[1]):
        s += contact.frame[c, a, b] * u[contact.nodes[c], b]
    return s


@njit(cache=True, error_model="numpy")
def stick_or_slip(contact, c, inverse, r, u, bound, slip_rate):
    """Relax candidate `c` with defect `r` (both overwritten) under friction: free, stick or slip, exactly.

    Return the status.
    """
    i = contact.nodes[c]
    d = r.size
    gap = contact.gap[c]
    for a in range(d):  # where would it go if it were free?
        s = u[i, a]
        for b in range(d):
            s += inverse[i, a, b] * r[b]
        gap += contact.frame[c, 0, a] * s
    if gap >= 0.0:
        for a in range(d):
            for b in range(d):
                u[i, a] += inverse[i, a, b] * r[b]
        return Status.FREE
    D = contact.block[c]
    step = np.empty(d)  # from the old position to the sticking one, in the frame
    force = np.empty(d)  # of the road, at the sticking position
    for a in range(d):
        step[a] = -contact.gap[c] if a == 0 else contact.reference[c, a - 1]
        force[a] = 0.0
        for b in range(d):
            step[a] -= contact.frame[c, a, b] * u[i, b]
            force[a] -= contact.frame[c, a, b] * r[b]
    for a in range(d):
        for b in range(d):
            force[a] += D[a, b] * step[b]
    slip = np.zeros(d)
    status = Status.STICK
    tangential = 0.0
    for a in range(1, d):
        tangential += force[a] ** 2
    tangential = np.sqrt(tangential)
    if tangential > allowed(bound, max(force[0], 0.0), 0.0, contact.state[c]):
        status = Status.SLIP
        if d == 2:
            slip_2d(D, force, tangential, bound, slip_rate, contact.state[c], slip)
        else:
            slip_3d(D, force, bound, slip_rate, contact.state[c], slip)
    for a in range(d):
        u[i, a] = -contact.gap[c] * contact.frame[c, 0, a]
    for b in range(1, d):
        for a in range(d):
            u[i, a] += contact.frame[c, b, a] * (contact.reference[c, b - 1] + slip[b])
    return status


@njit(cache=True, error_model="numpy")
def slip_2d(D, force, tangential, bound, slip_rate, state, slip):
    """Slip m >= 0 against the friction force.

    |f_t| - D_tt m = bound(p - s D_nt m, m), s the sign of the sticking force f_t.

    The left side falls to zero at m = |f_t| / D_tt, where the bound is >= 0, so a root lies in between; for
    Coulomb's law the equation is linear and one secant step is exact.
    """
    sign = 1.0 if force[1] > 0.0 else -1.0

    def excess(m):
        p = max(force[0] - sign * D[0, 1] * m, 0.0)
        return tangential - D[1, 1] * m - allowed(bound, p, max(slip_rate * m, SLIPS), state)

    low, high = 0.0, tangential / D[1, 1]
    at_low, at_high = excess(low), excess(high)
    m = high
    for _ in range(SECANTS):
        if at_low <= 0.0:  # kinetic below static can leave no slip at all
            m = low
            break
        m = low + (high - low) * at_low / (at_low - at_high)
        at_m = excess(m)
        if abs(at_m) <= EXACT * tangential or not low < m < high:
            break
        if at_m > 0.0:
            low, at_low, at_high = m, at_m, 0.5 * at_high
        else:
            high, at_high, at_low = m, at_m, 0.5 * at_low
    slip[1] = -sign * m


@njit(cache=True, error_model="numpy")
def slip_3d(D, force, bound, slip_rate, state, slip):
    """Slip w of a node on the friction disc: f_t + D_tt w = -bound(p + d . w, |w|) w/|w|, with d = D_nt.

    With k the ratio of friction force to slip, (D_tt + k I) w = -f_t; k runs over [0, inf) and is found by
    bisection-guarded secant steps in x = k/(k + scale), where both ends have opposite signs for any friction
    law.
    """
    scale = 0.5 * (D[1, 1] + D[2, 2])
    low, high = 0.0, 1.0
    at_low, at_high = -1.0, 1.0
    tangential = np.sqrt(force[1] ** 2 + force[2] ** 2)
    x = 0.5
    for sweep in range(SECANTS):
        a11 = D[1, 1] * (1.0 - x) + x * scale
        a22 = D[2, 2] * (1.0 - x) + x * scale
        a12 = D[1, 2] * (1.0 - x)
        determinant = a11 * a22 - a12 * a12
        w1 = -(a22 * force[1] - a12 * force[2]) / determinant
        w2 = -(a11 * force[2] - a12 * force[1]) / determinant
        slip[1], slip[2] = (1.0 - x) * w1, (1.0 - x) * w2
        length = np.sqrt(w1 * w1 + w2 * w2)
        p = max(force[0] + D[0, 1] * slip[1] + D[0, 2] * slip[2], 0.0)
        at_x = x * scale * length - allowed(bound, p, max(slip_rate * (1.0 - x) * length, SLIPS), state)
        if abs(at_x) <= EXACT * tangential or high - low <= 0.1 * EXACT:
            break
        if at_x < 0.0:
            low, at_low = x, at_x
            at_high *= 0.5
        else:
            high, at_high = x, at_x
            at_low *= 0.5
        x = low + (high - low) * at_low / (at_low - at_high)
        if sweep < 2 or not low < x < high:
            x = 0.5 * (low + high)


@lru_cache
def contact_sweeps(dim: int, friction: bool) -> Any:
    """Compile the loop for blocks of `dim`; without friction its code is not part of it.

    The result is sweeps(count, A, inverse, load, u, order, contact, status, bound, slip_rate): `count` sweeps
    over the nodes in `order`, updating u (N, d) and status (n,) in place. `bound` is the friction law's
    function (None without friction).
    """

    @njit(cache=True, error_model="numpy", fastmath=FUSED)
    def sweeps(count, A, inverse, load, u, order, contact, status, bound, slip_rate):
        r, M = np.empty(dim), BlockMatrix(A.indptr, A.indices, flat(A.data))
        D, b, x = flat(inverse), flat(load), flat(u)
        for _ in range(count):
            for i in order:
                if dim == 2:
                    row = row_defect_2(M, A.indptr[i], A.indptr[i + 1], b, x, i, AHEAD)
                elif dim == 3:
                    row = row_defect_3(M, A.indptr[i], A.indptr[i + 1], b, x, i, AHEAD)
                else:
                    row = row_defect_any(M, A.indptr[i], A.indptr[i + 1], b, x, i, r)
                c = contact.number[i]
                if c < 0:
                    if dim == 2:
                        relax_2(D, i, row, x)
                    else:
                        relax(D, i, row, x)
                    continue
                for a in range(dim):
                    r[a] = row[a]
                if friction:
                    status[c] = stick_or_slip(contact, c, inverse, r, u, bound, slip_rate)
                else:
                    status[c] = close_gap(contact, c, inverse, r, u)

    return sweeps
