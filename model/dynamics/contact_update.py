"""Compiled bookkeeping of what touches in a step: gaps, contacts, work."""

import numpy as np
from numba import njit

from model.node_loop.contact_sweep import slip_along
from model.node_loop.friction_laws import allowed
from model.node_loop.status import Status


@njit(cache=True)
def advance(gap, normal, moved):
    """Add to the gaps (n,) what a move (n, d) along the normals (n, d) does to them."""
    for c in range(gap.size):
        for a in range(normal.shape[1]):
            gap[c] += normal[c, a] * moved[c, a]


@njit(cache=True)
def forget_rounding(gap, status, rounding):
    """Put nodes that touch, and nodes that rounding has put below the road, at gap 0."""
    for c in range(gap.size):
        if (status[c] != Status.FREE or gap[c] < 0.0) and abs(gap[c]) < rounding:
            gap[c] = 0.0


@njit(cache=True)
def confirm_contact(contact, e, force, law, status, gap):
    """Write the gaps (n,) after the increment e (N, d), exactly 0 in contact, never negative; count contacts.

    Nodes that come to lie on the road by themselves, and press on it, are made to touch, and nodes that may
    slip but have not, to stick; `law` is the address of the friction law or None.
    """
    count = 0
    d = e.shape[1]
    for c in range(status.size):
        i = contact.nodes[c]
        s, pressure, squares, slipped = contact.gap[c], 0.0, 0.0, False
        for a in range(d):
            s += contact.frame[c, 0, a] * e[i, a]
            pressure += contact.frame[c, 0, a] * force[c, a]
            squares += force[c, a] ** 2
        gap[c] = max(s, 0.0)
        if status[c] == Status.FREE and pressure > 0.0:
            status[c] = Status.SLIP
        if status[c] == Status.FREE:
            continue
        gap[c] = 0.0
        count += 1
        if law is None or status[c] == Status.STICK:
            continue
        for b in range(1, d):
            slipped |= slip_along(contact, c, e, b) != 0.0
        tangential = np.sqrt(max(squares - pressure**2, 0.0))
        if not slipped and tangential < allowed(law, pressure, 0.0, contact.state[c]):
            status[c] = Status.STICK
    return count


@njit(cache=True)
def contact_work(nodes, normals, force, change, opening, impulse):
    """Work of forces (n, d) along normals (n, d), as gaps open by (n,), and along the surface; their sum."""
    d = force.shape[1]
    normal, friction = 0.0, 0.0
    for c in range(opening.size):
        pressure = 0.0
        for a in range(d):
            pressure += normals[c, a] * force[c, a]
            impulse[a] += force[c, a]
        normal += pressure * opening[c]
        for a in range(d):
            friction += (force[c, a] - pressure * normals[c, a]) * change[nodes[c], a]
    return normal, friction
