"""Where the rigid body can come to rest on a plane road, and whether it would ever stop.

In the linear model the gaps of a rigid body are linear in its motions, so that its places are a polyhedron, and
nodes that touch together do so at one of its corners as well. Nodes within what an elastic body may give way
count as touching.

`slides_on` is an opinion, and no proof: the rigid body in a fluid, let go under Coulomb's law.
"""

from itertools import combinations

import clarabel
import numpy as np
from scipy.sparse import csc_array, csr_array

from .judge import (
    LANDINGS,
    NOT_MOVED,
    Posed,
    _frames,
    _is_good,
    _minimum,
    _softness,
    _solution,
    free_motions,
)

GIVES = 10.0  # times the displacement by the load alone: gaps of nodes that may touch
ROOM = 1e-7  # of the size, and of the way there: rounding of a gap
PARALLEL = 1e-12  # determinant of motions of unit size in which nodes touch that never do so together
ROUNDS, SETTLED = 100, 1e-6  # of friction's bounds, and their change, of the load, that is none


def resting_places(posed: Posed) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return which candidates touch (k,), and the rigid motion (N d,), at corners of the rigid body's places."""
    Z, size = free_motions(posed), float(np.ptp(posed.coordinates, axis=0).max())
    across = np.einsum("ca,cam->cm", posed.normal, Z.reshape(*posed.b.shape, -1)[posed.nodes])
    U, s, V = np.linalg.svd(across, full_matrices=False)
    kept, n = s > 1e-9, len(U)
    a = U[:, kept] * np.sqrt(n)  # the gaps are g + a q in the motions q that change them
    motion = Z @ (V[kept].T / s[kept] * np.sqrt(n))
    near, found = GIVES * _gives_way(posed, Z), {}
    if not kept.any():
        return [(np.flatnonzero(posed.gap <= near), np.zeros(len(Z)))]
    for first in range(n):
        others = combinations(range(first + 1, n), a.shape[1] - 1)
        meet = np.array([(first, *rest) for rest in others], dtype=int).reshape(-1, a.shape[1])
        meet = meet[np.abs(np.linalg.det(a[meet])) > PARALLEL]
        q = np.linalg.solve(a[meet], -posed.gap[meet][..., None])[..., 0]
        gaps = posed.gap + q @ a.T
        room = ROOM * (size + np.abs(q).max(axis=1, initial=0.0))[:, None]
        corner = (gaps >= -room).all(axis=1)
        for touching, at in zip((gaps <= near + room)[corner], q[corner]):
            found[tuple(np.flatnonzero(touching))] = at
    most = [some for some in found if not any(set(some) < set(others) for others in found)]
    return [(np.array(some), motion @ found[some]) for some in most]


def _gives_way(posed: Posed, Z: np.ndarray) -> float:
    """Return the largest displacement by the load where inertia alone balances it."""
    keep, b = np.flatnonzero(~posed.prescribed), posed.b.ravel() - Z @ (Z.T @ posed.b.ravel())
    soft, strength = _softness(posed), float(np.linalg.norm(b[keep])) or 1.0
    rows, cones = csr_array(Z[keep].T), [clarabel.ZeroConeT(Z.shape[1])]
    P = csr_array(posed.A)[keep][:, keep] * soft
    _, x, found = _minimum(P, -b[keep] / strength, rows, np.zeros(Z.shape[1]), cones)
    return float(np.abs(x).max()) * soft * strength if found else np.inf


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
