"""Lemke's pivoting: a finite way to solve small contact problems with friction in the plane.

Where Newton steps and the loop run in circles, the problem is written as a linear complementarity problem,

    w = M z + q,   w >= 0,   z >= 0,   w . z = 0,
    w = (gap, slip forwards, mu p - tau),   z = (p, mu p + tau, slip backwards),                           (1)

and solved by C. E. Lemke's complementary pivoting, which ends after finitely many pivots; A. Klarbring, Int.
J. Solids Struct. 22 (1986), and A. Klarbring & J.-S. Pang, SIAM J. Optim. 8 (1998), on (1). It costs k^3 and
more, and finds contact, stick and slip to the digits that pivoting leaves; Newton steps do the rest.
"""

import numpy as np
from numba import njit

TINY = 1e-11  # pivots of size 1 and below are taken for rounding


@njit(cache=True, error_model="numpy")
def lemke(M, q):
    """Return z (n,) >= 0 with M z + q >= 0 complementary to it, whether it was found, and the pivots."""
    n = q.size
    T = np.zeros((n, 2 * n + 2))  # columns w, z, the covering unknown, and the right side
    for i in range(n):
        T[i, i], T[i, 2 * n], T[i, 2 * n + 1] = 1.0, -1.0, q[i]
        for j in range(n):
            T[i, n + j] = -M[i, j]
    basis, z = np.arange(n), np.zeros(n)
    if q.min() >= 0.0:
        return z, True, 0
    row, entering = int(np.argmin(q)), 2 * n
    for count in range(1, 50 * n):
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
    return z, False, 50 * n


@njit(cache=True, error_model="numpy")
def first_to_vanish(T, entering, basis):
    """Row of the basic unknown that vanishes first as another grows, the covering one preferred; or -1."""
    n = basis.size
    least = np.inf
    for i in range(n):
        if T[i, entering] > TINY:
            least = min(least, max(T[i, 2 * n + 1], 0.0) / T[i, entering])
    found, largest = -1, 0.0
    for i in range(n):
        if (
            T[i, entering] > TINY
            and max(T[i, 2 * n + 1], 0.0) <= least * T[i, entering] * (1 + 1e-12) + 1e-300
        ):
            size = np.inf if basis[i] == 2 * n else T[i, entering]
            if size > largest:
                found, largest = i, size
    return found


@njit(cache=True, error_model="numpy")
def pivot(T, row, column):
    """Eliminate a column from all rows but one."""
    T[row] /= T[row, column]
    for i in range(T.shape[0]):
        if i != row and T[i, column] != 0.0:
            T[i] -= T[i, column] * T[row]


@njit(cache=True, error_model="numpy")
def contact_by_pivoting(S, b, gap, reference, mu):
    """Solve S u = b + contact forces for k nodes in the plane, component 0 along their normals.

    Parameters
    ----------
    S : (2 k, 2 k)
    b : (k, 2)
    gap, reference : (k,), (k, 1)
        At zero displacement, and where a node sticks.
    mu : (k,)

    Returns
    -------
    u : (k, 2)
    status : (k,)
        0 free, 1 slip, 2 stick.
    found : bool
    count : int
        Pivots.
    """
    k = gap.size
    softened = S.copy()
    largest = 0.0
    for i in range(2 * k):
        largest = max(largest, S[i, i])
    for i in range(2 * k):
        softened[i, i] += 1e-9 * largest  # what nothing holds falls far, but not for ever
    W = np.linalg.inv(softened)
    free = W @ b.copy().reshape(2 * k)
    size = 0.0
    for i in range(2 * k):
        size += W[i, i] / (2 * k)
    M, q = np.zeros((3 * k, 3 * k)), np.zeros(3 * k)
    for i in range(k):
        q[i] = gap[i] + free[2 * i]
        q[k + i] = free[2 * i + 1] - reference[i, 0]
        for j in range(k):
            for a in range(2):  # normal and tangential rows; forces in units of 1 / size
                M[a * k + i, j] = (W[2 * i + a, 2 * j] - mu[j] * W[2 * i + a, 2 * j + 1]) / size
                M[a * k + i, k + j] = W[2 * i + a, 2 * j + 1] / size
        M[k + i, 2 * k + i] = 1.0
        M[2 * k + i, i], M[2 * k + i, k + i] = 2.0 * mu[i], -1.0
    z, found, count = lemke(M, q)
    w = M @ z + q
    force, status = np.zeros(2 * k), np.zeros(k, dtype=np.int8)
    for i in range(k):
        force[2 * i], force[2 * i + 1] = z[i] / size, (z[k + i] - mu[i] * z[i]) / size
        if z[i] > 0.0:
            status[i] = 1 if z[2 * k + i] > 0.0 or z[k + i] <= 0.0 or w[2 * k + i] <= 1e-12 * z[i] else 2
    return (free + W @ force).reshape(k, 2), status, found, count
