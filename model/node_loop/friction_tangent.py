"""How the friction force of slipping nodes changes with their pressure and their slip.

With f = -beta(p, |s|) t, t = s / |s|, beta the bound of the friction law,

    df = -(d beta / d p) t dp - [(d beta / d |s|) t t^T + beta / |s| (I - t t^T)] ds.

The last bracket, how the force grows and *turns* with the slip, is symmetric, and positive unless the law
weakens with the slip: an elastic support of the node along the road. (Alart and Curnier, Comput. Methods
Appl. Mech. Eng. 92 (1991); Wriggers, Computational Contact Mechanics, 2nd ed., section 10.5.)
"""

import numpy as np
from numba import njit

from model.node_loop.contact_sweep import slip_of
from model.node_loop.friction_laws import allowed
from model.node_loop.status import Status

STEP = 1e-6  # relative: differences are good to it, and to rounding over it, 2e-10
STIFF = 1e6  # times the node's own stiffness: slip so small turns no more than a node that sticks


@njit(cache=True, error_model="numpy")
def friction_tangent(contact, u, R, force, status, bound, slip_rate, by_pressure, support):
    """Turn the friction of slipping candidates against their slip, and find its derivatives.

    All is in global components; the derivatives of other candidates are zero.

    Parameters
    ----------
    contact : Candidates
    u : (N, d)
    R, force : (N, d), (n, d)
        What is missing from equilibrium with these forces of the road, normal and friction, both updated:
        Newton's steps converge quadratically where the friction is that which the derivatives belong to.
    status : (n,)
    bound, slip_rate
        The friction law's address, and what it multiplies slip by.
    by_pressure : (n, d), filled
        Change of the friction force per unit of pressure force.
    support : (n, d, d), filled
        The bracket above; what would be negative in it is left out.
    """
    n, d = force.shape
    t = np.empty(d)
    for c in range(n):
        by_pressure[c] = 0.0
        support[c] = 0.0
        if status[c] != Status.SLIP:
            continue
        i, p, (x, y) = contact.nodes[c], 0.0, slip_of(contact, c, u)
        length, stiffness = (
            np.sqrt(x * x + y * y),
            max(contact.block[c, 1, 1], contact.block[c, d - 1, d - 1]),
        )
        for a in range(d):
            p += contact.frame[c, 0, a] * force[c, a]
            t[a] = contact.frame[c, 1, a] * x + contact.frame[c, d - 1, a] * y
        if length == 0.0:
            continue
        m, state = slip_rate * length, contact.state[c]
        at, growth, along = np.sqrt(np.sum(force[c] ** 2)), 0.0, 0.0  # of a node that grazes
        if p > 0.0:
            at = allowed(bound, p, m, state)
            growth = (allowed(bound, (1.0 + STEP) * p, m, state) - at) / (STEP * p)
            along = max((allowed(bound, p, (1.0 + STEP) * m, state) - at) / (STEP * length), 0.0)
        across = min(at / length, STIFF * stiffness)
        for a in range(d):
            t[a] /= length
            by_pressure[c, a] = -growth * t[a]
            change = p * contact.frame[c, 0, a] - at * t[a] - force[c, a]
            force[c, a] += change
            R[i, a] += change
        for a in range(d):
            for b in range(d):
                identity = (1.0 if a == b else 0.0) - contact.frame[c, 0, a] * contact.frame[c, 0, b]
                support[c, a, b] = along * t[a] * t[b] + across * (identity - t[a] * t[b])
