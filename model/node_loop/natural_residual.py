"""The natural residual.

One number that says how far a displacement is from the solution of the contact problem.

For given displacements the road's force on each candidate is taken as the admissible one nearest to what
equilibrium asks for (p >= 0, p = 0 away from the road, |tau| <= bound): the projections of the natural map,

    p   = max(0, -r_n - D_nn g),        tau = projection of (-r_t - D_tt s) onto the friction disc,

with r = load - A u the defect of the node without the road, g its gap and s its slip. What is then missing
from equilibrium, R = r + f, vanishes exactly where all of equilibrium, g >= 0, p >= 0, p g = 0 and the
friction law hold. Its norm over that of the forces at work is dimensionless.

Friction may jump as the pressure vanishes, as that of a viscous film does. A node that its own friction draws
off the road then finds no rest: pressed, friction lifts it; lifted, nothing does. There the law is its closed
graph, as in A. F. Filippov, Differential Equations with Discontinuous Righthand Sides (1988): a node that
slips on the road may bear p = 0 with any friction up to the jump. It grazes, where that is the nearer.
"""

from functools import lru_cache
from typing import Any

import numpy as np
from numba import njit

from model.node_loop.blocks import FUSED, BlockMatrix, flat, row_defect_2, row_defect_3, row_defect_any
from model.node_loop.contact_sweep import slip_along
from model.node_loop.friction_laws import allowed
from model.node_loop.prefetch import AHEAD
from model.node_loop.status import Status

BARELY = 1e-300  # a pressure that tells a law of friction that the node is pressed, but not how much


@lru_cache
def natural_residual(dim: int, friction: bool) -> Any:
    """Compile compute(A, load, u, contact, status, bound, slip_rate, R, force) for blocks of `dim`.

    It fills R (N, d) and the admissible contact force (n, d), global components, and returns nothing.
    """

    @njit(cache=True, error_model="numpy", fastmath=FUSED)
    def compute(A, load, u, contact, status, bound, slip_rate, R, force):
        row, M = np.empty(dim), BlockMatrix(A.indptr, A.indices, flat(A.data))
        b, x, left = flat(load), flat(u), flat(R)
        for i in range(R.shape[0]):
            if dim == 2:
                r = row_defect_2(M, A.indptr[i], A.indptr[i + 1], b, x, i, AHEAD)
            elif dim == 3:
                r = row_defect_3(M, A.indptr[i], A.indptr[i + 1], b, x, i, AHEAD)
            else:
                r = row_defect_any(M, A.indptr[i], A.indptr[i + 1], b, x, i, row)
            for a in range(dim):
                left[dim * i + a] = r[a]
        local = np.empty(dim)
        for c in range(contact.nodes.size):
            i = contact.nodes[c]
            frame = contact.frame[c]
            gap = contact.gap[c]
            for a in range(dim):
                gap += frame[0, a] * u[i, a]
                local[a] = 0.0
                for b in range(dim):
                    local[a] -= frame[a, b] * R[i, b]
            if status[c] != Status.FREE:
                gap = 0.0  # held by construction; what is left is the rounding of the sum above
            p = max(local[0] - contact.block[c, 0, 0] * gap, 0.0)
            if friction:
                admissible_force(contact, c, u, p, status[c], bound, slip_rate, local)
            else:
                local[0] = p
            for a in range(dim):
                force[c, a] = frame[0, a] * local[0]
                if friction:
                    for b in range(1, dim):
                        force[c, a] += frame[b, a] * local[b]
                R[i, a] += force[c, a]

    return compute


@njit(cache=True, error_model="numpy")
def admissible_force(contact, c, u, p, status, bound, slip_rate, local):
    """Replace the reaction in `local` by the nearest admissible one, of pressure p unless the node grazes."""
    d = local.size
    stiffness, size, slip = 0.0, 0.0, 0.0
    for a in range(1, d):
        stiffness = max(stiffness, contact.block[c, a, a])
    for a in range(1, d):
        s = 0.0 if status == Status.STICK else slip_along(contact, c, u, a)  # what would be left is rounding
        slip += s * s
        size += (local[a] - stiffness * s) ** 2
    size, slip = np.sqrt(size), np.sqrt(slip)
    largest = allowed(bound, p, slip_rate * slip, contact.state[c])
    part = largest / size if size > largest else 1.0
    if status == Status.SLIP and slip > 0.0:
        missing = (local[0] - p) ** 2
        for a in range(1, d):
            missing += ((1.0 - part) * local[a] + part * stiffness * slip_along(contact, c, u, a)) ** 2
        if local[0] ** 2 < missing and grazes(contact, c, u, slip, missing, bound, slip_rate, local):
            return
    local[0] = p
    for a in range(1, d):
        s = 0.0 if status == Status.STICK else slip_along(contact, c, u, a)
        local[a] = part * (local[a] - stiffness * s)


@njit(cache=True, error_model="numpy")
def grazes(contact, c, u, slip, missing, bound, slip_rate, local):
    """Replace the reaction in `local` by the nearest one without pressure if less than `missing`^1/2 away."""
    friction, away = 0.0, local[0] ** 2
    for a in range(1, local.size):
        friction -= local[a] * slip_along(contact, c, u, a) / slip
    friction = min(max(friction, 0.0), jump(bound, slip_rate * slip, contact.state[c]))
    for a in range(1, local.size):
        away += (local[a] + friction * slip_along(contact, c, u, a) / slip) ** 2
    if friction <= 0.0 or away >= missing:
        return False
    local[0] = 0.0
    for a in range(1, local.size):
        local[a] = -friction * slip_along(contact, c, u, a) / slip
    return True


@njit(cache=True, error_model="numpy")
def jump(bound, slip, state):
    """Friction as the pressure vanishes, exactly 0 for a law that is proportional to the pressure."""
    return 2.0 * allowed(bound, BARELY, slip, state) - allowed(bound, 2.0 * BARELY, slip, state)
