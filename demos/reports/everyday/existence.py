"""Whether a body has an equilibrium on a plane road under Coulomb's law: branch and bound on conic programmes.

Forces f of the candidates, p along normals and tau along the road, and amplitudes q of the free motions R
decide everything: the forces balance the load in the free motions, and the nodes are displaced by
u = W f + R q + u0. A candidate is free (f = 0) or on the road (gap 0), and there it sticks (no slip s), or slips
and tau = -mu p s/|s|. One that is not decided may have a gap and a force at once, and any |tau| <= mu p; of a
slip between two directions the opposite of tau lies in the convex hull of an arc of radius mu p. At an
equilibrium the sum over p gap + tau.s = f.W f + f.u0 - load.q, which is convex in (f, q), is not above 0.

All this is relaxed by t, of the largest entry of each row, and the least t of a case is sought. If that is above
`ROOM`, by the dual solution, which any solver may have found, the case is ruled out; if all are, there is no
equilibrium. Else the case is divided at the node that is farthest from its law, until one obeys all laws, and
there may well be one. `ROOM` is far beyond the rounding of the rows: that rules out nothing.

A search is about nodes that may touch together near one place of the rigid body; all places are searched where
strain displaces no candidate by more than `GIVES` times what the load does by itself, balanced by inertia, or what
a force as large does at a candidate.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import clarabel
import numpy as np
from scipy.sparse import csc_array

from .judge import Posed, _frames, free_motions
from .rest import resting_places

GIVES = 10.0  # times the displacement by the load, by strain
ROOM = 1e-5  # of a row's largest entry
OBEYED = 1e-4  # of the load, and of the displacement by it: how well nodes obey their laws
FRICTION = 0.3  # weight of its law where a case is divided: with 1 twice as many cases
RIGID = 1e4  # displacements by the load: slips beyond which strain is rounding
UNSEEN = 1e-9  # motions of unit size that change no row
BEYOND = 10.0  # times the unknowns found: how far the bound holds
PROGRAMMES = 4000  # at most, for all places of a body: about a minute with 40 nodes
THIN = 1e-7  # an arc that is not divided any more
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
    condensed = Condensed.of(posed)
    places = resting_places(posed, GIVES * condensed.strain)
    if places is None:
        return None
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
    strain : float
        The largest displacement by the load that inertia balances, or by a force as large at a candidate.
    """

    W: np.ndarray
    R: np.ndarray
    start: np.ndarray
    load: np.ndarray
    nodes: np.ndarray
    frame: np.ndarray
    strain: float

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
        W = (at @ soft @ at.T * force).reshape(n, d, n, d)
        strain = max(float(np.abs(start).max()), float(np.abs(W).max()))
        start[:, 0] += posed.gap
        start[:, 1:] -= np.einsum("cta,ca->ct", frame[:, 1:], posed.reference)
        return cls(W, R, start, V @ (Z.T @ b) / force, posed.nodes, frame, strain)

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
        W = self.rows.reshape(n * d, -1)[:, : n * d]
        self.W = (W + W.T) / 2
        self.programmes = 0

    def run(self, programmes: int = PROGRAMMES) -> bool | None:
        """Tell whether there is an equilibrium; None if so many programmes do not tell."""
        cases, undecided = [Case((None,) * self.n, (None,) * self.n)], False
        while cases:
            case = cases.pop()
            x = self._solution(case)
            if x is None:
                continue
            off = self._off(case, x)
            if off.max() <= OBEYED:
                return True
            if self.programmes >= programmes:
                return None
            c, by_slip = (int(at) for at in np.unravel_index(np.argmax(off * [1.0, FRICTION]), off.shape))
            arc = case.slip[c] if by_slip else None
            if arc is not None and arc[1] - arc[0] < THIN:
                undecided = True
            else:
                cases += case.divided(c, bool(by_slip), self.d)
        return None if undecided else False

    def _solution(self, case: Case) -> np.ndarray | None:
        """Return the forces and amplitudes that need to be relaxed least, or None where a case is ruled out."""
        rows, right, relaxed, cones = self._programme(case)
        k = self.n * self.d
        force = np.repeat([touches is not False for touches in case.touches], self.d)
        _, seen, V = np.linalg.svd(rows[:, k:], full_matrices=False)
        V = V[seen > UNSEEN * seen[0]]
        A = np.hstack([rows[:, :k][:, force], rows[:, k:] @ V.T, -relaxed[:, None]])
        cost = np.append(np.zeros(A.shape[1] - 1), 1.0)
        settings = clarabel.DefaultSettings()
        settings.verbose, settings.max_threads, settings.equilibrate_max_scaling = False, 1, 100.0
        nothing = csc_array((cost.size, cost.size))
        found = clarabel.DefaultSolver(nothing, cost, csc_array(A), right, cones, settings).solve()
        self.programmes += 1
        y, z = np.array(found.x), np.array(found.z)
        if not np.isfinite(y).all() or not np.isfinite(z).all():
            raise ArithmeticError(str(found.status))
        unbalanced = np.abs(cost + A.T @ z)  # by this the dual solution z, which is in its cones, is off
        if -right @ z - BEYOND * unbalanced @ (np.abs(y) + 1.0) > ROOM:
            return None
        x = np.zeros(rows.shape[1])
        x[:k][force] = y[: force.sum()]
        x[k:] = V.T @ y[force.sum() : -1]
        return x

    def _programme(self, case: Case) -> tuple[np.ndarray, np.ndarray, np.ndarray, list]:
        """Return rows, right sides, what t adds to these, and cones of right + t relaxed - rows x."""
        d, mu, size = self.d, self.mu, self.rows.shape[-1]
        blocks, ends = [np.zeros((1, size))], [np.zeros(1)]  # t is not negative

        def add(rows: np.ndarray, low: Any, high: Any) -> None:
            end = np.column_stack([np.broadcast_to(end, len(rows)) for end in (low, high)])
            finite = np.isfinite(end)
            scale = np.maximum(np.abs(rows).max(axis=1), np.abs(np.where(finite, end, 0.0)).max(axis=1))
            for sign, some, side in zip((-1.0, 1.0), finite.T, end.T):
                blocks.append(sign * rows[some] / scale[some, None])
                ends.append(sign * side[some] / scale[some])

        add(self.balance, -self.load, -self.load)
        add(self.others[0], -self.others[1], np.inf)
        discs, unit = [], np.eye(size)
        for c, (touches, slip) in enumerate(zip(case.touches, case.slip)):
            force, gap, s = unit[c * d : c * d + d], self.start[c, 0], self.start[c, 1:]
            add(self.rows[c, :1], -gap, -gap if touches else np.inf)
            arc = slip if isinstance(slip, tuple) else None
            if slip == "none":
                add(self.rows[c, 1:], -s, -s)
            elif arc is not None:
                inwards = _inwards(arc, d)
                add(inwards @ self.rows[c, 1:], -inwards @ s, np.inf)
            if touches is False:
                continue
            add(force[:1], 0.0, np.inf)
            discs.append(np.insert(-force[1:], 0, -mu * force[0], axis=0))
            if arc is not None:
                middle = _ways(np.array([sum(arc) / 2]), d)
                chord = -middle @ force[1:] - mu * np.cos((arc[1] - arc[0]) / 2) * force[0]
                add(np.concatenate([chord, -inwards @ force[1:]]), 0.0, np.inf)
        sizes = [d] * len(discs)
        cones = [clarabel.NonnegativeConeT(sum(map(len, ends)))] + [clarabel.SecondOrderConeT(d)] * len(discs)
        blocks += discs
        ends += [np.zeros(d)] * len(discs)
        # |root f|^2 <= load.q - u0.f, as a cone: |(2 root f, a - 1)| <= a + 1
        kept = np.flatnonzero(np.repeat([touches is not False for touches in case.touches], d))
        spent = np.append(np.zeros(self.n * d), self.load)
        spent[kept] = -self.start.ravel()[kept]
        scale = max(1.0, float(np.abs(spent).max()))
        values, ways = np.linalg.eigh(self.W[np.ix_(kept, kept)])
        root = np.zeros((len(kept), size))
        root[:, kept] = np.sqrt(np.maximum(values, 0.0) / scale)[:, None] * ways.T
        blocks.append(-np.vstack([spent / scale, spent / scale, 2 * root]))
        ends.append(np.concatenate([[1.0, -1.0], np.zeros(len(kept))]))
        cones.append(clarabel.SecondOrderConeT(len(kept) + 2))
        free = sum(map(len, ends)) - sum(sizes) - len(kept) - 2
        relaxed = [np.ones(free), np.tile(np.eye(d)[0], len(discs)), [1.0, 1.0], np.zeros(len(kept))]
        return np.concatenate(blocks), np.concatenate(ends), np.concatenate(relaxed), cones

    def _off(self, case: Case, x: np.ndarray) -> np.ndarray:
        """How far the nodes are off their laws of contact and of friction (n, 2)."""
        f, u = x[: self.n * self.d].reshape(self.n, self.d), self.rows @ x + self.start
        p, slip = f[:, 0], np.linalg.norm(u[:, 1:], axis=1)
        contact = np.where([touches is None for touches in case.touches], np.minimum(p, np.abs(u[:, 0])), 0.0)
        way = u[:, 1:] / np.where(slip > 0.0, slip, 1.0)[:, None]
        missing = np.linalg.norm(f[:, 1:] + self.mu * p[:, None] * way, axis=1) * np.minimum(slip, 1.0)
        return np.column_stack([contact, np.where([at == "none" for at in case.slip], 0.0, missing)])


def _ways(angles: np.ndarray, d: int) -> np.ndarray:
    """Unit vectors along the road (k, d - 1)."""
    return np.column_stack([np.cos(angles), np.sin(angles)])[:, : d - 1]


def _inwards(arc: tuple[float, float], d: int) -> np.ndarray:
    """Normals (k, d - 1) of the sides of the sector between two angles."""
    return _ways(np.array([arc[0] + np.pi / 2, arc[1] - np.pi / 2]) if d == 3 else np.array(arc[:1]), d)
