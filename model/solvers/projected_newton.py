"""The small dense contact problem without friction: Newton's direction along projected paths.

Only the normal displacements v (k,) of the candidates are left:

    J(v) = 1/2 v.S v - c.v  is least over  gap + v >= 0,

S being the stiffness that they feel with all else in equilibrium. Each step releases the nodes that the road
would have to pull, takes the direction that solves for the nodes off the road, and searches J along the
projected path: projected Newton, Bertsekas, SIAM J. Control Optim. 20 (1982). J falls in every step; a step
that goes all the way, to where no node wants release, is the solution, and nodes have finitely many sets.

A rigid mode that the contact leaves free has no stiffness. Where the load drives it, the body follows it
until the next node comes to the road; where it does not, it stays where it is.
"""

import numpy as np
from numba import njit

from model.node_loop.contact_sweep import FREE, SLIP
from model.solvers.iterative_refinement import ROUNDING
from model.solvers.projected_search import projected_search

STEPS = 200  # everyday scenes take a few, and 20 at most


@njit(cache=True, error_model="numpy")
def null_space(G, largest):
    """Orthonormal amplitudes (m, z) of modes that vanish at the given components G (l, m)."""
    m = G.shape[1]
    padded = np.zeros((max(G.shape[0], m), m))
    padded[: G.shape[0]] = G
    _, sizes, directions = np.linalg.svd(padded)
    rank = 0
    while rank < m and sizes[rank] > 1e-10 * largest:
        rank += 1
    return directions[rank:].T.copy()


@njit(cache=True, error_model="numpy")
def free_modes(G, held):
    """Orthonormal columns of what modes G (l, m) do where they are not `held` (l,), those at rest."""
    nothing = np.zeros((np.count_nonzero(~held), 0))
    if G.shape[1] == 0:
        return nothing
    Z = null_space(G[held], np.abs(G).max())
    if Z.shape[1] == 0:
        return nothing
    N, sizes, _ = np.linalg.svd(G[~held] @ Z, full_matrices=False)
    return N[:, sizes > 1e-10 * np.abs(G).max()].copy()


@njit(cache=True, error_model="numpy")
def project_newton(arrays, contact, c, u, status, force, slight):
    """Fill v = u (k, 1), status (k,) and the forces (k, 1) of the road with the solution.

    Parameters
    ----------
    arrays : Condensed
        S (k, k) with its rigid modes G (k, m), S G = 0.
    contact : Candidates
        Gap (k,) of any sign.
    c : (k,)
        Load.
    u, status
        First guess: v counts where it is admissible, nodes in contact are placed on the road.
    slight : float
        Force that is taken for rounding where it drives a mode.
    """
    S, G, v, k = arrays.S, arrays.G, u[:, 0], u.shape[0]
    for j in range(k):
        if status[j] != FREE or contact.gap[j] + v[j] < 0.0:
            status[j], v[j] = SLIP, -contact.gap[j]
    r, whole = np.empty((k, 1)), False
    direction, product = np.empty((k, 1)), np.empty((k, 1))
    for _ in range(STEPS):
        released = 0
        for j in range(k):
            s, rounding = c[j], abs(c[j])
            for i in range(k):
                s -= S[j, i] * v[i]
                rounding += abs(S[j, i] * v[i])
            r[j, 0] = s
            if status[j] != FREE and s > 4 * ROUNDING * rounding:
                status[j] = FREE
                released += 1
        free = status == np.int8(0)  # FREE
        numbers = np.flatnonzero(free)
        if numbers.size == 0 or (whole and released == 0):
            break
        arrays.steps[0] += 1
        N = free_modes(G, ~free)
        drive = N.T @ r[numbers, 0]
        direction[:], product[:] = 0.0, 0.0
        driven = np.sqrt(np.sum(drive**2)) > slight
        if driven:
            direction[numbers, 0] = N @ drive
        else:
            inside = np.empty((numbers.size, numbers.size))
            largest = 1e-300
            for row in range(numbers.size):
                largest = max(largest, S[numbers[row], numbers[row]])
                for column in range(numbers.size):
                    inside[row, column] = S[numbers[row], numbers[column]]
            missing = r[numbers, 0] - N @ drive
            direction[numbers, 0] = np.linalg.solve(inside + largest * (N @ N.T), missing)
            for j in range(k):
                for i in numbers:
                    product[j, 0] += S[j, i] * direction[i, 0]
        t = projected_search(arrays.blocks, r, direction, product, contact, u, status)
        if t == np.inf:
            break
        whole = not driven and np.count_nonzero(status) == k - numbers.size
    for j in range(k):
        force[j, 0] = 0.0 if status[j] == FREE else max(-r[j, 0], 0.0)
