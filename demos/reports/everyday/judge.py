"""The judge: equilibrium, contact and friction in long double, and a conic solver (Clarabel) on the same matrices.

Without friction, and with friction at fixed bounds, the problem is convex,

    minimise 1/2 u.A u - b.u + sum bound |slip|   over   g + n.u >= 0,                                 (1)

so a displacement is right if and only if no increment from it lowers (1). Whether there is any solution is a
question to the rigid motions alone: the load must not do work in a motion that no admissible force of the
road resists.
"""

from dataclasses import dataclass, field
from typing import Any

import clarabel
import numpy as np
from scipy.sparse import block_array, csc_array, csr_array, triu, vstack

LONG = np.longdouble
EPS = float(np.finfo(float).eps)
TOLERANCE = 1e-9  # of the forces at work; solutions are asked for with a natural residual of 1e-10
CONIC = 1e-6  # of force squared times softness; what the conic solver is asked for, 1e-8, and a margin
DRIVEN = 1e-7  # power of a unit of load in a rigid motion of unit size, beyond which it counts
NOT_MOVED = 1e-6  # of the load: motions below it are what the conic solver leaves of none
FINEST = 1e-5  # of a step: nodes on whose holding a body is said to rest are as near to the road
LANDINGS = 100  # nodes that may arrive one after the other
PEAK = 1e-4  # of the size: from so far aside a corner of the road is seen to have another normal
DEEP = 0.1  # of a step: a node so far below the road shows that the step was too long for its planes
ROAD_STEPS, FAR = 1000, 100.0  # of a body let go on a road: at most, and sizes that are far
CLOSE = 1e3  # elastic displacements within which a node may touch


@dataclass
class Posed:
    """A contact problem as the judge sees it; N nodes, n candidates, d dimensions.

    Attributes
    ----------
    A : sparse (N d, N d)
    b : (N, d)
    coordinates : (N, d)
    nodes : (n,)
    normal : (n, d)
    gap : (n,)
    mu : float
    reference : (n, d)
    rounding : float
        Of the gaps, where they are differences of positions.
    off_road : list of str
        What is wrong with the planes themselves.
    """

    A: Any
    b: np.ndarray
    coordinates: np.ndarray
    nodes: np.ndarray
    normal: np.ndarray
    gap: np.ndarray
    mu: float
    reference: np.ndarray
    rounding: float = 0.0
    off_road: list[str] = field(default_factory=list)

    @property
    def prescribed(self) -> np.ndarray:
        """Which unknowns (N d,) stand alone."""
        A = csr_array(self.A)
        A.eliminate_zeros()
        return (np.diff(A.indptr) == 1) & (A.diagonal() != 0.0)


@dataclass
class Answer:
    """What a solver says: displacement (N, d), contact force (n, d), gap (n,)."""

    displacement: np.ndarray
    force: np.ndarray
    gap: np.ndarray


def complaints(posed: Posed, answer: Answer) -> list[str]:
    """Say all that is wrong with an answer; nothing if it is right."""
    u, f, n = answer.displacement, answer.force, posed.normal
    if not all(np.isfinite(values).all() for values in (u, f, answer.gap)):
        return ["values that are not finite"]
    _d, nodes = u.shape[1], posed.nodes
    fixed = posed.prescribed.reshape(u.shape)
    A = csr_array(posed.A)
    missing = LONG(posed.b) - (csr_array(A, dtype=LONG) @ LONG(u).ravel()).reshape(u.shape)
    missing[nodes] += np.where(fixed[nodes], 0.0, f)
    rounding = 4 * EPS * (abs(A) @ np.abs(u).ravel()).reshape(u.shape)
    size = _size(posed, answer)
    said: list[str] = []

    def check(what: str, value: Any, allowed: Any) -> None:
        if not value <= allowed:
            said.append(f"{what} {float(value):.1e}, allowed {float(allowed):.1e}")

    free = np.where(fixed, 0.0, missing)
    check("out of balance by", np.sqrt(np.sum(free**2)), TOLERANCE * size + np.linalg.norm(rounding))
    held = rounding + 16 * EPS * posed.A.diagonal().reshape(u.shape) * np.abs(u).max()
    check("prescribed values missed by", np.max(np.abs(missing) - held, where=fixed, initial=0.0), 0.0)
    motions = free_motions(posed)
    forces = posed.b.copy()
    forces[nodes] += f
    unbalanced = motions.T @ np.where(fixed, 0.0, forces).ravel()
    entries = np.abs(motions).T @ rounding.ravel()  # A resists rigid motions by the rounding of its entries
    off = np.abs(unbalanced) - entries
    missing = missing + (motions @ (unbalanced - motions.T @ missing.ravel())).reshape(u.shape)
    check("forces and moments of the whole off by", off.max(initial=0.0), TOLERANCE * size)

    p = np.einsum("ca,ca->c", f, n)
    g = LONG(posed.gap) + np.einsum("ca,ca->c", LONG(u[nodes]), LONG(n))
    length = posed.gap + np.abs(u[nodes]).sum(axis=1)
    check("tension", -p.min(), 1e-14 * size)
    check("gap below zero", -answer.gap.min(), 0.0)
    check(
        "gap not that of the displacement", np.max(np.abs(g - answer.gap) - 16 * EPS * length), posed.rounding
    )
    check("force across a gap", np.max(np.where(answer.gap > 0.0, np.linalg.norm(f, axis=1), 0.0)), 0.0)
    tau = f - p[:, None] * n
    slip = _along(LONG(u[nodes]) - posed.reference, n)
    check("friction beyond the cone", np.max(np.linalg.norm(tau, axis=1) - posed.mu * p), 1e-12 * size)
    way = np.sqrt(np.sum(slip**2, axis=1))
    idle = posed.mu * p * way + np.einsum("ca,ca->c", tau, slip)  # power not taken from the slip
    most = 16 * EPS * p * way + 2 * posed.mu * p * 16 * EPS * (length + np.abs(posed.reference).sum(axis=1))
    check("slip not against friction", np.max(idle - most), TOLERANCE * size**2 * _softness(posed))
    if not said:
        said += _by_cones(posed, answer, missing, motions, size, rounding / size)
    return said


def _size(posed: Posed, answer: Answer) -> float:
    """Forces at work: loads on free unknowns, and the road's."""
    fixed = posed.prescribed.reshape(posed.b.shape)
    return float(np.linalg.norm(np.where(fixed, 0.0, posed.b)) + np.linalg.norm(answer.force)) + 1e-300


def _softness(posed: Posed) -> float:
    """Displacement of a node by a unit of force, all others held."""
    return float(1.0 / np.median(posed.A.diagonal()))


def _along(way: np.ndarray, normal: np.ndarray) -> np.ndarray:
    return way - np.einsum("ca,ca->c", way, normal)[:, None] * normal


def _by_cones(
    posed: Posed,
    answer: Answer,
    missing: np.ndarray,
    motions: np.ndarray,
    size: float,
    rounding: np.ndarray,
) -> list[str]:
    """Look for an increment that lowers (1), in units of the forces and the softness.

    Nodes too far away to touch are left out, and the length of a slip is replaced by its derivative: both
    leave the question as it is, whether nothing is better than no increment. What the rounding (N, d) of the
    missing forces, in the same units, alone can lower is not counted.
    """
    d, unit = posed.b.shape[1], size * _softness(posed)
    r = np.array(missing)
    r[posed.nodes] -= np.where(posed.prescribed.reshape(r.shape)[posed.nodes], 0.0, answer.force)
    r = np.where(posed.prescribed.reshape(r.shape), 0.0, r).astype(float) / size
    near = np.flatnonzero(answer.gap <= CLOSE * unit)
    frame = _frames(posed.normal[near])
    columns = posed.nodes[near, None] * d + np.arange(d)
    number = np.arange(near.size)

    def rows_along(axis: int) -> csr_array:
        data, at = frame[:, axis].ravel(), columns.ravel()
        return csr_array((data, (np.repeat(number, d), at)), shape=(near.size, posed.b.size))

    A = csc_array(posed.A) * _softness(posed)
    bound = posed.mu * np.einsum("ca,ca->c", answer.force, posed.normal)[near] / size
    slip = _along(answer.displacement[posed.nodes] - posed.reference, posed.normal)[near] / unit
    rounding_of_slip = 16 * EPS * np.abs(answer.displacement[posed.nodes]).sum(axis=1)[near] / unit
    slip[np.linalg.norm(slip, axis=1) <= rounding_of_slip] = 0.0
    way = np.linalg.norm(slip, axis=1)
    slides, sticks = (bound > 0.0) & (way > 1.0), np.flatnonzero((bound > 0.0) & (way <= 1.0))
    q = -r
    q[posed.nodes[near[slides]]] += (bound / np.where(slides, way, 1.0))[slides, None] * slip[slides]
    local = np.einsum("cta,ca->ct", frame, slip)
    keep = np.flatnonzero(~posed.prescribed)
    # unknowns: increments of the free unknowns, then how far nodes that hardly slip do so
    k = sticks.size
    blocks, right, cones = [], [], []
    blocks.append([-rows_along(0)[:, keep], csr_array((near.size, k))])
    right.append(answer.gap[near] / unit)
    cones.append(clarabel.NonnegativeConeT(near.size))
    along = [rows_along(axis) for axis in range(1, d)]
    for j, c in enumerate(sticks):
        pick = csr_array(([-1.0], ([0], [j])), shape=(1, k))
        blocks.append([csr_array((1, keep.size)), pick])
        right.append([0.0])
        for axis, rows in enumerate(along, start=1):
            blocks.append([-rows[[c]][:, keep], csr_array((1, k))])
            right.append([local[c, axis]])
        cones.append(clarabel.SecondOrderConeT(d))
    if motions.shape[1]:  # keeps what nothing holds, and nothing drives, within sight
        Z = csr_array(motions[keep].T)
        empty = csr_array((Z.shape[0], k))
        blocks += [[Z, empty], [-Z, empty]]
        right += [np.full(Z.shape[0], CLOSE)] * 2
        cones.append(clarabel.NonnegativeConeT(2 * Z.shape[0]))
    P = block_array([[A[keep][:, keep], None], [None, csc_array((k, k))]]) if k else A[keep][:, keep]
    q = np.concatenate([q.ravel()[keep], bound[sticks]])
    value, x, found = _minimum(P, q, block_array(blocks), np.concatenate(right), cones)
    value -= float(bound[sticks] @ way[sticks])
    value += float(rounding.ravel()[keep] @ np.abs(x[: keep.size]))
    return [f"an increment lowers the energy by {-value:.1e}"] if found and value < -CONIC else []


def _minimum(
    P: Any, q: np.ndarray, rows: Any, right: np.ndarray, cones: list
) -> tuple[float, np.ndarray, bool]:
    """Return the least 1/2 x.P x + q.x over rows x + s = right, s in the cones, x, and if it was found."""
    found = _solution(P, q, rows, right, cones)
    return found.obj_val, np.array(found.x), _is_good(found)


def _solution(P: Any, q: np.ndarray, rows: Any, right: np.ndarray, cones: list) -> Any:
    """Return what Clarabel finds: x, z (the multipliers of the rows), obj_val and a status."""
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.max_threads = 1
    return clarabel.DefaultSolver(triu(P, format="csc"), q, csc_array(rows), right, cones, settings).solve()


def _is_good(found: Any) -> bool:
    return str(found.status) in ("Solved", "AlmostSolved")


def _frames(normal: np.ndarray) -> np.ndarray:
    """Normal and tangents (n, d, d), as rows."""
    d = normal.shape[1]
    if d == 2:
        return np.stack([normal, np.stack([-normal[:, 1], normal[:, 0]], axis=1)], axis=1)
    other = np.eye(3)[np.argmin(np.abs(normal), axis=1)]
    first = np.cross(normal, other)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return np.stack([normal, first, np.cross(normal, first)], axis=1)


def free_motions(posed: Posed) -> np.ndarray:
    """Rigid motions that A does not resist, (N d, m), orthonormal."""
    x, d = posed.coordinates, posed.b.shape[1]
    x = (x - x.mean(axis=0)) / (np.abs(x - x.mean(axis=0)).max() or 1.0)
    columns = [np.tile(e, (len(x), 1)) for e in np.eye(d)]
    for a, b in [(0, 1)] if d == 2 else [(0, 1), (1, 2), (2, 0)]:
        turn = np.zeros_like(x)
        turn[:, a], turn[:, b] = -x[:, b], x[:, a]
        columns.append(turn)
    R = np.linalg.qr(np.stack([c.ravel() for c in columns], axis=1))[0]
    energy, turned = np.linalg.eigh(R.T @ (posed.A @ R))
    return R @ turned[:, energy < 1e-10 * posed.A.diagonal().max()]


def driven_power(posed: Posed, directions: np.ndarray | None = None) -> float:
    """Return the most power of the load in a rigid motion that no admissible force of the road resists.

    Of a unit of load, in motions (orthonormal) of size 1: positive where there can be no equilibrium, 0 where
    the road or the supports may hold the body. On a road that bends `directions` (k, d) are normals that any
    candidate may meet.
    """
    Z = free_motions(posed)
    m, d = Z.shape[1], posed.b.shape[1]
    load = Z.T @ posed.b.ravel()
    size = float(np.linalg.norm(posed.b))
    if m == 0 or size == 0.0:
        return 0.0
    at = Z.reshape(-1, d, m)[posed.nodes]
    blocks, cones = [], []
    met = (
        posed.normal[:, None]
        if directions is None
        else np.broadcast_to(directions, (len(at), *directions.shape))
    )
    for motion, normals in zip(at, met):
        for frame in _frames(normals):
            local = frame @ motion
            blocks.append(-np.concatenate([local[:1], posed.mu * local[1:]]) if posed.mu else -local[:1])
            cones.append(clarabel.SecondOrderConeT(d) if posed.mu else clarabel.NonnegativeConeT(1))
    blocks += [np.eye(m), -np.eye(m)]
    cones.append(clarabel.NonnegativeConeT(2 * m))
    rows = np.concatenate(blocks)
    right = np.concatenate([np.zeros(len(rows) - 2 * m), np.ones(2 * m)])
    value, _, _ = _minimum(csc_array((m, m)), -load / size, csr_array(rows), right, cones)
    return -value


def never_rests(posed: Posed) -> bool:
    """Tell whether a body off the road that only friction could hold, let go, is carried off without end.

    As a rigid body it moves by the admissible motion nearest to the load's, which the conic solver finds: one
    that the friction cones of the nodes on the road let pass. Each next node that arrives changes it.
    """
    Z, d = free_motions(posed), posed.b.shape[1]
    m, size = Z.shape[1], float(np.linalg.norm(posed.b))
    if m == 0 or size == 0.0:
        return False
    at = np.einsum("cta,cam->ctm", _frames(posed.normal), Z.reshape(-1, d, m)[posed.nodes])
    load, gap = Z.T @ posed.b.ravel() / size, posed.gap.copy()
    for _ in range(LANDINGS):
        near = gap <= 1e-9 * gap.max()
        rows = [-np.concatenate([local[:1], posed.mu * local[1:]]) for local in at[near]]
        cones = [clarabel.SecondOrderConeT(d) for _ in rows]
        rows.append(np.zeros((1, m)))
        cones.append(clarabel.ZeroConeT(1))
        right = np.zeros(sum(len(row) for row in rows))
        _, motion, found = _minimum(
            csc_array(np.eye(m)), -load, csr_array(np.concatenate(rows)), right, cones
        )
        if not found or np.linalg.norm(motion) < NOT_MOVED:
            return False
        speed = at[:, 0] @ motion
        falls = speed < -1e-6 * np.abs(speed).max()
        if not falls.any():
            return True
        time = np.min(np.maximum(gap[falls], 0.0) / -speed[falls])
        gap = gap + time * speed
    return False


def prescribed_below(posed: Posed, road: Any, points: np.ndarray) -> bool:
    """Tell whether a node is prescribed a place below the road."""
    held = posed.prescribed.reshape(posed.b.shape)
    places = np.where(held, posed.b / posed.A.diagonal().reshape(posed.b.shape), 0.0)[posed.nodes]
    wholly = held[posed.nodes].all(axis=1)
    size = float(np.ptp(posed.coordinates, axis=0).max())
    return bool((road.closest(points + places)[0][wholly] < -1e-12 * size).any())


def leaves(posed: Posed, road: Any, points: np.ndarray) -> bool:
    """Tell whether the load carries a body, let go, far off along a road that is not flat.

    Likewise, in steps that are short enough for the planes to be true: nodes on the road within their friction
    cones, or, where they have left the point they stuck to, with friction against the way from there; the others
    above their planes. At a peak of the road a node may pass on either side, so that a body rests there only if it
    does by the planes of each.
    """
    Z, d = free_motions(posed), posed.b.shape[1]
    m, strength = Z.shape[1], float(np.linalg.norm(posed.b))
    if m == 0 or strength == 0.0:
        return False
    at = Z.reshape(-1, d, m)[posed.nodes]
    q, load, size = (
        np.zeros(m),
        Z.T @ posed.b.ravel() / strength,
        float(np.ptp(posed.coordinates, axis=0).max()),
    )
    first, net, touching, part = float(np.abs(road.closest(points)[0]).max()), 0.0, 1e-2, 1.0
    anchor = road.closest(points)[2]
    gap, normal, foot = road.closest(points)
    for _ in range(ROAD_STEPS):
        step = 0.05 * part * (size + net)
        local = np.einsum("cta,cam->ctm", _frames(normal), at)
        near, reach = gap <= touching * step, gap <= 4 * step
        slip = _along(foot - anchor, normal)
        slid = np.linalg.norm(slip, axis=1)
        held, cones = [np.zeros((1, m))], [clarabel.ZeroConeT(1)]
        for c in np.flatnonzero(near):
            if slid[c] <= touching * step:
                held.append(-np.concatenate([local[c, :1], posed.mu * local[c, 1:]]))
                cones.append(clarabel.SecondOrderConeT(d))
            else:
                held.append(-(normal[c] - posed.mu * slip[c] / slid[c])[None] @ at[c])
                cones.append(clarabel.NonnegativeConeT(1))
        rows = csr_array(np.concatenate(held))
        _, drive, found = _minimum(csc_array(np.eye(m)), -load, rows, np.zeros(rows.shape[0]), cones)
        if not found or np.linalg.norm(drive) < NOT_MOVED:
            if found and touching >= FINEST:
                touching /= 10.0
                continue
            if not found or posed.mu > 0.0:
                return False
            normal = _past_peaks(road, points + at @ q, normal, near, at, load, size)
            if normal is None:
                return False
            continue
        way = step * drive / np.abs(at @ drive).max()
        unit = float(np.linalg.norm(way))
        rows, right = -local[reach, 0] * unit / step, gap[reach] / step
        cones = [clarabel.NonnegativeConeT(len(right) + 1)]
        rows, right = csr_array(np.vstack([rows, np.zeros((1, m))])), np.append(right, 1.0)
        _, x, found = _minimum(csc_array(np.eye(m)), -way / unit, rows, right, cones)
        there = road.closest(points + at @ (q + unit * x))
        if not found or there[0].min() < min(-DEEP * step, 0.5 * gap.min()):
            part /= 2.0
            continue
        q, part, (gap, normal, foot) = q + unit * x, min(2.0 * part, 1.0), there
        net = float(np.abs(at @ q).max())
        if net > FAR * (size + first):
            return True
    return False


def _past_peaks(
    road: Any,
    x: np.ndarray,
    normal: np.ndarray,
    near: np.ndarray,
    at: np.ndarray,
    load: np.ndarray,
    size: float,
) -> np.ndarray | None:
    """Return normals (n, d) of other sides of the peaks that nodes at x (n, d) are on, which leave a way to go.

    Without friction; `near` (n,) are on the road, `at` (n, d, m) their motions, and `load` (m,) drives them.
    """
    little, d = PEAK * size, x.shape[1]
    for way in (*np.eye(d), *-np.eye(d)):
        side = normal.copy()
        side[near] = road.closest(x[near] + little * way)[1]
        above = road.closest(x + little * side)[2]
        peak = near & (np.linalg.norm(above - x, axis=1) < 0.1 * little)
        peak &= np.linalg.norm(side - normal, axis=1) > 0.1
        side[~peak] = normal[~peak]
        rows = csr_array(-np.einsum("ca,cam->cm", side, at)[near])
        cones = [clarabel.NonnegativeConeT(rows.shape[0])]
        _, drive, found = _minimum(csc_array(np.eye(load.size)), -load, rows, np.zeros(rows.shape[0]), cones)
        if peak.any() and found and np.linalg.norm(drive) >= NOT_MOVED:
            return side
    return None


def gives_way(posed: Posed, road: Any, points: np.ndarray) -> bool:
    """Tell whether an elastic body, let go on a road that is not flat, ends far off.

    Likewise, but what falls is the energy of the elastic body, so that one which the road would hold if it were
    rigid may yield and slide off. In each step no unknown moves farther than a part of the size, and friction
    has the bounds that the pressures of the last step give.
    """
    strength, keep = float(np.linalg.norm(posed.b)), np.flatnonzero(~posed.prescribed)
    if strength == 0.0:
        return False
    A, u = csr_array(posed.A), np.zeros(posed.b.size)
    size = float(np.ptp(posed.coordinates, axis=0).max())
    first, d = float(np.abs(road.closest(points)[0]).max()), posed.b.shape[1]
    columns = posed.nodes[:, None] * d + np.arange(d)
    anchor, bound = road.closest(points)[2], np.zeros(posed.nodes.size)
    fixed = posed.prescribed
    u[fixed] = posed.b.ravel()[fixed] / A.diagonal()[fixed]

    def rows_along(some: np.ndarray, ways: np.ndarray) -> csr_array:
        """Of some nodes (k,), what unknowns that are free do along ways (k, d)."""
        row, at = np.repeat(np.arange(some.size), d), columns[some].ravel()
        return csr_array((ways.ravel(), (row, at)), shape=(some.size, u.size))[:, keep]

    box = csr_array(np.concatenate([np.eye(keep.size), -np.eye(keep.size)]))
    for _ in range(ROAD_STEPS):
        net = float(np.abs(u).max())
        step = 0.05 * (size + net)
        at = points + u.reshape(posed.b.shape)[posed.nodes]
        gap, normal, _ = road.closest(at)
        near, rubs = np.flatnonzero(gap <= 4 * step), np.flatnonzero(bound > 0.0)
        frame, k = _frames(normal), rubs.size
        rows = vstack([-rows_along(near, normal[near]), box], format="csr")
        blocks, right = (
            [[rows, csr_array((rows.shape[0], k))]],
            [np.maximum(gap[near] / step, -1.0), np.ones(2 * keep.size)],
        )
        cones = [clarabel.NonnegativeConeT(rows.shape[0])]
        slip = np.einsum("cta,ca->ct", frame, at - anchor) / step
        for j, c in enumerate(rubs):
            blocks.append([csr_array((1, keep.size)), csr_array(([-1.0], ([0], [j])), shape=(1, k))])
            blocks.append([-rows_along(np.full(d - 1, c), frame[c, 1:]), csr_array((d - 1, k))])
            right += [[0.0], slip[c, 1:]]
            cones.append(clarabel.SecondOrderConeT(d))
        missing = (posed.b.ravel() - A @ u)[keep] / strength
        P = csc_array(A[keep][:, keep]) * (step / strength)
        P = block_array([[P, None], [None, csc_array((k, k))]]) if k else P
        q = np.concatenate([-missing, bound[rubs]])
        rows = block_array(blocks) if k else rows
        found = _solution(P, q, rows, np.concatenate(right), cones)
        x = np.array(found.x)[: keep.size]
        if not _is_good(found) or np.abs(x).max() < NOT_MOVED:
            return False
        bound[:] = 0.0
        bound[near] = posed.mu * np.array(found.z)[: near.size]
        u[keep] += step * x
        if net > FAR * (size + first):
            return True
    return False
