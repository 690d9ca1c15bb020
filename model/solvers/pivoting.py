"""Lemke's pivoting: a finite way to solve small contact problems with friction.

Let friction be bounded along directions t_a alone, mu p + t_a . tau >= 0: both ways in the plane, where that
is Coulomb's law, and a polygon around the disc in space. With gaps v, slip sum s_a t_a and the stiffness S
that the nodes feel, S u = b + forces of the road (p, tau) is a linear complementarity problem,

    w = M z + q,   w >= 0,   z >= 0,   w . z = 0,     z = (v, s_a),   w = (p, mu p + t_a . tau),          (1)

solved by C. E. Lemke's complementary pivoting; with friction A. Klarbring, Int. J. Solids Struct. 22 (1986).
It begins with all nodes pressed to the road by a force so large that they stick, which it takes away.
There is no end without an answer, for any mu, unless the load does work in a rigid motion that leads no node
into the road: if w', z' is the ray on which it would end, w' + the pressing >= 0 makes each term of

    z' . w' = u' . S u' + (pressing) . (v', s') + sum mu s'_a p' = 0

vanish, so u' is such a motion. S may be singular, as where only contact holds the body. A pivot costs the
square of the size of z.
"""

import numpy as np
from numba import njit

TINY = 1e-11  # pivots of size 1 and below are taken for rounding
NOTHING = 1e-13  # of the pressing at first: where it goes with the friction bounds, 1e-16 to 1e-14 are left
PIVOTS = 5  # for each unknown; everyday scenes take two for each at most


@njit(cache=True, error_model="numpy")
def lemke(M, q, cover):
    """Solve (1) from w = q + cover z0, z0 falling to 0.

    Parameters
    ----------
    M, q : (n, n), (n,)
    cover : (n,) > 0

    Returns
    -------
    z : (n,)
    found : bool
    count : int
        Pivots.
    """
    n = q.size
    T = np.zeros((n, 2 * n + 2))  # columns w, z, the covering unknown, and the right side
    for i in range(n):
        T[i, i], T[i, 2 * n], T[i, 2 * n + 1] = 1.0, -cover[i], q[i]
        for j in range(n):
            T[i, n + j] = -M[i, j]
    basis, z = np.arange(n), np.zeros(n)
    if q.min() >= 0.0:
        return z, True, 0
    row, entering = int(np.argmin(q / cover)), 2 * n
    for count in range(1, PIVOTS * n):
        leaving = basis[row]
        pivot(T, row, entering)
        basis[row] = entering
        if leaving == 2 * n:
            for i in range(n):
                if n <= basis[i] < 2 * n:
                    z[basis[i] - n] = max(T[i, 2 * n + 1], 0.0)
            return z, True, count
        entering = leaving + n if leaving < n else leaving - n
        row = first_to_vanish(T, entering, basis)
        if row < 0:
            return z, False, count
    return z, False, PIVOTS * n


@njit(cache=True, error_model="numpy")
def first_to_vanish(T, entering, basis):
    """Row of the basic unknown that vanishes first as another grows, the covering one preferred; or -1.

    With the covering unknown go the friction bounds of all nodes off the road: what is left of it then is
    rounding.
    """
    n = basis.size
    least = np.inf
    for i in range(n):
        if T[i, entering] > TINY:
            least = min(least, max(T[i, 2 * n + 1], 0.0) / T[i, entering])
    found, largest = -1, 0.0
    for i in range(n):
        if T[i, entering] > TINY:
            left = max(T[i, 2 * n + 1], 0.0) - least * T[i, entering]
            if basis[i] == 2 * n and left <= NOTHING:
                return i
            if left <= 1e-12 * least * T[i, entering] + 1e-300 and T[i, entering] > largest:
                found, largest = i, T[i, entering]
    return found


@njit(cache=True, error_model="numpy")
def pivot(T, row, column):
    """Eliminate a column from all rows but one."""
    T[row] /= T[row, column]
    for i in range(T.shape[0]):
        if i != row and T[i, column] != 0.0:
            T[i] -= T[i, column] * T[row]


@njit(cache=True, error_model="numpy")
def contact_by_pivoting(S, b, gap, reference, mu, directions):
    """Solve S u = b + contact forces for k nodes, component 0 along their normals.

    Parameters
    ----------
    S : (k d, k d)
        Positive semidefinite.
    b : (k, d)
    gap, reference : (k,), (k, d - 1)
        At zero displacement, and where a node sticks.
    mu : (k,)
    directions : (k, m, d - 1)
        Unit vectors t of each node along the surface.

    Returns
    -------
    u : (k, d)
    status : (k,)
        0 free, 1 slip, 2 stick.
    found : bool
    count : int
        Pivots.
    """
    k, m, d = gap.size, directions.shape[1], b.shape[1]
    l = 1 + m
    u, status = np.empty((k, d)), np.empty(k, dtype=np.int8)
    moves, asks = np.zeros((k, d, l)), np.zeros((k, l, d))  # what z does, and w asks of forces, at each node
    cover = np.ones(k * l)
    for i in range(k):
        u[i, 0], moves[i, 0, 0], asks[i, 0, 0] = -gap[i], 1.0, 1.0
        for e in range(1, d):
            u[i, e] = reference[i, e - 1]
            for a in range(m):
                moves[i, e, 1 + a] = asks[i, 1 + a, e] = directions[i, a, e - 1]
        asks[i, 1:, 0] = mu[i]
        cover[i * l + 1 : (i + 1) * l] = 1.0 + mu[i]
    pressed = (S @ u.copy().reshape(k * d)).reshape(k, d) - b  # forces, all nodes sticking on the road
    unit, stiffness = np.abs(pressed).max(), np.abs(S).max()
    if unit == 0.0 or stiffness == 0.0:
        unit, stiffness = max(unit, 1.0), max(stiffness, 1.0)
    M, q = np.empty((k * l, k * l)), np.empty(k * l)
    for i in range(k):
        q[i * l : (i + 1) * l] = asks[i] @ pressed[i] / unit
        for j in range(k):
            block = S[i * d : (i + 1) * d, j * d : (j + 1) * d].copy() / stiffness
            M[i * l : (i + 1) * l, j * l : (j + 1) * l] = asks[i] @ block @ moves[j]
    z, found, count = lemke(M, q, cover)
    for i in range(k):
        way = moves[i] @ z[i * l : (i + 1) * l]
        u[i] += way * (unit / stiffness)
        status[i] = 0 if way[0] > 0.0 else 1 if np.any(way[1:] != 0.0) else 2
    return u, status, found, count
