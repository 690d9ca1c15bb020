"""The correction `direct`: factorise once, and solve the contact as a small dense problem.

With W = A^-1 restricted to the nodes that touch, S = W^-1 is the stiffness they feel with all other nodes in
equilibrium. The loop and Newton steps on S find the contact forces; one back-substitution spreads them. Nodes join
the small problem when they touch or would penetrate, and leave it with the contact, so that a step of a long run
costs what its own contact asks for; the factorisation and the columns of W serve all loads and steps.

A body held only by the contact has a singular A. It is then grounded by springs at a few candidates, and the
springs are taken out of the small problem again, exactly: the result is that of the body without them.
"""

import numpy as np
from numba import njit
from scipy.sparse import bsr_array, csc_array, diags_array
from scipy.sparse.linalg import splu

from .blocks import defect
from .contact_loop import place_all_on_surface
from .loop import NodeLoop
from .record import Record
from .small_problem import SmallProblem


class Condensation:
    """Static condensation of one matrix onto its touching candidates.

    Parameters
    ----------
    A : bsr_array (N d, N d)
        Symmetric, positive definite but for rigid motions.
    loop : NodeLoop
        The loop on the whole problem.
    grounded : (k,)
        Numbers of candidates that can hold the body where A alone does not; none where it does.

    Attributes
    ----------
    known : (m,)
        Candidates whose columns of A^-1 have been computed, in the order in which they came.
    columns : (n d, m d)
        Those columns, at all candidates.
    """

    name = "direct"

    def __init__(self, A: bsr_array, loop: NodeLoop, grounded: np.ndarray):
        self.loop, self.grounded = loop, np.asarray(grounded, dtype=np.int64)
        N, d = loop.shape
        n = loop.nodes.size
        self.springs = np.zeros((n, 1))
        matrix = csc_array(A)
        if grounded.size:
            self.springs[grounded] = np.mean(np.einsum("caa->ca", loop.block[grounded]))
            springs = np.zeros((N, d))
            springs[loop.nodes] = self.springs
            matrix = csc_array(matrix + diags_array(springs.ravel()))
        self.factor = splu(
            matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
        )
        self._defect = defect(d)
        self.recall(np.zeros(0, dtype=np.int64), np.zeros((n * d, 0)))

    def recall(self, known: np.ndarray, columns: np.ndarray) -> None:
        """Take over the columns (n d, m d) of the `known` candidates (m,) from an earlier run."""
        self.known, self.columns = known, columns
        self._place = np.full(self.loop.nodes.size, -1)  # of each candidate in `known`
        self._place[known] = np.arange(known.size)
        self._active = np.zeros(0, dtype=np.int64)  # candidates of the small problem that is set up

    def back_substitute(self, r: np.ndarray) -> np.ndarray:
        """Solve (A + springs) x = r for r (N, d)."""
        return self.factor.solve(r.ravel()).reshape(self.loop.shape)

    def solve(self, u: np.ndarray, status: np.ndarray, record: Record, nested: bool = False) -> None:
        """Solve the problem the loop is aimed at, from u (N, d) and status (n,), both updated in place."""
        loop = self.loop
        r = np.empty(loop.shape)
        while not record.finished(loop.residual(u, status)):
            self._defect(loop.A, loop.b, u, r)
            self.improve(u, status, r, 0.1 * record.tolerance)
            record.cycles += 1

    def improve(self, u: np.ndarray, status: np.ndarray, r: np.ndarray, tolerance: float) -> None:
        """Bring u (N, d) and status (n,) to the solution, up to rounding.

        Parameters
        ----------
        u, status
            Updated in place; u need not be admissible.
        r : (N, d)
            Defect of u, load - A u; overwritten.
        tolerance : float
            Natural residual of the small problem.
        """
        loop = self.loop
        free = self.back_substitute(r)
        gap = np.empty(status.size)
        after = np.empty(status.size)
        no_force = np.zeros((0, loop.shape[1]))
        gaps(loop.contact, u, gap)
        gaps_with(gap, loop.contact, free, self.columns, no_force, self._active[:0], self._place, after)
        tiny = 1e-14 * gap.max(initial=0.0)
        active = np.union1d(np.flatnonzero(status), self.grounded) if status.any() else self.grounded
        while True:
            below = np.setdiff1d(np.flatnonzero(after < -tiny), active) if after.min() < -tiny else active[:0]
            if below.size:
                active = np.union1d(active, below[np.argsort(after[below])][: max(8, active.size)])
            elif active.size == 0 or active is self._active:
                break
            self._set_up(active)
            active = self._active
            force = self._solve_small(u, free, gap, status, tolerance)
            gaps_with(gap, loop.contact, free, self.columns, force, active, self._place, after)
            after[active] = 0.0
        if active.size:
            r[loop.nodes[active]] += force
            free = self.back_substitute(r)
        u += free
        place_all_on_surface(loop.contact, u, status)
        loop.hold_sticking(u, status)

    def _solve_small(self, u, free, gap, status, tolerance):
        """Set the status of the active nodes; return the forces (k, d) of road and springs on them."""
        loop, active = self.loop, self._active
        frame = loop.frame[active]
        target = np.einsum("cab,cb->ca", frame, free[loop.nodes[active]])
        before = np.einsum("cab,cb->ca", frame[:, 1:], u[loop.nodes[active]])
        decided = status[active]
        move, force = self.small.solve(
            (self._stiffness @ target.ravel()).reshape(target.shape),
            gap[active],
            loop.contact.reference[active] - before,
            loop.contact.state[active],
            decided,
            loop.slip_rate,
            tolerance,
        )
        status[active] = decided
        return np.einsum("cab,ca->cb", frame, force + self.springs[active] * move)

    def _set_up(self, active: np.ndarray) -> None:
        """Set up the small problem of the given candidates, unless it is."""
        if np.array_equal(active, self._active):
            return
        self._learn(active[self._place[active] < 0])
        loop = self.loop
        d, k = loop.shape[1], active.size
        unknowns = (active[:, None] * d + np.arange(d)).ravel()
        places = (self._place[active, None] * d + np.arange(d)).ravel()
        W = self.columns[unknowns[:, None], places]
        S = np.linalg.inv(0.5 * (W + W.T)).reshape(k, d, k, d)
        S = np.einsum("iab,ibjc->iajc", loop.frame[active], S)
        S = np.einsum("iajc,jec->iaje", S, loop.frame[active]).reshape(k * d, k * d)
        self._stiffness = 0.5 * (S + S.T)
        S = self._stiffness - np.diag(np.repeat(self.springs[active, 0], d))
        self.small = SmallProblem(S.reshape(k, d, k, d), loop.friction)
        self._active = active

    def _learn(self, new: np.ndarray) -> None:
        """Compute the columns of A^-1 of more candidates."""
        if new.size == 0:
            return
        loop = self.loop
        N, d = loop.shape
        answers = [self.columns]
        for chunk in np.array_split(new, -(-new.size // 32)):
            units = np.zeros((N * d, chunk.size * d), order="F")
            unknowns = (loop.nodes[chunk, None] * d + np.arange(d)).ravel()
            units[unknowns, np.arange(unknowns.size)] = 1.0
            columns = self.factor.solve(units).reshape(N, d, -1)[loop.nodes]
            answers.append(columns.reshape(loop.nodes.size * d, -1))
        self.columns = np.hstack(answers)
        self._place[new] = self.known.size + np.arange(new.size)
        self.known = np.concatenate([self.known, new])

    def turn(self) -> None:
        """Follow the loop's new normals."""
        self._active = self._active[:0]


@njit(cache=True, error_model="numpy")
def gaps(contact, u, gap):
    """Write the gaps (n,) at displacement u (N, d) into `gap`."""
    for c in range(gap.size):
        s = contact.gap[c]
        for a in range(u.shape[1]):
            s += contact.frame[c, 0, a] * u[contact.nodes[c], a]
        gap[c] = s


@njit(cache=True, error_model="numpy")
def gaps_with(gap, contact, free, columns, force, active, place, after):
    """Write into `after` the gaps (n,) after the free move (N, d) and that due to forces (k, d) on `active`."""
    d = free.shape[1]
    for c in range(gap.size):
        s = gap[c]
        for a in range(d):
            move = free[contact.nodes[c], a]
            for j in range(active.size):
                for b in range(d):
                    move += columns[c * d + a, place[active[j]] * d + b] * force[j, b]
            s += contact.frame[c, 0, a] * move
        after[c] = s
