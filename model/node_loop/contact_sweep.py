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

from model.node_loop.block_arithmetic import put, relax, row_defect
from model.node_loop.blocks import FUSED
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
def gap_of(contact, c, u):
    """Distance of candidate c to the road."""
    gap = contact.gap[c]
    for a in range(u.shape[1]):
        gap += contact.frame[c, 0, a] * u[contact.nodes[c], a]
    return gap


@njit(cache=True, error_model="numpy")
def slip_along(contact, c, u, a):
    """Slip of candidate c along its tangent a."""
    s = -contact.reference[c, a - 1]
    for b in range(u.shape[1]):
        s += contact.frame[c, a, b] * u[contact.nodes[c], b]
    return s


@njit(cache=True, error_model="numpy")
def slip_of(contact, c, u):
    """Slip of candidate c along its tangents, a pair; in the plane the second is 0."""
    return slip_along(contact, c, u, 1), slip_along(contact, c, u, 2) if u.shape[1] == 3 else 0.0


@njit(cache=True, error_model="numpy")
def relax_candidate(contact, c, inverse, r, u):
    """Relax candidate c with defect r (d,) as if it were free; return its distance to the road."""
    i = contact.nodes[c]
    for a in range(r.size):
        s = 0.0
        for b in range(r.size):
            s += inverse[i, a, b] * r[b]
        u[i, a] += s
    return gap_of(contact, c, u)


@njit(cache=True, error_model="numpy")
def close_gap(contact, c, inverse, r, u):
    """Relax candidate `c` with defect `r`.

    Where it penetrates, return it to the surface by the normal force that takes. Return the status.
    """
    i, d, compliance = contact.nodes[c], r.size, 0.0  # n . D^-1 n
    gap = relax_candidate(contact, c, inverse, r, u)
    if gap >= 0.0:
        return Status.FREE
    for a in range(d):
        for b in range(d):
            compliance += contact.frame[c, 0, a] * inverse[i, a, b] * contact.frame[c, 0, b]
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
def place_slipped(contact, c, u, s, t):
    """Put candidate `c` on the road, slipped by s and, in space, t from where it sticks."""
    i = contact.nodes[c]
    for a in range(u.shape[1]):
        u[i, a] = -contact.gap[c] * contact.frame[c, 0, a]
        u[i, a] += (contact.reference[c, 0] + s) * contact.frame[c, 1, a]
        if u.shape[1] == 3:
            u[i, a] += (contact.reference[c, 1] + t) * contact.frame[c, 2, a]


@njit(cache=True, error_model="numpy")
def place_all_on_surface(contact, u, status):
    """Put every candidate below the road, or held by `status` (n,), on the surface; update `status`.

    Sticking ones are placed exactly where they stick: rounding must not look like slip.
    """
    for c in range(status.size):
        if status[c] == STICK:
            place_slipped(contact, c, u, 0.0, 0.0)
        elif status[c] != FREE or gap_of(contact, c, u) < 0.0:
            place_on_surface(contact, c, u)
            status[c] = SLIP


@njit(cache=True, error_model="numpy")
def stick_or_slip(contact, c, inverse, r, u, bound, slip_rate):
    """Relax candidate `c` with defect `r` under friction: free, stick or slip, exactly.

    Return the status.
    """
    d, D, state = r.size, contact.block[c], contact.state[c]
    # the road's force on the node that sticks
    away, (s, t) = gap_of(contact, c, u), slip_of(contact, c, u)
    force = np.empty(d)
    for a in range(d):
        force[a] = -(D[a, 0] * away + D[a, 1] * s + D[a, d - 1] * t)
        for b in range(d):
            force[a] -= contact.frame[c, a, b] * r[b]
    if relax_candidate(contact, c, inverse, r, u) >= 0.0:
        return Status.FREE
    tangential = np.sqrt(force[1] ** 2 + (force[2] ** 2 if d == 3 else 0.0))
    if tangential <= allowed(bound, max(force[0], 0.0), 0.0, state):
        place_slipped(contact, c, u, 0.0, 0.0)
        return Status.STICK
    if d == 2:
        place_slipped(contact, c, u, slip_2d(D, force, tangential, bound, slip_rate, state), 0.0)
    else:
        s, t = slip_3d(D, force, tangential, bound, slip_rate, state)
        place_slipped(contact, c, u, s, t)
    return Status.SLIP


@njit(cache=True, error_model="numpy")
def slip_2d(D, force, tangential, bound, slip_rate, state):
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
    return -sign * m


@njit(cache=True, error_model="numpy")
def slip_3d(D, force, tangential, bound, slip_rate, state):
    """Slip w of a node on the friction disc: f_t + D_tt w = -bound(p + d . w, |w|) w/|w|, with d = D_nt.

    With k the ratio of friction force to slip, (D_tt + k I) w = -f_t; k runs over [0, inf) and is found by
    bisection-guarded secant steps in x = k/(k + scale), where both ends have opposite signs for any friction
    law.
    """
    scale, x = 0.5 * (D[1, 1] + D[2, 2]), 0.5
    low, high, at_low, at_high = 0.0, 1.0, -1.0, 1.0
    for sweep in range(SECANTS):
        a11 = D[1, 1] * (1.0 - x) + x * scale
        a22 = D[2, 2] * (1.0 - x) + x * scale
        a12 = D[1, 2] * (1.0 - x)
        determinant = a11 * a22 - a12 * a12
        w1 = -(a22 * force[1] - a12 * force[2]) / determinant
        w2 = -(a11 * force[2] - a12 * force[1]) / determinant
        s, t, length = (1.0 - x) * w1, (1.0 - x) * w2, np.sqrt(w1 * w1 + w2 * w2)
        p = max(force[0] + D[0, 1] * s + D[0, 2] * t, 0.0)
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
    return s, t


@lru_cache
def contact_sweeps(dim: int, friction: bool) -> Any:
    """Compile the loop for blocks of `dim`; without friction its code is not part of it.

    The result is sweeps(count, A, inverse, load, u, order, contact, status, bound, slip_rate): `count` sweeps
    over the nodes in `order`, updating u (N, d) and status (n,) in place. `bound` is the friction law's
    function (None without friction).
    """

    @njit(cache=True, error_model="numpy", fastmath=FUSED)
    def sweeps(count, A, inverse, load, u, order, contact, status, bound, slip_rate):
        r = np.empty(dim)
        for _ in range(count):
            for i in order:
                row = row_defect(A, A.indptr[i], A.indptr[i + 1], load, u, i, AHEAD, False, dim)
                c = contact.number[i]
                if c < 0:
                    relax(inverse, i, row, u)
                    continue
                put(r, 0, row)
                if friction:
                    status[c] = stick_or_slip(contact, c, inverse, r, u, bound, slip_rate)
                else:
                    status[c] = close_gap(contact, c, inverse, r, u)

    return sweeps
