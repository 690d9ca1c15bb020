"""Where a body can come to rest on a plane road, and whether it would ever stop.

In the linear model the gaps of a rigid body are linear in its motions, so that its places are a polyhedron. Strain
moves the nodes a little from there.

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
    _solution,
    free_motions,
)

MANY = 5000  # places of a body that bends so much that it is not looked at
ROOM = 1e-7  # of the size, and of the way there: rounding of a gap
PARALLEL = 1e-12  # determinant of motions of unit size in which nodes touch that never do so together
ROUNDS, SETTLED = 100, 1e-6  # of friction's bounds, and their change, of the load, that is none


def resting_places(posed: Posed, gives: float) -> list[tuple[np.ndarray, np.ndarray]] | None:
    """Return which candidates may touch together (k,), and a rigid motion (N d,) near which they do; None if many.

    Strain may displace a candidate by D = `gives` along its normal. The gaps g + a q that the rigid motion q alone would
    leave are then from -D to D where nodes touch, and not below -D elsewhere; q may be moved until as many nodes
    as determine it are between -D and D. Of these nodes some B have the largest determinant: the rows a of the
    others are sums of theirs with weights w between -1 and 1. Where the gaps of B are made 0, those of the others
    are up to D (1 + sum |w|), and no gap is less than the opposite. All such B are tried.
    """
    Z, size = free_motions(posed), float(np.ptp(posed.coordinates, axis=0).max())
    across = np.einsum("ca,cam->cm", posed.normal, Z.reshape(*posed.b.shape, -1)[posed.nodes])
    U, s, V = np.linalg.svd(across, full_matrices=False)
    kept, n = s > 1e-9, len(U)
    a = U[:, kept] * np.sqrt(n)  # the gaps are g + a q in the motions q that change them
    motion = Z @ (V[kept].T / s[kept] * np.sqrt(n))
    found: dict[bytes, tuple[np.ndarray, np.ndarray]] = {}
    if not kept.any():
        return [(np.flatnonzero(posed.gap <= gives), np.zeros(len(Z)))]
    for first in range(n):
        others = combinations(range(first + 1, n), a.shape[1] - 1)
        meet = np.array([(first, *rest) for rest in others], dtype=int).reshape(-1, a.shape[1])
        meet = meet[np.abs(np.linalg.det(a[meet])) > PARALLEL]
        q = np.linalg.solve(a[meet], -posed.gap[meet][..., None])[..., 0]
        gaps, parts = posed.gap + q @ a.T, np.abs(a @ np.linalg.inv(a[meet]))
        room = ROOM * (size + np.abs(q).max(axis=1, initial=0.0))[:, None]
        change = gives * (1.0 + parts.sum(axis=2)) + room
        above = (gaps >= -change).all(axis=1)
        touching = (gaps <= change) & (parts.max(axis=2) <= 1.0 + ROOM)
        for some, at in zip(touching[above], q[above]):
            found[some.tobytes()] = some, at
    if len(found) > MANY:
        return None
    sets = np.array([some for some, _ in found.values()]).reshape(-1, n).astype(float)
    count = sets.sum(axis=1)
    within = (sets @ sets.T == count[:, None]) & (count[:, None] < count)
    most = [place for place, more in zip(found.values(), within.any(axis=1)) if not more]
    return [(np.flatnonzero(some), motion @ at) for some, at in most]


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
