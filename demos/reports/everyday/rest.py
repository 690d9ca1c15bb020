"""Whether a body that nothing but a plane road holds can rest there, and whether it would ever stop.

In the linear model the gaps of a rigid body are linear in its motions, so that its places are a polyhedron, and
nodes that touch together do so at one of its corners as well. Where at each corner the load does work in a
motion that no admissible force of the nodes touching there resists (Farkas' lemma, decided by the conic
solver), forces and moments balance nowhere, whatever friction does: `rests_nowhere` is a proof, which knows
nothing of springs, paths or Newton's steps. Nodes within what an elastic body may give way count as touching.

Where friction might balance the load if the pressure were large enough, elasticity decides how large it can be,
which `slips_for_certain` bounds. `slides_on` is a second opinion, and no proof: the rigid body in a fluid, let go
under Coulomb's law.
"""

from dataclasses import replace
from itertools import combinations
from typing import Any

import clarabel
import numpy as np
from scipy.linalg import null_space
from scipy.sparse import csc_array, csr_array, vstack

from .judge import (
    DRIVEN,
    LANDINGS,
    NOT_MOVED,
    Posed,
    _frames,
    _is_good,
    _minimum,
    _softness,
    _solution,
    driven_power,
    free_motions,
)

GIVES = 10.0  # times the displacement by the load alone: gaps of nodes that may touch
ROOM = 1e-7  # of the size, and of the way there: rounding of a gap
PARALLEL = 1e-12  # determinant of motions of unit size in which nodes touch that never do so together
CERTAIN = 0.1  # margin of a proof
ROUNDS, SETTLED = 100, 1e-6  # of friction's bounds, and their change, of the load, that is none


def rests_nowhere(posed: Posed) -> bool:
    """Tell whether it is certain that forces and moments balance at no place of the body."""
    if not free_motions(posed).shape[1] or _moves_its_supports(posed):
        return False
    for touching in resting_places(posed):
        there = {name: getattr(posed, name)[touching] for name in ("nodes", "normal", "gap", "reference")}
        if not driven_power(replace(posed, **there)) > DRIVEN:
            return False
    return True


def resting_places(posed: Posed) -> np.ndarray:
    """Return which candidates touch (v, n) at the corners of the set of places of the rigid body."""
    Z, size = free_motions(posed), float(np.ptp(posed.coordinates, axis=0).max())
    across = np.einsum("ca,cam->cm", posed.normal, Z.reshape(*posed.b.shape, -1)[posed.nodes])
    U, s, _ = np.linalg.svd(across, full_matrices=False)
    a = U[:, s > 1e-9 * s[0]] * np.sqrt(len(U))  # the gaps are g + a q in the motions q that change them
    near, found = GIVES * _gives_way(posed, Z), [np.zeros((0, len(a)), dtype=bool)]
    for first in range(len(a)):
        others = combinations(range(first + 1, len(a)), a.shape[1] - 1)
        meet = np.array([(first, *rest) for rest in others], dtype=int).reshape(-1, a.shape[1])
        meet = meet[np.abs(np.linalg.det(a[meet])) > PARALLEL]
        q = np.linalg.solve(a[meet], -posed.gap[meet][..., None])[..., 0]
        gaps = posed.gap + q @ a.T
        room = ROOM * (size + np.abs(q).max(axis=1, initial=0.0))[:, None]
        found.append((gaps <= near + room)[(gaps >= -room).all(axis=1)])
    return np.unique(np.concatenate(found), axis=0)


def _gives_way(posed: Posed, Z: np.ndarray) -> float:
    """Return the largest displacement by the load where inertia alone balances it."""
    keep, b = np.flatnonzero(~posed.prescribed), posed.b.ravel() - Z @ (Z.T @ posed.b.ravel())
    soft, strength = _softness(posed), float(np.linalg.norm(b[keep])) or 1.0
    rows, cones = csr_array(Z[keep].T), [clarabel.ZeroConeT(Z.shape[1])]
    P = csr_array(posed.A)[keep][:, keep] * soft
    _, x, found = _minimum(P, -b[keep] / strength, rows, np.zeros(Z.shape[1]), cones)
    return float(np.abs(x).max()) * soft * strength if found else np.inf


def slips_for_certain(posed: Posed) -> bool:
    """Tell whether it is certain that the load slides the body along the road, for it is pressed too little.

    At an equilibrium let u be the displacement without the free motions Z along the road, which change neither
    gaps nor A u; E its norm, E^2 = u.A u; and P the sum of the pressures p. Then

        E^2 = b.u - g.p + sum tau.u_t <= beta E + mu kappa E P,                                          (1)

    beta and kappa being the largest b.u, and |u_t| of a node, at E = 1 with no node below the road that is on it
    at rest. For any w with n.w - mu |w_t| >= 1 at all nodes, W its norm,

        P <= sum (p n.w + tau.w_t) = w.A u - b.w <= W E - b.w,                                           (2)

    so that E is bounded, and P. But b.z = -sum tau.z_t <= mu P max |z_t| for z = Z Z.b.
    """
    motions, d = free_motions(posed), posed.b.shape[1]
    free = ~posed.prescribed
    loose = free.reshape(posed.b.shape)[posed.nodes].all(axis=1)  # forces on held nodes do no work
    frame, nodes, n = _frames(posed.normal[loose]), posed.nodes[loose], int(loose.sum())
    if not motions.shape[1] or not n or _moves_its_supports(posed):
        return False
    across = np.einsum("ca,cam->cm", frame[:, 0], motions.reshape(-1, d, motions.shape[1])[nodes])
    Z = motions @ null_space(across, rcond=1e-9)
    if not Z.shape[1]:
        return False
    rows = np.zeros((n, d, *posed.b.shape))
    rows[np.arange(n), :, nodes] = frame
    rows = rows.reshape(n, d, -1)[:, :, free]
    A, b = csr_array(posed.A)[free][:, free] * _softness(posed), posed.b.ravel()[free]
    b, on_road = b / (np.linalg.norm(b) or 1.0), posed.gap[loose] <= 0.0
    z = Z @ (Z[free].T @ b)
    fastest = np.linalg.norm(z.reshape(posed.b.shape)[nodes], axis=1).max()
    most = _most_pressure(A, b, rows, on_road, csr_array(Z[free].T), posed.mu)
    if not np.isfinite(most):
        return False
    return bool(z[free] @ b > (1.0 + CERTAIN) * posed.mu * most * fastest)


def _most_pressure(
    A: Any, b: np.ndarray, rows: np.ndarray, on_road: np.ndarray, along: Any, mu: float
) -> float:
    """Return the bound of (2) on P; rows (k, d, N) give the nodes' displacements along normals and tangents."""
    (k, d, N), m = rows.shape, along.shape[0]
    apart, off = clarabel.ZeroConeT(m), clarabel.NonnegativeConeT(int(on_road.sum()))
    blocks = vstack([csr_array(-rows[on_road, 0]), along]) if on_road.any() else along

    def most(h: np.ndarray) -> float:
        """Return the largest h.u at E = 1."""
        cones = [off, apart] if on_road.any() else [apart]
        value, _, found = _minimum(A, -h, blocks, np.zeros(blocks.shape[0]), cones)
        return float(np.sqrt(max(-2.0 * value, 0.0))) if found else np.inf

    lift = np.concatenate([-rows[:, :1], -mu * rows[:, 1:]], axis=1).reshape(k * d, N)
    right = np.append(np.tile(-np.eye(d)[0], k), np.zeros(m))
    cones = [clarabel.SecondOrderConeT(d)] * k + [apart]
    _, w, found = _minimum(A, np.zeros(N), vstack([csr_array(lift), along]), right, cones)
    if not found:
        return np.inf
    W, weight = float(np.sqrt(max(w @ (A @ w), 0.0))), max(-float(b @ w), 0.0)
    sides = [max(most(row), most(-row)) for row in rows[:, 1:].reshape(-1, N)]
    kappa = float(np.linalg.norm(np.reshape(sides, (k, d - 1)), axis=1).max())
    rest = 1.0 - mu * kappa * W
    return W * (most(b) + mu * kappa * weight) / rest + weight if rest > 0.0 else np.inf


def _moves_its_supports(posed: Posed) -> bool:
    return bool(np.any(posed.b[posed.prescribed.reshape(posed.b.shape)]))


def slides_on(posed: Posed) -> bool:
    """Tell whether the rigid body in a fluid, let go, ends in a motion that nothing more stops.

    It moves as fast as the load and the nodes on the road drive it, until the next node arrives.
    """
    Z, d = free_motions(posed), posed.b.shape[1]
    strength, size = float(np.linalg.norm(posed.b)), float(np.ptp(posed.coordinates, axis=0).max())
    if not Z.shape[1] or strength == 0.0 or _moves_its_supports(posed):
        return False
    at = np.einsum("cta,cam->ctm", _frames(posed.normal), Z.reshape(-1, d, Z.shape[1])[posed.nodes])
    load, gap = Z.T @ posed.b.ravel() / strength, posed.gap.copy()
    for _ in range(LANDINGS):
        near = gap <= ROOM * size
        motion = _driven(at[near], load, posed.mu)
        if np.linalg.norm(motion) < NOT_MOVED:
            return False
        speed = at[:, 0] @ motion
        falls = (speed < -1e-6 * np.abs(at @ motion).max()) & ~near
        if not falls.any():
            return True
        gap = np.maximum(gap + np.min(gap[falls] / -speed[falls]) * speed, 0.0)
    return False


def _driven(at: np.ndarray, load: np.ndarray, mu: float) -> np.ndarray:
    """Return the velocity (m,) in a fluid, of k nodes `at` (k, d, m) on the road; 0 where none is found.

    Friction is against their slip and mu times their pressure, by a fixed point of conic programmes: the
    velocity minimises 1/2 v.v - load.v + sum bound |slip| over those in which no node goes into the road.
    """
    k, d, m = at.shape
    slips, lengths = -at, np.zeros((k, d, k))
    slips[:, 0], lengths[np.arange(k), 0, np.arange(k)] = 0.0, -1.0
    across = np.hstack([-at[:, 0], np.zeros((k, k))])
    along = np.concatenate([slips, lengths], axis=2).reshape(k * d, m + k)
    rows = csr_array(np.vstack([across, along, np.zeros((1, m + k))]))
    cones = [clarabel.SecondOrderConeT(d)] * k + [clarabel.ZeroConeT(1)]
    cones = [clarabel.NonnegativeConeT(k), *cones] if k else cones
    P, bound = csc_array(np.diag(np.append(np.ones(m), np.zeros(k)))), np.full(k, SETTLED)
    for _ in range(ROUNDS):
        found = _solution(P, np.append(-load, bound), rows, np.zeros(rows.shape[0]), cones)
        if not _is_good(found):
            break
        before, bound = bound, np.maximum(mu * np.array(found.z[:k]), SETTLED)
        if np.abs(bound - before).max(initial=0.0) <= SETTLED:
            return np.array(found.x[:m])
    return np.zeros(m)
