"""Whether a body has an equilibrium on a plane road under Coulomb's law: branch and bound on linear programmes.

Forces f of the candidates, p along normals and tau along the road, and amplitudes q of the free motions R
decide everything: the forces balance the load in the free motions, and the nodes are displaced by
u = W f + R q + u0. A candidate is free (f = 0) or on the road (gap 0), and there it sticks (no slip s), or slips
and tau = -mu p s/|s|. One that is not decided may have a gap and a force at once, and any |tau| <= mu p; of a
slip between two directions the opposite of tau lies in the convex hull of an arc of radius mu p. At an
equilibrium the sum over p gap + tau.s, which is convex in (f, q), is not above 0: where the solution of a
programme has more, the tangent plane there joins all further programmes.

A programme that has no solution rules out its case; if all are ruled out, there is no equilibrium. Else the
case is divided at the node that is farthest from its law, until one obeys all laws, and there may well be one.

A search is about nodes that may touch together near one place of the rigid body; all places are searched where
strain displaces no candidate by more than `GIVES` times what the load does by itself. Rows of the programmes are
divided by their largest entries and relaxed by `ROOM`, a hundred times what the solver (HiGHS) lets pass: rounding
rules out nothing.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import linprog

from .judge import Posed, _frames, free_motions
from .rest import resting_places

ROOM = 1e-5  # of a row's largest entry
OBEYED = 1e-4  # of the load, and of the displacement by it: how well nodes obey their laws
RIGID = 1e4  # displacements by the load: slips beyond which strain is rounding
PLANES, ROUNDS = 150, 8  # that are kept, and found for one case
PROGRAMMES = 3000  # at most, for all places of a body
THIN = 1e-7  # an arc that is not divided any more
SIDES = 16  # of the polygon around a disc
HALVES = {2: ((0.0, 0.0), (np.pi, np.pi)), 3: tuple((a, a + np.pi / 2) for a in np.pi / 2 * np.arange(4))}


@dataclass
class Case:
    """What is decided of k nodes.

    Attributes
    ----------
    touches : tuple of bool or None
    slip : tuple of (float, float) or "none" or None
        Angles between which it has its direction.
    """

    touches: tuple
    slip: tuple

    def divided(self, c: int, by_slip: bool, d: int) -> list["Case"]:
        """The cases in which node c touches or is free; or sticks or slips in a part of its ways."""
        if not by_slip:
            return [Case(_changed(self.touches, c, touches), self.slip) for touches in (True, False)]
        parts: tuple = ("none", *HALVES[d])
        if self.slip[c] is not None:
            first, last = self.slip[c]
            parts = ((first, (first + last) / 2), ((first + last) / 2, last))
        return [Case(self.touches, _changed(self.slip, c, part)) for part in parts]


def _changed(values: tuple, c: int, value: Any) -> tuple:
    return (*values[:c], value, *values[c + 1 :])


def has_equilibrium(posed: Posed, programmes: int = PROGRAMMES) -> bool | None:
    """Tell whether a body with free motions has an equilibrium under its load; None if that is not decided.

    `False` is a proof; `True` within `OBEYED`.
    """
    fixed = posed.prescribed.reshape(posed.b.shape)
    if fixed[posed.nodes].any() or not free_motions(posed).shape[1] or not posed.b[~fixed].any():
        return None
    places = resting_places(posed)
    if places is None:
        return None
    condensed = Condensed.of(posed)
    try:
        for near, motion in places:
            search = Search(condensed.after(motion), near, posed.mu)
            found = search.run(programmes)
            if found is not False:
                return found
            programmes -= search.programmes
    except ArithmeticError:
        return None
    return False


class Condensed(NamedTuple):
    """What forces f, in units of the load, and amplitudes q do to n nodes, in their frames.

    Attributes
    ----------
    W : (n, d, n, d)
        Displacements by forces that balance in the free motions.
    R : (n, d, m)
        Displacements in these motions; the last ones lead along the road.
    start : (n, d)
        Gap and slip without f and q.
    load : (m,)
        Work of the load in the motions.
    nodes, frame : (n,), (n, d, d)
    """

    W: np.ndarray
    R: np.ndarray
    start: np.ndarray
    load: np.ndarray
    nodes: np.ndarray
    frame: np.ndarray

    @classmethod
    def of(cls, posed: Posed) -> "Condensed":
        """All candidates of a problem."""
        fixed, (N, d), n = posed.prescribed, posed.b.shape, len(posed.nodes)
        keep, frame = np.flatnonzero(~fixed), _frames(posed.normal)
        A, held = posed.A.toarray(), np.zeros(N * d)
        held[fixed] = posed.b.ravel()[fixed] / A.diagonal()[fixed]
        b = (posed.b.ravel() - A @ held)[keep]
        A, Z, force = A[np.ix_(keep, keep)], free_motions(posed)[keep], float(np.linalg.norm(b))
        at = np.zeros((n, d, N, d))
        at[np.arange(n), :, posed.nodes] = frame
        at = at.reshape(n * d, N * d)[:, keep]
        strains = np.eye(len(keep)) - Z @ Z.T
        soft = strains @ np.linalg.inv(A + A.diagonal().mean() * (Z @ Z.T)) @ strains
        R = (at @ Z).reshape(n, d, -1)
        _, s, V = np.linalg.svd(R[:, 0])
        R = R @ V.T
        R[:, 0, np.count_nonzero(s > 1e-9) :] = 0.0
        start = (at @ (soft @ b)).reshape(n, d)
        start[:, 0] += posed.gap
        start[:, 1:] -= np.einsum("cta,ca->ct", frame[:, 1:], posed.reference)
        W = (at @ soft @ at.T * force).reshape(n, d, n, d)
        return cls(W, R, start, V @ (Z.T @ b) / force, posed.nodes, frame)

    def after(self, motion: np.ndarray) -> "Condensed":
        """The nodes after a rigid motion (N d,)."""
        moved = motion.reshape(-1, self.start.shape[1])[self.nodes]
        return self._replace(start=self.start + np.einsum("cta,ca->ct", self.frame, moved))


class Search:
    """The search for an equilibrium in which of a body's candidates only some nodes touch.

    Lengths are in units of the displacement by the load.

    Parameters
    ----------
    body : Condensed
    near : (n,) int
        The nodes that may touch; the others stay above the road.
    mu : float
    """

    def __init__(self, body: Condensed, near: np.ndarray, mu: float):
        (k, d, m), n = body.R.shape, len(near)
        others = np.setdiff1d(np.arange(k), near)
        size = float(np.abs(body.W).max())
        self.n, self.d, self.mu, self.start = n, d, mu, body.start[near] / size
        slips = max(1.0, float(np.abs(self.start).max()))
        across = body.R[:, 0].any(axis=0)
        unit = np.maximum(np.abs(body.R).max(axis=(0, 1)), 1e-300)
        unit /= np.where(across & (slips < RIGID), 1.0, slips)
        self.load, R = body.load / unit, body.R / unit
        self.balance = np.hstack([R[near].reshape(n * d, m).T, np.zeros((m, m))])
        rows = np.concatenate([body.W[:, :, near].reshape(k, d, n * d) / size, R], axis=2)
        self.rows, self.others = rows[near], (rows[others, 0], body.start[others, 0] / size)
        angles = 2 * np.pi * np.arange(SIDES) / SIDES
        self.polygon = _ways(angles, d) if d == 3 else np.array([[1.0], [-1.0]])
        self.planes: list[tuple[np.ndarray, float]] = []
        self.programmes = 0

    def run(self, programmes: int = PROGRAMMES) -> bool | None:
        """Tell whether there is an equilibrium; None if so many programmes do not tell."""
        cases = [Case((None,) * self.n, (None,) * self.n)]
        while cases:
            case = cases.pop()
            x = self._solution(case)
            if x is None:
                continue
            off = self._off(case, x)
            c, by_slip = (int(at) for at in np.unravel_index(np.argmax(off), off.shape))
            if off[c, by_slip] <= OBEYED:
                return True
            arc = case.slip[c] if by_slip else None
            if self.programmes >= programmes or (arc is not None and arc[1] - arc[0] < THIN):
                return None
            cases += case.divided(c, bool(by_slip), self.d)
        return False

    def _solution(self, case: Case) -> np.ndarray | None:
        """Return the forces and amplitudes of a case, or None where it has none."""
        for _ in range(ROUNDS):
            self.programmes += 1
            x = _point_of(*self._programme(case))
            if x is None or not self._cut_off(x):
                break
        return x

    def _programme(self, case: Case) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return rows, their lower and upper ends, and the bounds of the unknowns."""
        d, mu, size = self.d, self.mu, self.rows.shape[-1]
        blocks, ends = [self.balance], [np.column_stack([-self.load, -self.load])]
        bounds = np.tile([-np.inf, np.inf], (size, 1))
        bounds[: self.n * d : d, 0] = 0.0

        def add(rows: np.ndarray, low: Any, high: Any) -> None:
            blocks.append(rows)
            ends.append(np.column_stack([np.broadcast_to(end, len(rows)) for end in (low, high)]))

        for c, (touches, slip) in enumerate(zip(case.touches, case.slip)):
            force, gap, s = slice(c * d, c * d + d), self.start[c, 0], self.start[c, 1:]
            add(self.rows[c, :1], -gap, -gap if touches else np.inf)
            arc = slip if isinstance(slip, tuple) else None
            if slip == "none":
                add(self.rows[c, 1:], -s, -s)
            elif arc is not None:
                inwards = _inwards(arc, d)
                add(inwards @ self.rows[c, 1:], -inwards @ s, np.inf)
            if touches is False:
                bounds[force] = 0.0
                continue
            law = np.zeros((0, d))  # of rows whose products with (p, tau) are not negative
            if arc is None:
                law = np.insert(self.polygon, 0, mu, axis=1)
            else:
                middle, wide = sum(arc) / 2, arc[1] - arc[0]
                tangents = _ways(np.array([arc[0], middle, arc[1]]), d)
                chord = np.append(-mu * np.cos(wide / 2), -tangents[1])
                law = np.vstack(
                    [np.insert(tangents, 0, mu, axis=1), chord, np.insert(-inwards, 0, 0.0, axis=1)]
                )
            rows = np.zeros((len(law), size))
            rows[:, force] = law
            add(rows, 0.0, np.inf)
        rows, gaps = self.others
        add(rows, -gaps, np.inf)
        if self.planes:
            add(np.array([plane for plane, _ in self.planes]), -np.inf, [most for _, most in self.planes])
        A, end = np.concatenate(blocks), np.concatenate(ends)
        scale = np.maximum(np.abs(A).max(axis=1), np.abs(np.where(np.isfinite(end), end, 0.0)).max(axis=1))
        low, high = (end / scale[:, None] + [-ROOM, ROOM]).T
        return A / scale[:, None], low, high, bounds

    def _cut_off(self, x: np.ndarray) -> bool:
        """Add the plane beyond which x lies, if it does."""
        n = self.n * self.d
        f, q = x[:n], x[n:]
        bent = self.rows.reshape(n, -1)[:, :n] @ f
        parts = np.array([f @ bent, f @ self.start.ravel(), -self.load @ q])
        if parts.sum() <= ROOM * np.abs(parts).sum() + ROOM:
            return False
        slope = np.append(2 * bent + self.start.ravel(), -self.load)
        self.planes = [*self.planes[-PLANES + 1 :], (slope, float(slope @ x - parts.sum()))]
        return True

    def _off(self, case: Case, x: np.ndarray) -> np.ndarray:
        """How far the nodes are off their laws of contact and of friction (n, 2)."""
        f, u = x[: self.n * self.d].reshape(self.n, self.d), self.rows @ x + self.start
        p, slip = f[:, 0], np.linalg.norm(u[:, 1:], axis=1)
        contact = np.where([touches is None for touches in case.touches], np.minimum(p, np.abs(u[:, 0])), 0.0)
        way = u[:, 1:] / np.where(slip > 0.0, slip, 1.0)[:, None]
        missing = np.linalg.norm(f[:, 1:] + self.mu * p[:, None] * way, axis=1) * np.minimum(slip, 1.0)
        return np.column_stack([contact, np.where([at == "none" for at in case.slip], 0.0, missing)])


def _point_of(rows: np.ndarray, low: np.ndarray, high: np.ndarray, bounds: np.ndarray) -> np.ndarray | None:
    """Return a point with low <= rows x <= high within bounds, or None where there is none."""
    below, above = np.isfinite(low), np.isfinite(high)
    A, b = np.concatenate([rows[above], -rows[below]]), np.concatenate([high[above], -low[below]])
    for method, presolve in (("highs-ds", True), ("highs-ds", False), ("highs-ipm", True)):
        options = {"presolve": presolve}
        found = linprog(np.zeros(rows.shape[1]), A, b, bounds=bounds, method=method, options=options)
        if found.status in (0, 2):
            return found.x if found.status == 0 else None
    raise ArithmeticError(found.message)


def _ways(angles: np.ndarray, d: int) -> np.ndarray:
    """Unit vectors along the road (k, d - 1)."""
    return np.column_stack([np.cos(angles), np.sin(angles)])[:, : d - 1]


def _inwards(arc: tuple[float, float], d: int) -> np.ndarray:
    """Normals (k, d - 1) of the sides of the sector between two angles."""
    return _ways(np.array([arc[0] + np.pi / 2, arc[1] - np.pi / 2]) if d == 3 else np.array(arc[:1]), d)
