"""Exact search for less energy along a projected path.

Without friction, or with the friction forces held, a contact problem is a convex quadratic programme: J(u) =
1/2 u.A u - b.u is least over g0 + n.u >= 0. From an admissible u the path

    u(t) = P(u + t x),    P the projection onto the admissible set, node by node along its normal,      (1)

leads straight on until a node comes to the road, which from there on moves along the surface alone. J on it
is continuous and piecewise quadratic, with a kink where a node arrives. The kinks are passed in order, up to
the first point from which J rises. J falls, or the step is zero: the descent of truncated nonsmooth Newton
methods, Graeser and Sander, IMA J. Numer. Anal. 39 (2019); of projected paths, Bertsekas, SIAM J. Control
Optim. 20 (1982), and More and Toraldo, SIAM J. Optim. 1 (1991).
"""

import numpy as np
from numba import njit

from model.node_loop.contact_sweep import FREE, SLIP, gap_of, place_on_surface


@njit(cache=True, error_model="numpy")
def projected_search(A, r, direction, product, contact, u, status):
    """Move u (N, d) along the path (1), in place, to the first minimum of J; return t, or inf if J has none.

    Parameters
    ----------
    A : BlockMatrix
        Symmetric, N block rows.
    r : (N, d)
        What u misses of equilibrium, load - A u + friction forces that are held; updated.
    direction : (N, d)
        x of (1), a direction of descent; zero in the components that are held: those of sticking and
        prescribed nodes, and along the normals of slipping ones. Overwritten.
    product : (N, d)
        A x; overwritten.
    contact : Candidates
    u, status : (N, d), (n,)
        Updated; nodes that arrive are placed on the road and slip.

    Returns
    -------
    float
        t; if inf, u has been moved to the last kink, beyond which J falls for ever.
    """
    N, d = u.shape
    slope, curvature, t = 0.0, 0.0, 0.0
    for i in range(N):
        for a in range(d):
            slope -= r[i, a] * direction[i, a]
            curvature += direction[i, a] * product[i, a]
    far = 1.0  # a full step of Newton's
    arrival, speed, since = np.full(status.size, np.inf), np.zeros(status.size), np.zeros(N)
    for c in range(status.size):
        for a in range(d):
            speed[c] += contact.frame[c, 0, a] * direction[contact.nodes[c], a]
        if status[c] == FREE and speed[c] < 0.0:
            arrival[c] = max(gap_of(contact, c, u), 0.0) / -speed[c]
            far = max(far, arrival[c])
    far *= 1e10  # beyond, what is left of the curvature is rounding
    flat = 1e-12 * abs(slope)  # beyond that the sums above are rounding
    for c in np.argsort(arrival):
        best = t - slope / curvature if curvature > 0.0 else np.inf
        if slope >= -flat or best <= arrival[c]:
            break
        slope += (arrival[c] - t) * curvature
        t = arrival[c]
        i, v = contact.nodes[c], speed[c]
        for k in range(A.indptr[i], A.indptr[i + 1]):
            j = A.indices[k]
            for b in range(d):
                r[j, b] -= (t - since[j]) * product[j, b]
                if j == i:  # what the node no longer does, e = -v n, changes slope and curvature
                    slope += r[i, b] * v * contact.frame[c, 0, b]
                    curvature -= 2.0 * v * contact.frame[c, 0, b] * product[i, b]
            since[j] = t
            for b in range(d):
                change = 0.0
                for a in range(d):
                    change -= A.data[k, a, b] * v * contact.frame[c, 0, a]
                product[j, b] += change
                if j == i:
                    curvature -= change * v * contact.frame[c, 0, b]
        for a in range(d):
            direction[i, a] -= v * contact.frame[c, 0, a]
            u[i, a] += t * v * contact.frame[c, 0, a]
        status[c] = SLIP
    if slope < -flat:  # no more arrive on the way
        best = t - slope / curvature if curvature > 0.0 else np.inf
        t, slope = (best, 0.0) if best < far else (t, slope)
    for i in range(N):
        for a in range(d):
            r[i, a] -= (t - since[i]) * product[i, a]
            u[i, a] += t * direction[i, a]
    for c in range(status.size):
        if status[c] != FREE:
            place_on_surface(contact, c, u)
    return t if slope >= -flat else np.inf
