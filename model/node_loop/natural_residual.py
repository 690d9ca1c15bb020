"""The natural residual.

One number that says how far a displacement is from the solution of the contact problem.

For given displacements the road's force on each candidate is taken as the admissible one nearest to what
equilibrium asks for (p >= 0, p = 0 away from the road, |tau| <= bound): the projections of the natural map,

    p   = max(0, -r_n - D_nn g),        tau = projection of (-r_t - D_tt s) onto the friction disc,

with r = load - A u the defect of the node without the road, g its gap and s its slip. What is then missing
from equilibrium, R = r + f, vanishes exactly where all of equilibrium, g >= 0, p >= 0, p g = 0 and the
friction law hold. Its norm over that of the forces at work is dimensionless.
"""

from functools import lru_cache
from typing import Any

import numpy as np
from numba import njit

from model.node_loop.blocks import FUSED, BlockMatrix, flat, row_defect_2, row_defect_3, row_defect_any
from model.node_loop.friction_laws import allowed
from model.node_loop.prefetch import AHEAD
from model.node_loop.status import Status


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
            local[0] = p
            if friction:
                admissible_traction(contact, c, u, p, status[c] == Status.STICK, bound, slip_rate, local)
            for a in range(dim):
                force[c, a] = frame[0, a] * p
                if friction:
                    for b in range(1, dim):
                        force[c, a] += frame[b, a] * local[b]
                R[i, a] += force[c, a]

    return compute


@njit(cache=True, error_model="numpy")
def admissible_traction(contact, c, u, p, sticks, bound, slip_rate, local):
    """Replace the tangential reaction in `local` by its projection onto the friction disc of pressure p."""
    d = local.size
    i = contact.nodes[c]
    stiffness = 0.0
    for a in range(1, d):
        stiffness = max(stiffness, contact.block[c, a, a])
    size, slip = 0.0, 0.0
    for a in range(1, d):
        s = -contact.reference[c, a - 1]
        for b in range(d):
            s += contact.frame[c, a, b] * u[i, b]
        if sticks:
            s = 0.0  # held by construction; what is left is rounding
        slip += s * s
        local[a] -= stiffness * s
        size += local[a] ** 2
    size = np.sqrt(size)
    largest = allowed(bound, p, slip_rate * np.sqrt(slip), contact.state[c])
    if size > largest:
        for a in range(1, d):
            local[a] *= largest / size
