"""The correction `direct`: factorise once, and solve the contact as a small dense problem.

Some unknowns are pinned, so that A_g, which is A on the others, has an inverse and a good one:

    u = A_g^-1 (b + contact forces) + Phi q,                                                             (1)

Phi (N d, p) being what the body does when a pin is moved by a unit, all else in equilibrium, and q the pins'
own displacements, which meet no resistance but Phi^T A Phi. A body that nothing holds is pinned at as many
unknowns as it has rigid modes: Phi are the modes, and their resistance is zero, exactly (the generalised
inverse and the null space of FETI methods; C. Farhat and F.-X. Roux, Int. J. Numer. Meth. Engng 32 (1991)).
So are bodies that soft springs hold, and hard parts of a soft body, whose little yielding would drown in what
the soft part gives (primal unknowns; C. Farhat et al., Int. J. Numer. Meth. Engng 50 (2001)).

With W and G the rows of A_g^-1 and Phi at nodes that may touch, these feel the stiffness S, leading block of

    [ W    G            ]-1
    [ G^T  -Phi^T A Phi ]   .                                                                            (2)

The contact forces are found there; columns of A_g^-1 spread them. Nodes join the small problem when they
touch or would penetrate, so that a step of a long run costs what its own contact asks for. The factorisation
and the columns serve all loads and steps.
"""

import numpy as np
from scipy.linalg import qr
from scipy.sparse import bsr_array, csc_array, diags_array

from model.node_loop.contact_sweep import FREE, SLIP, place_all_on_surface
from model.node_loop.node_loop import NodeLoop
from model.problem.rigid_modes import (
    SEEN,
    RigidModes,
    arrivals,
    determinate_unknowns,
    motions_of_each_body,
    parts,
)
from model.solvers.convergence_record import Record
from model.solvers.factorisation import factorised
from model.solvers.small_problem import SmallProblem, Whole

# Of the energy that a rigid motion would cost if every node moved alone: what is held by less is pinned. At
# 5e-7 a block on the road that a spring holds sideways lost all digits of its friction, at 3e-6 none.
WEAK = 1e-5
HARD = 1e4  # times the softest unknown; it costs as many digits as it has
SLIGHT = 1e-12  # of the load: sums of forces over all nodes are rounded to less
FIRST = 0.1  # of the tolerance is asked of the small problem at first; a drive by less moves nothing
IDLE = 8  # cycles without progress that are enough: each is exact but for rounding,
FALL = 0.5  # so that one which does not halve the residual is none
DRIVEN = 3  # cycles whose small problem finds a motion without end: the second may still stop it
NEAR = 1e-6  # of the largest gap: who is so near to the road, once the body has landed, may touch
NOBODY = np.zeros(0, dtype=np.int64)
MEMORY = 2**27  # bytes that whole columns of A^-1 may take
KEPT = 2**18  # pairs of candidates in the small problems that are kept for the next solve


class Condensation:
    """Static condensation of one matrix onto its touching candidates.

    Parameters
    ----------
    A : bsr_array (N d, N d)
        Symmetric, positive definite but for rigid motions.
    loop : NodeLoop
        The loop on the whole problem.
    rigid : RigidModes
        Of A and the loop's candidates.

    Attributes
    ----------
    batches : list of (m,) arrays
        Candidates whose columns of A_g^-1 have been computed, in the order in which they came.
    steps : (2,)
        Steps of Newton and changes along paths so far; the most in one small problem.
    """

    name = "direct"

    def __init__(self, A: bsr_array, loop: NodeLoop, rigid: RigidModes):
        self.loop, self.rigid, self._nothing = loop, rigid, np.zeros(0)
        self.steps = np.zeros(2, dtype=np.int64)
        N, d = loop.shape
        n = loop.nodes.size
        self._pin(A)
        self._springs: np.ndarray | None = None
        self._sides = 1 if loop.friction is None else d  # components that a contact force may have
        # whole columns spare a back-substitution a step; large problems keep the rows of the candidates only
        self._whole = 8 * N * d * n * d <= MEMORY
        self._row = loop.nodes if self._whole else np.arange(n)  # of each candidate in the columns, in nodes
        self.update_normals()
        self.recall([])

    def _pin(self, A: bsr_array) -> None:
        """Choose the pins, factorise A on the other unknowns, and find what the pins do."""
        loop, modes = self.loop, self.rigid.modes
        weak = self.rigid.weakly_held(A, WEAK)
        self.pins = np.concatenate([determinate_unknowns(weak), self._pins_of_hard_parts(A)])
        self.pins = np.unique(self.pins).astype(np.int64)
        matrix, p = csc_array(A), self.pins.size
        self.resistance = np.zeros((p, p))
        if p == 0:
            self.factor, self.shapes = factorised(matrix), np.zeros((modes.shape[0], 0))
            return
        kept = np.ones(modes.shape[0])
        kept[self.pins] = 0.0
        inside = diags_array(kept)
        self.factor = factorised(
            csc_array(inside @ matrix @ inside + diags_array(1.0 - kept) * loop.diagonal.max())
        )
        if p == modes.shape[1]:
            self.shapes = modes @ np.linalg.inv(modes[self.pins])
        else:
            couplings = matrix[:, self.pins].toarray()
            self.shapes = -self.factor.solve(kept[:, None] * couplings)
            self.shapes[self.pins] = np.eye(p)
        if p > modes.shape[1]:
            rigid = np.linalg.qr(modes[self.pins])[0]
            outside = np.eye(p) - rigid @ rigid.T
            resistance = outside @ (matrix @ self.shapes)[self.pins] @ outside
            self.resistance = 0.5 * (resistance + resistance.T)

    def _pins_of_hard_parts(self, A: bsr_array) -> np.ndarray:
        """Unknowns that hold every part of the body that is much harder than the softest, and may touch."""
        loop = self.loop
        N, d = loop.shape
        diagonal = np.einsum("iaa->ia", loop.diagonal)
        soft = np.min(diagonal, where=loop.loaded, initial=np.inf)
        hard = np.mean(diagonal, axis=1) > HARD * soft
        if hard.all() or not hard[loop.nodes].any():
            return NOBODY
        part = parts(A, hard)
        part[~np.isin(part, part[loop.nodes])] = -1
        motions = motions_of_each_body(self.rigid.coordinates, part, self.rigid.turning)
        motions[loop.uncoupled.ravel()] = 0.0
        return determinate_unknowns(motions)

    def update_normals(self) -> None:
        """Follow the loop's new normals."""
        loop = self.loop
        self._small: dict[bytes, SmallProblem] = {}  # by their candidates, the last one used last
        if self.pins.size == 0:
            self._seen, self._anchors = np.zeros((0, 0)), NOBODY
            self._motions = np.zeros((*loop.frame.shape[:2], 0))
            return
        sides, nodes = self._sides, self.loop.nodes
        shapes = self.shapes.reshape(*loop.shape, -1)[nodes]
        G = np.einsum("cab,cbp->cap", loop.frame[:, :sides], shapes).reshape(nodes.size * sides, -1)
        # a mode without resistance that no candidate sees has no place in (2), and stays where it is
        scale = np.abs(G).max() / (np.abs(self.resistance).max() or 1.0)
        turns = np.zeros((0, G.shape[1]))
        if self._springs is not None:
            turns = (self._springs @ shapes).reshape(-1, G.shape[1]) / self._springs.max()
        _, sizes, directions = np.linalg.svd(
            np.linalg.qr(np.concatenate([G, scale * self.resistance, turns]), mode="r")
        )
        self._seen = directions[sizes > SEEN * np.linalg.norm(shapes)].T
        self._motions = shapes @ self._seen  # (n, d, p) of the candidates
        order = qr((G @ self._seen).T, mode="r", pivoting=True)[1]
        self._anchors = np.unique(order[: self._seen.shape[1]] // sides)

    def recall(self, batches: list[np.ndarray]) -> None:
        """Forget all columns, and compute those of an earlier run again, to the last bit."""
        rows = self.loop.shape[0] if self._whole else self.loop.nodes.size
        self.batches: list[np.ndarray] = []
        self._columns = np.empty((rows * self.loop.shape[1], 2), order="F")
        self._place = np.full(self.loop.nodes.size, -1)  # of each candidate in the columns, in nodes
        self._small = {}
        for batch in batches:
            self._learn(batch)

    def back_substitute(self, r: np.ndarray) -> np.ndarray:
        """Solve A_g x = r for r (N, d), the pins at rest."""
        if self.pins.size:
            r = r.copy()
            r.reshape(-1)[self.pins] = 0.0
        return self.factor.solve(r.ravel()).reshape(self.loop.shape)

    def solve(self, u: np.ndarray, status: np.ndarray, record: Record) -> None:
        """Solve the problem that the loop holds, from u (N, d) and status (n,), both updated in place.

        Each cycle asks only for what is still missing, so that the next makes good what rounding spoilt, and
        more of the small problem: what little holds a body magnifies what that one leaves.
        A part of the way would be no cheaper than the whole.
        """
        loop, record.patience, record.fall, record.part = self.loop, IDLE, FALL, 0.0
        record.idle, record.soon, self._driven = 0, 0, False
        before, driven = record.cycles, 0
        while not record.finished(loop.residual(u, status)):
            driven += self._driven
            if driven == DRIVEN:
                record.give_up(
                    "the load moves the body on and on, and no node that it comes to stops it: as far as "
                    "springs ever softer let it go there is no equilibrium, though there may be one elsewhere"
                )
            apart = status == FREE
            loop.R[loop.nodes[apart]] -= loop.force[apart]
            loop.force[apart] = 0.0
            part = FIRST ** min(1 + record.cycles - before, 4)
            self.improve(u, status, loop.R, part * record.tolerance, loop.force, FIRST * record.tolerance)
            record.cycles += 1

    def improve(
        self,
        u: np.ndarray,
        status: np.ndarray,
        r: np.ndarray,
        tolerance: float,
        known: np.ndarray | None = None,
        slight: float = 0.0,
    ) -> None:
        """Bring u (N, d) and status (n,) to the solution, up to rounding.

        Parameters
        ----------
        u, status
            Updated in place; u need not be admissible.
        r : (N, d)
            What u misses of equilibrium, load - A u + known forces of the road; overwritten.
        tolerance : float
            Natural residual of the small problem.
        known : (n, d), optional
            Forces on the candidates that touch; default zero.
        slight : float
            Of the load: what may drive a rigid mode without moving it, if that is more than rounding.
        """
        self._take_springs()
        loop, contact, self._driven = self.loop, self.loop.contact, False
        known = np.zeros(loop.force.shape) if known is None else known
        selected = np.zeros(status.size, dtype=np.bool_)
        selected[self._anchors] = selected[self.rigid.bearing] = True
        if self._springs is not None:
            selected |= self._springs.any(axis=(1, 2))
        if self.rigid.count and not status.any():
            gaps = loop.gaps(u, status)
            selected |= gaps <= NEAR * max(gaps.max(), 0.0)
        free = self.back_substitute(r)
        power = self._seen.T @ (self.shapes.T @ r.ravel()) if self.pins.size else self._nothing
        gap = contact.gap + np.einsum("ca,ca->c", loop.frame[:, 0], u[loop.nodes])
        after = gap + np.einsum("ca,ca->c", loop.frame[:, 0], free[loop.nodes])
        touches = (status != FREE) | ((gap < 0.0) & (after < 0.0))
        selected |= touches
        tiny, size = 1e-14 * gap.max(initial=0.0), loop.load_size + float(np.linalg.norm(known))
        slight = max(tolerance, slight, SLIGHT) * size
        force, pins = known[:0], self._nothing
        whole = Whole(contact, u, free, power, gap, known, status)
        missed = NOBODY if touches.any() or self.pins.size else worst(after, selected, tiny)
        selected[missed] = True
        there, spring = np.zeros(known.shape), 0.0

        def reached(force: np.ndarray, pins: np.ndarray, moved: np.ndarray) -> tuple[np.ndarray, ...]:
            if self._springs is not None:
                force = force - np.einsum("cab,ceb,ce->ca", self._springs[active], loop.frame[active], moved)
            there = free[loop.nodes] + self._spread(active, force, self._row)
            if pins.size:
                there += (self.shapes @ (self._seen @ pins)).reshape(u.shape)[loop.nodes]
            return force, there, gap + np.einsum("ca,ca->c", loop.frame[:, 0], there)

        def meets(*point: np.ndarray) -> bool:
            return worst(reached(*point)[2], selected, tiny).size > 0

        while selected.any() and (missed.size or not force.size):
            active = np.flatnonzero(selected)
            small = self._small_problem(active)
            force, pins, moved = small.solve(
                whole, active, there, spring, loop.slip_rate, tolerance, slight, meets
            )
            self._driven, spring = small.driven, small.spring
            force, there, after = reached(force, pins, moved)
            missed = worst(after, selected, tiny)
            if not missed.size and self.rigid.count == self.pins.size:
                missed = self._next_on_the_way(active, force, power, after, slight)
            selected[missed] = True
        if not force.size and size == 0.0:  # nothing pushes: what increments would leave is rounding
            u[:] = 0.0
            loop.prescribe(loop.b, u)
        elif not force.size:
            u += free
        elif self._whole:
            u += free + self._spread(active, force, np.arange(len(u)))
        else:
            r[loop.nodes[active]] += force
            u += self.back_substitute(r)
        if pins.size:
            motion = (self.shapes @ (self._seen @ pins)).reshape(u.shape)
            rigid = self.pins.size == self.rigid.count
            u += loop.carry(motion, u) if rigid else motion
            if rigid and self._springs is None and status.any():
                u += self._back_to_road(u, status)
        place_all_on_surface(loop.contact, u, status)

    def _back_to_road(self, u: np.ndarray, status: np.ndarray) -> np.ndarray:
        """The rigid motion (N, d) that brings nodes that lie on the road there, as well as one can.

        A drive that is slight stays, and what would balance it is missing where the nodes go; put back one by
        one they would strain the body.
        """
        there, loop = u.copy(), self.loop
        place_all_on_surface(loop.contact, there, status)
        lies = status != FREE
        frame, nodes = loop.frame[lies], loop.nodes[lies]
        motions = frame @ self.rigid.at(nodes)
        motions[(status[lies] == SLIP) | (loop.friction is None), 1:] = 0.0
        way = np.einsum("cab,cb->ca", frame, (there - u)[nodes])
        return self.rigid.nearest(motions.reshape(way.size, -1), way.ravel())

    def _next_on_the_way(
        self, active: np.ndarray, force: np.ndarray, power: np.ndarray, gap: np.ndarray, slight: float
    ) -> np.ndarray:
        """Candidates (0 or more,) that a body comes to which forces (k, d) on the active ones do not hold."""
        drive = power + np.einsum("cap,ca->p", self._motions[active], force)
        speed = np.einsum("ca,cap,p->c", self.loop.frame[:, 0], self._motions, drive)
        speed[active] = 0.0
        if np.linalg.norm(drive) <= slight:
            return NOBODY
        time = arrivals(gap, speed, np.abs(speed).max())
        first = np.argsort(time)[: active.size]
        return first[time[first] < np.inf]

    def _small_problem(self, active: np.ndarray) -> SmallProblem:
        """The small problem of the given candidates (k,); solves that are alike pass through the same."""
        key = active.tobytes()
        small = self._small.pop(key, None) or self._set_up(active)
        while self._small and (1 + len(self._small)) * active.size**2 > KEPT:
            del self._small[next(iter(self._small))]
        self._small[key] = small
        return small

    def _set_up(self, active: np.ndarray) -> SmallProblem:
        """Set up the small problem of the given candidates (k,)."""
        loop, springs = self.loop, None
        frame = loop.frame[active, : self._sides]
        if self._springs is not None:
            springs = np.einsum("cab,cbe,cfe->caf", frame, self._springs[active], frame)
        W = self.flexibility(active, frame)
        G = np.einsum("cab,cbp->cap", frame, self._motions[active]).reshape(W.shape[0], -1)
        resistance = self._seen.T @ self.resistance @ self._seen
        return SmallProblem(W, G, resistance, springs, self._sides, loop.friction, self.steps)

    def flexibility(self, active: np.ndarray, frame: np.ndarray) -> np.ndarray:
        """Displacements (k s, k s) of k candidates under unit forces, pins at rest, in frames (k, s, d)."""
        new = active[self._place[active] < 0]
        if new.size:
            self._learn(new)
        k, d = active.size, self.loop.shape[1]
        rows, columns = (number[active, None] * d + np.arange(d) for number in (self._row, self._place))
        there = self._columns[np.ix_(rows.ravel(), columns.ravel())].reshape(k, d, k, d)
        W = np.einsum("jbf,iajf->iajb", frame, np.einsum("iae,iejf->iajf", frame, there))
        W = W.reshape(k * frame.shape[1], -1)
        return 0.5 * (W + W.T)

    def _spread(self, active: np.ndarray, force: np.ndarray, rows: np.ndarray) -> np.ndarray:
        """Displacements (r, d), in the rows (r,) of the columns, by forces (k, d) on active candidates."""
        d, known = self.loop.shape[1], sum(batch.size for batch in self.batches)
        everybody = np.zeros((known, d))
        everybody[self._place[active]] = force
        columns = self._columns[:, : known * d]
        if rows.size * d < len(columns):
            columns = columns[(rows[:, None] * d + np.arange(d)).ravel()]
        return (columns @ everybody.ravel()).reshape(-1, d)

    def _take_springs(self) -> None:
        """Follow the loop's springs."""
        if self._springs is not self.loop.springs:
            self._springs = self.loop.springs
            # components that a force may have, of the road or of springs
            self._sides = 1 if self.loop.friction is None and self._springs is None else self.loop.shape[1]
            self.update_normals()

    def _learn(self, new: np.ndarray) -> None:
        """Compute the columns of A_g^-1 of more candidates."""
        loop = self.loop
        N, d = loop.shape
        known = sum(batch.size for batch in self.batches)
        if (known + new.size) * d > self._columns.shape[1]:
            larger = np.empty((self._columns.shape[0], 2 * (known + new.size) * d), order="F")
            larger[:, : known * d] = self._columns[:, : known * d]
            self._columns = larger
        for begin in range(0, new.size, 16):
            chunk = new[begin : begin + 16]
            units = np.zeros((N * d, chunk.size * d), order="F")
            unknowns = (loop.nodes[chunk, None] * d + np.arange(d)).ravel()
            units[unknowns, np.arange(unknowns.size)] = 1.0
            units[self.pins] = 0.0
            answers = self.factor.solve(units)
            if not self._whole:
                answers = answers.reshape(N, d, -1)[loop.nodes].reshape(-1, chunk.size * d)
            at = (known + begin) * d
            self._columns[:, at : at + chunk.size * d] = answers
        self._place[new] = known + np.arange(new.size)
        self.batches.append(new)


def worst(gap: np.ndarray, selected: np.ndarray, tiny: float) -> np.ndarray:
    """Candidates (k,), not selected (n,), that are farthest below the road by their gaps (n,)."""
    below = np.flatnonzero((gap < -tiny) & ~selected)
    return below[np.argsort(gap[below])[: max(8, int(selected.sum()))]]
