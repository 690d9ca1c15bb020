"""Path following: a finite way to solve small contact problems, with friction or without, from any start.

Away from a solution the forces that are missing, R = b + forces of the road - S u, are first added, and then
taken away:

    S u = b + forces of the road - (1 - t) R,     t from 0 to 1.                                          (1)

Let friction be bounded along directions t_a alone, mu p + t_a . tau >= 0: both ways in the plane, where that
is Coulomb's law, and a polygon around the disc in space. Then each node is free, sticks, or slips in one way
or between two; all is linear until a node changes, and (1) is followed from change to change: the unknown
that the node gains grows, whether t grows with it or falls. It is the path of Lemke's complementary pivoting,
which may start anywhere (J. Katzenelson, Bell Syst. Tech. J. 44 (1965); B. C. Eaves, SIAM Review 18 (1976);
D. Ralph, Math. Oper. Res. 19 (1994); with friction A. Klarbring, Int. J. Solids Struct. 22 (1986)).

From all nodes pressed to the road by a force so large that they stick there is no end without an answer, for
any mu, unless the load does work in a rigid motion that leads no node into the road: on a ray u', p', s' on
which it would end each term of

    u' . S u' + (pressing) . (v', s') + sum mu s'_a p' = 0

vanishes, so u' is such a motion. S may be singular, as where only contact holds the body.
"""

import numpy as np
from numba import njit

from model.node_loop.contact_sweep import FREE, SLIP, STICK

CHANGES = 1  # for each unknown, or two ways, and a few: a longer path had better start from nearer,
WHOLE = 4  # but not one from nodes pressed to the road, which 12,000 random problems ended within 3.3
APART = 1e-3  # of the forces at work: so far from every change a path begins, lest two come at once


@njit(cache=True, error_model="numpy")
def follow_path(S, b, gap, reference, mu, ways, u, force, status, pressed):
    """Solve S u = b + forces of the road for k nodes, component 0 along their normals.

    Parameters
    ----------
    S : (k d, k d)
        Positive semidefinite.
    b : (k, d)
    gap, reference : (k,), (k, d - 1)
        At zero displacement, and where a node sticks.
    mu : (k,)
    ways : (k, m, d - 1)
        Unit vectors t_a of each node along the surface, in order of their angles; none where d = 1.
    u, force, status : (k, d), (k, d), (k,)
        Where to start; updated.
    pressed : (k,) of bool
        Nodes that start pressed to the road instead.

    Returns
    -------
    found : bool
    count : int
        Changes.
    """
    k, d = u.shape
    n, m, own = k * d, ways.shape[1], np.empty(k)
    for c in range(k):
        own[c] = max(np.abs(S[c * d : (c + 1) * d, c * d : (c + 1) * d]).max(), 1e-12 * np.abs(S).max())
    x, piece = start_of_path(S, b, gap, reference, mu, ways, u, force, status, own, pressed)
    R = (S @ u.copy().reshape(n)).reshape(k, d) - b - force
    A, right = np.zeros((n + 1, n + 1)), np.zeros(n + 1)
    right[n], A[n, n] = 1.0, 1.0
    for c in range(k):
        A[c * d : (c + 1) * d, n] = R[c]
        enter(A, S, c, basis(piece[c], mu[c], ways[c]), own[c])
    t = 0.0
    for count in range(1, (WHOLE if pressed.any() else CHANGES) * k * max(d, m // 2) + 20):
        try:
            rates = np.linalg.solve(A, right)
        except Exception:  # exactly singular
            return False, count
        least, node, row = np.inf, -1, -1
        for c in range(k):
            at = basis(piece[c], mu[c], ways[c]) @ rates[c * d : (c + 1) * d]
            bounds, _ = bounds_of(piece[c], mu[c], ways[c], x[c])
            for a in range(len(bounds)):
                speed = bounds[a] @ at
                if speed < 0.0 and max(bounds[a] @ x[c], 0.0) < least * -speed:
                    least, node, row = max(bounds[a] @ x[c], 0.0) / -speed, c, a
        arrives = rates[n] > 0.0 and (1.0 - t) <= least * rates[n]
        if not arrives and node < 0:
            return False, count
        step = (1.0 - t) / rates[n] if arrives else least
        t += step * rates[n]
        for c in range(k):
            x[c] += step * (basis(piece[c], mu[c], ways[c]) @ rates[c * d : (c + 1) * d])
        if arrives:
            break
        before = piece[node].copy()
        piece[node] = bounds_of(before, mu[node], ways[node], x[node])[1][row]
        bounds, others = bounds_of(piece[node], mu[node], ways[node], x[node])
        new = basis(piece[node], mu[node], ways[node])
        enter(A, S, node, new, own[node])
        A[n] = 0.0
        for a in range(len(bounds)):
            if np.all(others[a] == before) or (before[0] == FREE and others[a, 0] == FREE):
                A[n, node * d : (node + 1) * d] = bounds[a] @ new
    else:
        return False, count
    for c in range(k):
        status[c], force[c] = piece[c, 0], x[c, d:]
        u[c, 0] = x[c, 0] / own[c] - gap[c]
        u[c, 1:] = x[c, 1:d] / own[c] + reference[c]
    return True, count


@njit(cache=True, error_model="numpy")
def enter(A, S, c, basis, own):
    """Write the columns of node c: what its unknowns do to S u - forces of the road."""
    d = basis.shape[1]
    A[:-1, c * d : (c + 1) * d] = (S[:, c * d : (c + 1) * d].copy() / own) @ basis[:d]
    A[c * d : (c + 1) * d, c * d : (c + 1) * d] -= basis[d:]


@njit(cache=True, error_model="numpy")
def basis(piece, mu, ways):
    """What a node's d unknowns are, (2 d, d): way from where it sticks, times its stiffness, and force.

    A piece (3,) is a status, and of slip the first and the last of the one or two ways.
    """
    d = ways.shape[1] + 1
    B = np.zeros((2 * d, d))
    if piece[0] == FREE:
        B[:d] = np.eye(d)
    elif piece[0] == STICK:
        B[d:] = np.eye(d)
    else:
        B[d, 0] = 1.0
        if len(ways) == 0:
            B[1:d, 1:] = np.eye(d - 1)
        else:
            one, other = ways[piece[1]], ways[piece[2]]
            B[d + 1 :, 0] = -mu * (one + other) / (1.0 + one @ other)
            B[1:d, 1] = one
            if piece[1] != piece[2]:
                B[1:d, 2] = other
            elif d == 3:
                B[d + 1, 2], B[d + 2, 2] = -one[1], one[0]
    return B


@njit(cache=True, error_model="numpy")
def bounds_of(piece, mu, ways, x):
    """What must stay positive of a node's way and force x (2 d,), (r, 2 d), and the pieces (r, 3) beyond."""
    m, d = ways.shape[0], ways.shape[1] + 1
    cone = np.zeros((m, 2 * d))
    cone[:, d], cone[:, d + 1 :] = mu, ways
    if piece[0] == STICK:
        beyond = np.empty((m, 3), dtype=np.int64)
        for a in range(m):
            beyond[a] = np.array([SLIP, a, a])
        return cone, beyond
    rows, beyond = np.zeros((d, 2 * d)), np.zeros((d, 3), dtype=np.int64)
    if piece[0] == FREE:
        rows[0, 0] = 1.0
        beyond[0] = sector(ways, x[1:d])
        return rows[:1], beyond[:1]
    rows[0, d] = 1.0  # beyond: FREE
    first, last = piece[1], piece[2]
    if m == 0:
        return rows[:1], beyond[:1]
    if first != last:
        one, other = ways[first], ways[last]
        rows[1, 1:d], beyond[1] = one - (one @ other) * other, np.array([SLIP, last, last])
        rows[2, 1:d], beyond[2] = other - (one @ other) * one, np.array([SLIP, first, first])
    else:
        rows[1, 1:d], beyond[1] = ways[first], np.array([STICK, 0, 0])
        if d == 3:  # a side of the polygon ends at two corners, before its pressure does
            rows[0], beyond[0] = cone[(first + 1) % m], np.array([SLIP, first, (first + 1) % m])
            rows[2], beyond[2] = cone[(first - 1) % m], np.array([SLIP, (first - 1) % m, first])
    return rows, beyond


@njit(cache=True, error_model="numpy")
def sector(ways, slip):
    """The piece of slip to which a way along the surface belongs."""
    m = ways.shape[0]
    if m == 0:
        return np.array([SLIP, 0, 0])
    along = np.empty(m)
    for a in range(m):
        along[a] = ways[a] @ slip
    best = int(np.argmax(along))
    if slip.size == 1:
        return np.array([SLIP, best, best])
    after, before = (best + 1) % m, (best - 1) % m
    if along[after] > along[before]:
        return np.array([SLIP, best, after])
    return np.array([SLIP, before, best])


@njit(cache=True, error_model="numpy")
def start_of_path(S, b, gap, reference, mu, ways, u, force, status, own, pressed):
    """Ways and forces (k, 2 d) to start from, each node well within a piece (k, 3); u and force follow."""
    (k, d), m = u.shape, ways.shape[1]
    x, piece = np.zeros((k, 2 * d)), np.zeros((k, 3), dtype=np.int64)
    for c in np.flatnonzero(pressed):
        status[c], u[c, 0], u[c, 1:] = STICK if m else SLIP, -gap[c], reference[c]
    asked = (S @ u.copy().reshape(k * d)).reshape(k, d) - b
    force[:] = np.where(pressed.reshape(k, 1), asked, force)
    size = max(np.abs(force).max(), APART * np.abs(b).max())
    size = size if size > 0.0 else own.max()
    for c in range(k):
        near = APART * size * (1.0 + (0.6180339887498949 * c) % 1.0)
        tangential = np.sqrt(np.sum(force[c, 1:] ** 2))
        p, way = max(force[c, 0], 0.0) + near, own[c] * (u[c, 1:] - reference[c])
        if pressed[c]:
            p += near / APART + tangential / max(mu[c], APART)
        piece[c, 0] = status[c]
        if status[c] == FREE:
            x[c, 0], x[c, 1:d] = own[c] * max(u[c, 0] + gap[c], 0.0) + near, way + near
        elif status[c] == STICK:
            x[c, d] = p
            x[c, d + 1 :] = force[c, 1:] * min(1.0, 0.9 * mu[c] * p / max(tangential, 1e-300))
        else:
            x[c, 1:d] = way - near * force[c, 1:] / max(tangential, 1e-300)
            piece[c] = sector(ways[c], x[c, 1:d])
            x[c, d:] = p * basis(piece[c], mu[c], ways[c])[d:, 0]
        u[c, 0] = x[c, 0] / own[c] - gap[c]
        u[c, 1:] = x[c, 1:d] / own[c] + reference[c]
        force[c] = x[c, d:]
    return x, piece
