"""Whether a body has an equilibrium on a plane road under Coulomb's law: branch and bound on linear programmes.

Forces f of the candidates, p along normals and tau along the road, and amplitudes q of the free motions Z
determine everything: f balances the load in the free motions, the nodes' displacements are u = W f + Z q + u0.
Each candidate is free (f = 0) or on the road (gap 0); it sticks (no slip s), or slips, and tau = -mu p s/|s|.
Not yet decided, it may have a gap and a force, and any friction with |tau| <= mu p. A slip known to lie between
two directions leaves for tau the convex hull of an arc of mu p. The sum of all p gap + tau.s, convex in
(f, q), is not above 0: where a solution of a programme exceeds that, its tangent plane there joins all
programmes.

A programme without a solution rules its case out; if all are ruled out, no equilibrium exists. A solution in
which every node obeys its law is one, within the accuracy of the programmes. Other cases are divided at the
node that is farthest from its law.

Every row, divided by its largest entry, is relaxed by `ROOM`, a hundred times what the programmes (HiGHS) let
pass, so that rounding rules nothing out.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import linprog

from .judge import Posed, _frames, free_motions

ROOM = 1e-5  # of a row's largest entry
OBEYED = 1e-4  # of the load, or of the displacement by it: how well a node obeys its law
RIGID = 1e8  # displacements by the load: slips beyond which the body counts as rigid
CUTS = 150  # planes that are kept
import os
WEIGHT = float(os.environ.get("WEIGHT","1"))
ROUNDS = 8  # of planes for one case
PROGRAMMES = 3000  # at most
THIN = 1e-7  # arc that is not divided any more
SIDES = 16  # of the polygon around a disc
SLIPS = {2: ((0.0, 0.0), (np.pi, np.pi)), 3: tuple((a, a + np.pi / 2) for a in np.pi / 2 * np.arange(4))}


@dataclass
class Case:
    """What is decided of k nodes.

    Attributes
    ----------
    touches : tuple of bool or None
    slip : tuple of (float, float) or str or None
        The angles between which its direction lies, or "none".
    """

    touches: tuple
    slip: tuple

    def divided(self, c: int, by_gap: bool, d: int) -> list["Case"]:
        """The cases in which node c is free or touches; or sticks or slips in a part of the ways that it may."""
        if by_gap:
            return [Case(_changed(self.touches, c, yes), self.slip) for yes in (True, False)]
        if self.slip[c] is None:
            parts: Any = ("none", *SLIPS[d])
        else:
            first, last = self.slip[c]
            middle = (first + last) / 2
            parts = ((first, middle), (middle, last))
        return [Case(self.touches, _changed(self.slip, c, part)) for part in parts]


def _changed(values: tuple, c: int, value: Any) -> tuple:
    return (*values[:c], value, *values[c + 1 :])


class Search:
    """The search for an equilibrium.

    Parameters
    ----------
    posed : Posed
        Of a body with free motions and a load.
    near : (n,) int
        The candidates that may touch; none of them is held.
    motion : (N d,)
        A rigid motion that takes them near the road, from which q counts.
    """

    def __init__(self, posed: Posed, near: np.ndarray, motion: np.ndarray):
        d, fixed = posed.b.shape[1], posed.prescribed
        nodes, frame = posed.nodes[near], _frames(posed.normal)[near]
        n, keep = len(nodes), np.flatnonzero(~fixed)
        self.mu, self.d, self.n = posed.mu, d, n
        A, still = posed.A.toarray(), np.zeros(posed.b.size)
        still[fixed] = posed.b.ravel()[fixed] / A.diagonal()[fixed]
        b = (posed.b.ravel() - A @ still)[keep]
        A, Z, force = A[np.ix_(keep, keep)], free_motions(posed)[keep], float(np.linalg.norm(b))
        E = np.zeros((n, d, *posed.b.shape))
        E[np.arange(n), :, nodes] = frame
        E = E.reshape(n * d, -1)
        away = np.eye(len(keep)) - Z @ Z.T
        G = away @ np.linalg.inv(A + A.diagonal().mean() * (Z @ Z.T)) @ away
        u0, W = E[:, keep] @ (G @ b), E[:, keep] @ G @ E[:, keep].T * force
        length = float(max(np.abs(u0).max(), np.abs(W).max()))
        start = (E @ (still + motion)).reshape(n, d)
        start[:, 0] += posed.gap[near]
        start[:, 1:] -= np.einsum("cta,ca->ct", frame[:, 1:], posed.reference[near])
        self.place = start / length + u0.reshape(n, d) / length
        R = (E[:, keep] @ Z).reshape(n, d, -1)
        _, s, V = np.linalg.svd(R[:, 0])
        R, turned, across = R @ V.T, V @ (Z.T @ b), np.count_nonzero(s > 1e-9 * s[0])
        R[:, 0, across:] = 0.0  # motions that change no gap
        far = max(1.0, np.abs(self.place).max())
        unit = np.maximum(np.abs(R).max(axis=(0, 1)), 1e-300)
        unit /= np.where((np.arange(len(unit)) < across) & (far < RIGID), 1.0, far)
        R = (R / unit).reshape(n * d, -1)
        self.balance = np.hstack([R.T, np.zeros((len(unit), len(unit)))])
        self.load = turned / unit / force
        self.rows = np.hstack([W / length, R]).reshape(n, d, -1)
        self.planes: list[tuple[np.ndarray, float]] = []
        angles = 2 * np.pi * np.arange(SIDES) / SIDES
        self.polygon = _ways(angles, d) if d == 3 else np.array([[1.0], [-1.0]])
        self.programmes = 0

    def run(self, programmes: int = PROGRAMMES) -> tuple[str, np.ndarray | None]:
        """Return "none", "some" with u (n, d) and f (n, d) of the nodes, in their frames, or "unknown"."""
        cases = [Case((None,) * self.n, (None,) * self.n)]
        while cases:
            case = cases.pop()
            x = self._solved(case)
            if x is None:
                continue
            if self.programmes >= programmes:
                return "unknown", None
            off = self._off(case, x)
            c, way = np.unravel_index(np.argmax(off), off.shape)
            if off[c, way] <= OBEYED:
                return "some", x
            arc = case.slip[c]
            if way == 1 and arc is not None and arc[1] - arc[0] < THIN:
                return "unknown", None
            cases += case.divided(int(c), way == 0, self.d)
        return "none", None

    def _solved(self, case: Case) -> np.ndarray | None:
        """Return (f, q) of a case, or None where there is none."""
        for _ in range(ROUNDS):
            rows, low, high, bounds = self._programme(case)
            self.programmes += 1
            found = _point_of(rows, low, high, bounds)
            if found is None:
                return None
            if not self._cut(found):
                break
        return found

    def _programme(self, case: Case) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        n, d, mu = self.n, self.d, self.mu
        size = self.rows.shape[-1]
        rows, low, high = [self.balance], [-self.load], [-self.load]
        least, most = np.full(size, -np.inf), np.full(size, np.inf)
        least[: n * d : d] = 0.0
        polygon = []

        def add(block: np.ndarray, lower: Any, upper: Any) -> None:
            rows.append(block)
            low.append(np.broadcast_to(lower, len(block)))
            high.append(np.broadcast_to(upper, len(block)))

        for c in range(n):
            f, gap, s, arc = slice(c * d, c * d + d), self.place[c, 0], self.place[c, 1:], case.slip[c]
            add(self.rows[c, :1], -gap, -gap if case.touches[c] else np.inf)
            if case.touches[c] is False:
                least[f] = most[f] = 0.0
            if arc == "none":
                add(self.rows[c, 1:], -s, -s)
            elif arc is not None:
                N = _inwards(arc, d)
                add(N @ self.rows[c, 1:], -N @ s, np.inf)
            if case.touches[c] is False:
                continue
            if arc is not None and arc != "none":
                middle, wide = sum(arc) / 2, (arc[1] - arc[0]) / 2
                outer = _ways(np.array([arc[0], middle, arc[1]]), d)
                N = _inwards(arc, d)
                hull = np.zeros((4 + len(N), size))
                hull[:, f] = np.vstack(
                    [
                        np.append(-mu * np.cos(wide), -outer[1]),
                        np.column_stack([np.full(3, mu), outer]),
                        np.column_stack([np.zeros(len(N)), -N]),
                    ]
                )
                add(hull, 0.0, np.inf)
            else:
                polygon.append(c)
        if polygon:
            m = len(self.polygon)
            disc = np.zeros((len(polygon), m, size))
            for j, c in enumerate(polygon):
                disc[j, :, c * d : c * d + d] = np.column_stack([np.full(m, mu), self.polygon])
            add(disc.reshape(-1, size), 0.0, np.inf)
        if self.planes:
            add(np.array([plane for plane, _ in self.planes]), -np.inf, [most for _, most in self.planes])
        A, lower, upper = np.concatenate(rows), np.concatenate(low), np.concatenate(high)
        sides = np.maximum(
            np.where(np.isfinite(lower), np.abs(lower), 0), np.where(np.isfinite(upper), np.abs(upper), 0)
        )
        scale = np.maximum(np.abs(A).max(axis=1), sides)
        return A / scale[:, None], lower / scale - ROOM, upper / scale + ROOM, np.column_stack([least, most])

    def _cut(self, x: np.ndarray) -> bool:
        """Add the plane that x violates most, if it does."""
        n = self.n * self.d
        f, q = x[:n], x[n:]
        bent = self.rows.reshape(n, -1)[:, :n] @ f
        parts = np.array([f @ bent, f @ self.place.ravel(), -self.load @ q])
        if parts.sum() <= ROOM * np.abs(parts).sum() + ROOM:
            return False
        slope = np.append(2 * bent + self.place.ravel(), -self.load)
        self.planes = [*self.planes[-CUTS + 1 :], (slope, float(slope @ x - parts.sum()))]
        return True

    def _off(self, case: Case, x: np.ndarray) -> np.ndarray:
        """How far the nodes are off their laws of contact and of friction (n, 2)."""
        f, u = x[: self.n * self.d].reshape(self.n, self.d), self.rows @ x + self.place
        p, slip = f[:, 0], np.linalg.norm(u[:, 1:], axis=1)
        off = np.zeros((self.n, 2))
        off[:, 0] = np.where([yes is None for yes in case.touches], np.minimum(p, np.abs(u[:, 0])), 0.0)
        way = u[:, 1:] / np.where(slip > 0.0, slip, 1.0)[:, None]
        wrong = np.linalg.norm(f[:, 1:] + self.mu * p[:, None] * way, axis=1) * np.minimum(slip, 1.0)
        off[:, 1] = WEIGHT * np.where([arc == "none" for arc in case.slip], 0.0, wrong)
        return off


def _point_of(rows: np.ndarray, low: np.ndarray, high: np.ndarray, bounds: np.ndarray) -> np.ndarray | None:
    """Return a point with low <= rows x <= high within bounds, or None where there is none."""
    below, above = np.isfinite(low), np.isfinite(high)
    A, b = np.concatenate([rows[above], -rows[below]]), np.concatenate([high[above], -low[below]])
    for method, presolve in (("highs-ds", True), ("highs-ds", False), ("highs-ipm", True)):
        options = {"presolve": presolve}
        found = linprog(np.zeros(rows.shape[1]), A, b, bounds=bounds, method=method, options=options)
        if found.status in (0, 2):
            return found.x
    raise ArithmeticError(found.message)


def _ways(angles: np.ndarray, d: int) -> np.ndarray:
    """Unit vectors along the road (k, d - 1)."""
    return np.column_stack([np.cos(angles), np.sin(angles)])[:, : d - 1]


def _inwards(arc: tuple[float, float], d: int) -> np.ndarray:
    """Normals of the sector between two angles."""
    if d == 2:
        return _ways(np.array(arc[:1]), d)
    return _ways(np.array([arc[0] + np.pi / 2, arc[1] - np.pi / 2]), d)


def has_none(posed: Posed) -> bool:
    """Tell whether it is certain that there is no equilibrium."""
    fixed = posed.prescribed.reshape(posed.b.shape)
    if fixed[posed.nodes].any() or not free_motions(posed).shape[1] or not np.any(posed.b[~fixed]):
        return False
    return all(Search(posed, *place).run()[0] == "none" for place in places(posed))


def places(posed: Posed) -> list[tuple[np.ndarray, np.ndarray]]:
    from itertools import combinations
    from .rest import _gives_way, GIVES, ROOM as SLACK, PARALLEL
    Z, size = free_motions(posed), float(np.ptp(posed.coordinates, axis=0).max())
    across = np.einsum("ca,cam->cm", posed.normal, Z.reshape(*posed.b.shape, -1)[posed.nodes])
    U, s, V = np.linalg.svd(across, full_matrices=False)
    kept = s > 1e-9 * s[0]
    a = U[:, kept] * np.sqrt(len(U))
    back = Z @ (V[kept].T * np.sqrt(len(U)) / s[kept])
    near = GIVES * _gives_way(posed, Z)
    found={}
    for first in range(len(a)):
        others = combinations(range(first + 1, len(a)), a.shape[1] - 1)
        meet = np.array([(first, *rest) for rest in others], dtype=int).reshape(-1, a.shape[1])
        meet = meet[np.abs(np.linalg.det(a[meet])) > PARALLEL]
        q = np.linalg.solve(a[meet], -posed.gap[meet][..., None])[..., 0]
        gaps = posed.gap + q @ a.T
        room = SLACK * (size + np.abs(q).max(axis=1, initial=0.0))[:, None]
        ok=(gaps >= -room).all(axis=1)
        for g,r,qq in zip(gaps[ok],room[ok],q[ok]): found[tuple(np.flatnonzero(g<=near+r))]=back@qq
    keys=[k for k in found if not any(set(k)<set(o) for o in found)]
    return [(np.array(k),found[k]) for k in keys]
