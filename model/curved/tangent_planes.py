"""Planes that follow the nodes along a road that is not flat, until every node that touches lies on the road.

In each iteration the contact problem is solved with a plane at each node, and the planes are then laid anew
where the nodes have come to be. They touch the road, so that the distance left falls with the square of
the last move; the iterations end when every node that touches lies on the road itself, its force along the
road's normal there.

The force on a node turns as the node moves along the road, which its plane does not know. Where the road
is hollow the node therefore goes too far, and back, and so on for ever in a corner. So the road is looked
at from a little below each node that touches,

    x = P(x - f / k),                                                                                  (1)

P being the projection on the road, f the force: seen from there a hollow is less curved, by just what the
turning force moves the node back, and the deepest point of a corner is nearest to a whole wedge of nodes,
with all the normals between those of its two slopes. In a hollow any k will do; the node is looked at from as
far below as its force would move it, and at least from as far as it has moved, so that a corner which it has
crossed is seen as one. `springs` that resist as the road does make the iteration the semismooth Newton
method for (1). On a hill the same would do harm, so (1) counts only where two looks, at the node and from
below it, find points no farther apart than the looks are, as projections on convex sets do (J.-J. Moreau,
Bull. Soc. Math. France 93 (1965) 273), and where the look from below turns the normal less. Friction turns
with the normal, so that springs turn a normal as they turn the whole force. What is left of creeping
and overshooting where there are no springs Anderson's extrapolation removes.

In motion a node goes a way within a step, and its force, if it were along the normal at the end of it, would
do work on hills and in hollows, though the road is at rest. So it is along the mean normal, corrected so that

    n . (x1 - x0) = g1 - g0                                                                            (2)

to the last digit (the discrete gradient of O. Gonzalez, J. Nonlinear Sci. 6 (1996) 449, of the distance g).
"""

from typing import Any

import numpy as np

from model.curved.anderson_acceleration import Anderson
from model.node_loop.contact_sweep import frames
from model.node_loop.status import Status
from model.one_rank import ONE_RANK
from model.tolerances import ON_ROAD

# Turns of the normals below which iterations are combined: the worst of twelve scenes on round and wavy roads
# takes 19 iterations, 18 with 0.5, 25 with 0.01.
SMOOTH = 0.1
FAR = 1e6  # times what counts as on the road: rounding then turns a secant by 1e-6 at most
DEEP = 1e6  # times what counts as on the road: rounding then turns what is seen from there by 1e-9 at most
WIDE = 1e-4  # of the depth: how far apart the road is looked at to see it bend
STIFF = 1e2  # times its own stiffness: what a corner that holds a node resists,
SHARP = 0.5  # of the radius seen from above: a hill no longer than that is a corner, and not smooth
SHALLOW = 10.0  # so that a node is looked at from this many times as deep as it gives way there, or deeper


class RoadPlanes:
    """The planes of n candidates.

    Parameters
    ----------
    road : Road
        Its `closest(points)` returns gap, normal and closest point.
    at : (n, d)
        Where the nodes are at first.
    sticking : (n, d) or None
        Where nodes would stick: at the point of the road nearest to it. None where there is no friction.
    softness : (n,)
        How far a node moves by a unit of force, about.
    size : float
        Of the body.
    since : (gap (n,), normal (n, d), position (n, d)), optional
        Of the nodes as a step of time began: forces shall do work by (2). Default: along the road's normals.
    ranks : OneRank or geometry.exchange.Exchange
        Who else has candidates.

    Attributes
    ----------
    normal, foot : (n, d)
        Normals of the planes, and a point of each: the road's nearest, in the end.
    anchor : (n, d)
        Points of the road where nodes stick.
    gap : (n,)
        Distances to the road at the last look; 0 at nodes that touch once all is settled.
    springs : (n, d, d)
        Stiffness by which the road resists as it turns the pressures, once `bend` has found it.
    hills : bool
        It is negative on hills, not left out there.
    unsteady : float
        The most that a normal has turned its node's pressure at the last look.
    distances : list of float
        At every look, how far nodes that touch were from the road, or others below it.
    """

    def __init__(
        self,
        road: Any,
        at: np.ndarray,
        sticking: np.ndarray | None,
        softness: np.ndarray,
        size: float,
        since: tuple[np.ndarray, np.ndarray, np.ndarray] | None = None,
        ranks: Any = ONE_RANK,
    ):
        self.ranks = ranks
        self.road, self.softness, self.near, self.since = road, softness.copy(), ON_ROAD * size, since
        self._stiffest = STIFF / softness
        self.gap, self.normal, self.foot = road.closest(at)
        lies = np.abs(self.gap) <= 0.01 * self.near  # by rounding, which would press where nothing does
        self.gap[lies], self.foot[lies] = 0.0, at[lies]
        self.anchor, self._anchor_normal = self.foot, self.normal
        if sticking is not None:
            self.anchor = road.closest(sticking)[2]
            self._anchor_normal = road.closest(self.anchor)[1]
        self.distances: list[float] = []
        self.unsteady = np.inf
        self._at, self._moved = at, np.zeros(len(at))
        self._turn, self._status, self._anderson = np.zeros(at.shape), np.zeros(0), Anderson(SMOOTH, ranks)
        self._lean = np.zeros(at.shape)  # of the planes off the road's own normals
        self.springs, self.hills = np.zeros((*at.shape, at.shape[1])), False

    def bend(self, pressure: np.ndarray, hills: bool = False) -> None:
        """Find how the road resists pressures (n,) as it turns them with a node: C = - p grad n, in hollows.

        The road is looked at from below. In a corner, where it bends without limit, C is some times what the
        node itself resists. On hills, looked at from above, it is negative, and left out unless asked for.
        """
        self.springs[:], self.hills = 0.0, hills
        pressed = np.flatnonzero(pressure)
        if pressed.size:
            self.springs[pressed] = self._resists(pressed, pressure, -1.0)
        if pressed.size and hills:
            self.springs[pressed] -= self._resists(pressed, pressure, 1.0)

    def _resists(self, pressed: np.ndarray, pressure: np.ndarray, side: float) -> np.ndarray:
        """|C| (k, d, d) at nodes (k,) that press, as seen from one side: -1 from below, 1 from above."""
        p, normal, foot = pressure[pressed], self.normal[pressed], self.foot[pressed]
        depth, tangent = self._from_below(pressure)[pressed], frames(normal)[:, 1:]
        place, h = foot + side * depth[:, None] * normal, np.maximum(WIDE * depth, self.near)
        turn = np.empty((pressed.size, tangent.shape[1], tangent.shape[1]))
        for k in range(tangent.shape[1]):
            aside = h[:, None] * tangent[:, k]
            (_, ahead, one), (_, behind, other) = (self.road.closest(place + x) for x in (aside, -aside))
            apart = np.maximum(_length(one - foot), _length(other - foot))
            nearer = apart <= 1.01 * h + self.near
            turns = side * np.einsum("cka,ca->ck", tangent, ahead - behind)
            turn[:, :, k] = turns * (nearer / (2 * h))[:, None]
        sizes, axes = np.linalg.eigh(0.5 * (turn + turn.swapaxes(1, 2)))
        seen = np.maximum(sizes, 0.0) * depth[:, None]
        if side > 0.0:
            seen = np.where(seen < SHARP, seen, 0.0)
        stiff = seen / np.maximum(1.0 - seen, 1.0 / FAR) * (p / depth)[:, None]
        stiff = np.minimum(stiff, self._stiffest[pressed, None])
        along = np.einsum("cik,cia->cka", axes, tangent)
        return np.asarray(np.einsum("cka,ck,ckb->cab", along, stiff, along))

    def gaps(self, points: np.ndarray) -> np.ndarray:
        """Distances (n,) of points (n, d) to the planes."""
        return np.einsum("ca,ca->c", self.normal, points - self.foot)

    def follow(
        self,
        at: np.ndarray,
        status: np.ndarray,
        pressure: np.ndarray,
        steady: float,
        turned: tuple[np.ndarray, np.ndarray] | None = None,
        tried: np.ndarray | None = None,
    ) -> bool:
        """Lay the planes where the nodes are now.

        Parameters
        ----------
        at : (n, d)
            Positions that the contact problem has found.
        status, pressure : (n,)
            What the nodes do, and their pressure forces.
        steady : float
            Force by which a normal may turn its node's pressure; negative where planes shall follow anyway.
        turned : (force (n, d), force (n, d)), optional
            Where the problem had `springs`: forces of the road, and with what the springs pull, which is how
            the road turns them.
        tried : (n, d), optional
            Positions of a solution that only a part of the way was gone to: it may have met a corner.

        Returns
        -------
        bool
            True, and the planes stay, if the nodes were on the road and the normals steady.
        """
        in_contact = np.flatnonzero(status != Status.FREE)
        tried = at if tried is None else tried
        self._moved, self._at = _length(tried - self._at), at
        last = self.normal - self._lean
        if turned is not None:
            last = _turned(last, *turned)
        below = np.where((status == Status.STICK)[:, None], self.anchor, tried)
        self.gap, normal, foot = self._closest(at, status, below, self._from_below(pressure)[:, None] * last)
        if self.since is not None:
            self._lean[in_contact] = (
                _working(in_contact, *self.since, normal, foot, self.near) - normal[in_contact]
            )
            normal[in_contact] += self._lean[in_contact]
        before, self._turn = self._turn, normal - self.normal
        self.softness = np.maximum(self.softness * _rescaled(before, self._turn), SHALLOW / self._stiffest)
        above = np.delete(self.gap, in_contact)
        off = max(np.abs(self.gap[in_contact]).max(initial=0.0), -above.min(initial=0.0))
        self.distances.append(self.ranks.max(off))
        self.unsteady = self.ranks.max(float((np.abs(self._turn).max(axis=1) * pressure).max(initial=0.0)))
        if self.unsteady <= steady and self.distances[-1] <= self.near:
            self.gap[in_contact] = 0.0
            self.gap = np.maximum(self.gap, 0.0)
            return True
        if self.ranks.any(not np.array_equal(status, self._status)):
            self._anderson.forget()
        self._status = status.copy()
        places = np.stack([normal[in_contact], foot[in_contact]])
        if turned is None:
            normal[in_contact], foot[in_contact] = self._anderson.combine(self._turn[in_contact], places)
        self.normal, self.foot = normal / np.linalg.norm(normal, axis=1, keepdims=True), foot
        return False

    def _from_below(self, pressure: np.ndarray) -> np.ndarray:
        """How far below (n,) nodes with pressures (n,) the road is looked at from."""
        return np.maximum(np.maximum(self.softness * pressure, self._moved), DEEP * self.near)

    def _closest(
        self, at: np.ndarray, status: np.ndarray, tried: np.ndarray, down: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return gap (n,), and normal and nearest point (n, d) of the road.

        Nodes that stick are at their anchors. Touching nodes are seen from `down` (n, d) below where they
        have `tried` to go (n, d) if the road is hollow and that turns the normal less.
        """
        n, sticks, c = len(at), status == Status.STICK, np.flatnonzero(status != Status.FREE)
        both = self.road.closest(np.concatenate([at, (tried - down)[c]]))
        gap, normal, foot = (values[:n] for values in both)
        below, foot_below = both[1][n:], both[2][n:]
        normal[sticks], foot[sticks] = self._anchor_normal[sticks], self.anchor[sticks]
        depth = _length(down[c])
        last = down[c] / depth[:, None]
        turn = _length(last - normal[c])
        hollow = (
            _length(foot_below - foot[c]) <= 1.01 * (depth * turn + _length(tried[c] - foot[c])) + self.near
        )
        less = hollow & (_length(below - last) <= turn)
        normal[c[less]], foot[c[less]] = below[less], foot_below[less]
        return gap, normal, foot


def _length(x: np.ndarray) -> np.ndarray:
    """Length (k,) of vectors (k, d)."""
    return np.asarray(np.linalg.norm(x, axis=1))


def softness(loop: Any) -> np.ndarray:
    """How far each candidate of a loop moves by a unit of force with its neighbours held, (n,)."""
    return 1.0 / np.einsum("caa->ca", loop.diagonal[loop.nodes]).mean(axis=1)


def at_anchors(loop: Any, status: np.ndarray) -> np.ndarray:
    """Statuses (n,) for the planes: nodes prescribed in part, if they stick, are not at their anchors."""
    return np.where(loop.given.any(axis=1), np.minimum(status, Status.SLIP), status)


def _working(
    in_contact: np.ndarray,
    gap: np.ndarray,
    before: np.ndarray,
    was: np.ndarray,
    normal: np.ndarray,
    foot: np.ndarray,
    near: float,
) -> np.ndarray:
    """Return the unit normals (k, d) of (2) for the nodes that touch (k,).

    From gaps (n,), normals and positions (n, d) at the beginning of a step to normals and feet at its end.
    """
    mean, way = (normal + before)[in_contact] / 2, (foot - was)[in_contact]
    missing = -gap[in_contact] - np.einsum("ca,ca->c", mean, way)
    square = np.einsum("ca,ca->c", way, way)
    far = square > (FAR * near) ** 2
    mean[far] += (missing[far] / square[far])[:, None] * way[far]
    return mean / np.linalg.norm(mean, axis=1, keepdims=True)


def _turned(v: np.ndarray, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Return vectors v (n, d), turned as the directions of `start` (n, d) turn to those of `end` (n, d)."""
    size = _length(start) * _length(end)
    some = size > 0.0
    a, b = (x[some] / _length(x[some])[:, None] for x in (start, end))
    turned, between, tiny = v.copy(), a + b, np.finfo(float).tiny
    along = np.einsum("ca,ca->c", between, v[some]) / np.maximum(np.einsum("ca,ca->c", between, a), tiny)
    turned[some] += 2.0 * np.einsum("ca,ca->c", a, v[some])[:, None] * b - along[:, None] * between
    return turned


def _rescaled(before: np.ndarray, turn: np.ndarray) -> np.ndarray:
    """Return factors (n,) on the softness that would have made the last turn (n, d) of each the only one."""
    square = np.einsum("ca,ca->c", before, before)
    ratio = np.einsum("ca,ca->c", turn, before) / np.where(square > 0.0, square, 1.0)
    return np.clip(1.0 - ratio, 0.5, 2.0)
