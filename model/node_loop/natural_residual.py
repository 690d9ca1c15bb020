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

from model.node_loop.block_arithmetic import put, row_defect
from model.node_loop.blocks import FUSED
from model.node_loop.contact_sweep import gap_of, slip_of
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
        for i in range(len(R)):
            put(R, i, row_defect(A, A.indptr[i], A.indptr[i + 1], load, u, i, AHEAD, False, dim))
        local = np.empty(dim)
        for c in range(contact.nodes.size):
            i = contact.nodes[c]
            frame = contact.frame[c]
            for a in range(dim):
                local[a] = 0.0
                for b in range(dim):
                    local[a] -= frame[a, b] * R[i, b]
            # in contact it is 0 by construction, but for rounding
            gap = gap_of(contact, c, u) if status[c] == Status.FREE else 0.0
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
    d, state = local.size, contact.state[c]
    s, t = (0.0, 0.0) if status == Status.STICK else slip_of(contact, c, u)  # what would be left is rounding
    x, y = local[1], local[2] if d == 3 else 0.0
    stiffness, slip = max(contact.block[c, 1, 1], contact.block[c, d - 1, d - 1]), np.sqrt(s * s + t * t)
    size = np.sqrt((x - stiffness * s) ** 2 + (y - stiffness * t) ** 2)
    largest = allowed(bound, p, slip_rate * slip, state)
    part = largest / size if size > largest else 1.0
    v, w = part * (x - stiffness * s), part * (y - stiffness * t)
    missing = (local[0] - p) ** 2 + (x - v) ** 2 + (y - w) ** 2
    if status == Status.SLIP and slip > 0.0 and local[0] ** 2 < missing:
        against = min(max(-(x * s + y * t) / slip, 0.0), jump(bound, slip_rate * slip, state)) / slip
        away = local[0] ** 2 + (x + against * s) ** 2 + (y + against * t) ** 2
        if against > 0.0 and away < missing:
            p, v, w = 0.0, -against * s, -against * t
    local[0], local[1] = p, v
    if d == 3:
        local[2] = w


@njit(cache=True, error_model="numpy")
def jump(bound, slip, state):
    """Friction as the pressure vanishes, exactly 0 for a law that is proportional to the pressure."""
    return 2.0 * allowed(bound, BARELY, slip, state) - allowed(bound, 2.0 * BARELY, slip, state)
