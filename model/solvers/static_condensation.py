"""The correction `direct`: factorise once, and solve the contact as a small dense problem.

With W = A^-1 restricted to the nodes that touch, S = W^-1 is the stiffness they feel with all other nodes in
equilibrium. The loop and Newton steps on S find the contact forces; one back-substitution spreads them. Nodes
join the small problem when they touch or would penetrate, and leave it with the contact, so that a step of a
long run costs what its own contact asks for. The factorisation and the columns of W serve all loads and
steps.

A body held only by the contact has a singular A. It is then grounded by springs at a few candidates, and the
springs are taken out of the small problem again, exactly: the result is that of the body without them. So are
hard candidates in a soft body: what the soft part holds them by would drown the little by which they yield.
"""

import numpy as np
from numba import njit
from scipy.linalg.lapack import dpotrf, dpotri
from scipy.sparse import bsr_array, csc_array, diags_array
from scipy.sparse.linalg import SuperLU, splu

from model.node_loop.blocks import FUSED
from model.node_loop.contact_sweep import FREE, STICK, place_all_on_surface
from model.node_loop.node_loop import NodeLoop
from model.solvers.convergence_record import Record
from model.solvers.semismooth_newton import SmallProblem

HARD = 1e4  # times the softest unknown
IDLE = 25  # cycles without progress that are enough
NOBODY = np.zeros(0, dtype=np.int64)
MEMORY = 2**27  # bytes that whole columns of A^-1 may take


class Condensation:
    """Static condensation of one matrix onto its touching candidates.

    Parameters
    ----------
    A : bsr_array (N d, N d)
        Symmetric, positive definite but for rigid motions.
    loop : NodeLoop
        The loop on the whole problem.
    grounded : (k,)
        Numbers of candidates that can hold the body where A alone does not; none where it does. Some
        hard candidates of a body that is soft elsewhere are added.

    Attributes
    ----------
    batches : list of (m,) arrays
        Candidates whose columns of A^-1 have been computed, in the order in which they came.
    """

    name = "direct"

    def __init__(self, A: bsr_array, loop: NodeLoop, grounded: np.ndarray):
        self.loop = loop
        N, d = loop.shape
        n = loop.nodes.size
        self.springs = np.zeros((n, 1))
        matrix = csc_array(A)
        stiffness = np.einsum("caa->c", loop.block) / d
        soft = np.min(matrix.diagonal(), where=loop.loaded.ravel(), initial=np.inf)
        hard = np.flatnonzero(stiffness > HARD * soft)
        self.grounded = np.union1d(grounded, hard[:: 1 + hard.size // 100]).astype(np.int64)
        if self.grounded.size:
            self.springs[self.grounded, 0] = stiffness[self.grounded]
            springs = np.zeros((N, d))
            springs[loop.nodes] = self.springs
            matrix = csc_array(matrix + diags_array(springs.ravel()))
        self.factor = factorised(matrix)
        # whole columns spare a back-substitution a step; large problems keep the rows of the candidates only
        self._whole = 8 * N * d * n * d <= MEMORY
        self._row = loop.nodes if self._whole else np.arange(n)  # of each candidate in the columns, in nodes
        self.recall([])

    def recall(self, batches: list[np.ndarray]) -> None:
        """Forget all columns, and compute those of an earlier run again, to the last bit."""
        rows = self.loop.shape[0] if self._whole else self.loop.nodes.size
        self.batches: list[np.ndarray] = []
        self._columns = np.empty((rows * self.loop.shape[1], 2), order="F")
        self._place = np.full(self.loop.nodes.size, -1)  # of each candidate in the columns, in nodes
        self._active = NOBODY  # candidates of the small problem that is set up
        for batch in batches:
            self._learn(batch)

    def back_substitute(self, r: np.ndarray) -> np.ndarray:
        """Solve (A + springs) x = r for r (N, d)."""
        return self.factor.solve(r.ravel()).reshape(self.loop.shape)

    def solve(self, u: np.ndarray, status: np.ndarray, record: Record) -> None:
        """Solve the problem the loop is aimed at, from u (N, d) and status (n,), both updated in place.

        Each cycle asks only for what is still missing, so that the next makes good what rounding spoilt, and
        more of the small problem: what little holds a body magnifies what that one leaves.
        """
        loop, record.patience = self.loop, IDLE
        while not record.finished(loop.residual(u, status)):
            apart = status == FREE
            loop.R[loop.nodes[apart]] -= loop.force[apart]
            loop.force[apart] = 0.0
            self.improve(u, status, loop.R, 0.1 ** min(1 + record.cycles, 4) * record.tolerance, loop.force)
            record.cycles += 1

    def improve(
        self,
        u: np.ndarray,
        status: np.ndarray,
        r: np.ndarray,
        tolerance: float,
        known: np.ndarray | None = None,
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
        """
        loop, contact = self.loop, self.loop.contact
        known = np.zeros(loop.force.shape) if known is None else known
        free = self.back_substitute(r)
        gap, after = np.empty(status.size), np.empty(status.size)
        selected = np.zeros(status.size, dtype=np.bool_)
        selected[self.grounded] = True
        largest, lowest, count = gaps_without(contact, u, free, status, gap, after, selected)
        tiny = 1e-14 * largest
        solved = count == 0 and self.grounded.size == 0
        moved: np.ndarray | None = free
        while not solved or lowest < -tiny:
            if solved:
                below = np.flatnonzero(after < -tiny)
                selected[below[np.argsort(after[below])[: max(8, int(selected.sum()))]]] = True
            self._set_up(np.flatnonzero(selected))
            active = self._active
            force = self.small.solve(contact, active, u, free, gap, known, status, loop.slip_rate, tolerance)
            if self._whole:
                moved = free.copy()
                spread(self._columns, self._place, force, active, moved.reshape(-1))
                lowest = gaps_after(gap, contact, moved, active, after)
            else:
                moved = None
                lowest = gaps_with(
                    gap, contact, free, self._columns, self._row, self._place, force, active, after
                )
            solved = True
        if moved is None:
            r[loop.nodes[active]] += force
            moved = self.back_substitute(r)
        u += moved
        put_in_order(contact, u, status)

    def _set_up(self, active: np.ndarray) -> None:
        """Set up the small problem of the given candidates, unless it is."""
        if np.array_equal(active, self._active):
            return
        new = active[self._place[active] < 0]
        if new.size:
            self._learn(new)
        W = compliance(self._columns, self._row, self._place, active, self.loop.frame)
        factor, trouble = dpotrf(W, lower=1)
        S = np.linalg.inv(W) if trouble else dpotri(factor, lower=1)[0]
        self.small = SmallProblem(S, W, self.springs[active], self.loop.friction)
        self._active = active

    def _learn(self, new: np.ndarray) -> None:
        """Compute the columns of A^-1 of more candidates."""
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
            answers = self.factor.solve(units)
            if not self._whole:
                answers = answers.reshape(N, d, -1)[loop.nodes].reshape(-1, chunk.size * d)
            at = (known + begin) * d
            self._columns[:, at : at + chunk.size * d] = answers
        self._place[new] = known + np.arange(new.size)
        self.batches.append(new)

    def update_normals(self) -> None:
        """Follow the loop's new normals."""
        self._active = NOBODY


def factorised(A: csc_array) -> SuperLU:
    """Factorise a symmetric positive definite matrix, its pivots on the diagonal."""
    return splu(A, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})


@njit(cache=True, error_model="numpy")
def gaps_without(contact, u, free, status, gap, after, selected):
    """Write into `gap` and `after` the gaps (n,) at u (N, d), and after the free move from there.

    Mark in `selected` (n,) who touches already or is and stays below the road. Return the largest of
    `gap`, the lowest of `after`, and the number of candidates added.
    """
    largest, lowest, count = 0.0, 0.0, 0
    for c in range(gap.size):
        here, there = contact.gap[c], 0.0
        for a in range(u.shape[1]):
            here += contact.frame[c, 0, a] * u[contact.nodes[c], a]
            there += contact.frame[c, 0, a] * free[contact.nodes[c], a]
        gap[c] = here
        after[c] = here + there
        largest, lowest = max(largest, here), min(lowest, after[c])
        if status[c] != FREE or (here < 0.0 and after[c] < 0.0):
            selected[c] = True
            count += 1
    return largest, lowest, count


@njit(cache=True, error_model="numpy")
def gaps_after(gap, contact, moved, active, after):
    """Write into `after` the gaps (n,) after a move (N, d), 0 for active candidates; return the lowest."""
    for c in range(gap.size):
        after[c] = gap[c]
        for a in range(moved.shape[1]):
            after[c] += contact.frame[c, 0, a] * moved[contact.nodes[c], a]
    lowest = 0.0
    for j in range(active.size):
        after[active[j]] = 0.0
    for c in range(gap.size):
        lowest = min(lowest, after[c])
    return lowest


@njit(cache=True, error_model="numpy")
def gaps_with(gap, contact, free, columns, row, place, force, active, after):
    """Write into `after` the gaps (n,) after the free move (N, d) and that due to forces (k, d) on `active`.

    Those of the active candidates themselves are settled and count as 0. Return the lowest.
    """
    d = free.shape[1]
    lowest = 0.0
    for c in range(gap.size):
        s = gap[c]
        for a in range(d):
            move = free[contact.nodes[c], a]
            for j in range(active.size):
                for b in range(d):
                    move += columns[row[c] * d + a, place[active[j]] * d + b] * force[j, b]
            s += contact.frame[c, 0, a] * move
        after[c] = s
    for j in range(active.size):
        after[active[j]] = 0.0
    for c in range(gap.size):
        lowest = min(lowest, after[c])
    return lowest


@njit(cache=True, error_model="numpy")
def compliance(columns, row, place, active, frame):
    """Displacements of the active candidates under unit forces on each other, in their frames, (k d, k d)."""
    k, d = active.size, frame.shape[1]
    W = np.zeros((k * d, k * d))
    for i in range(k):
        for j in range(k):
            for a in range(d):
                for b in range(d):
                    s = 0.0
                    for e in range(d):
                        for f in range(d):
                            value = columns[row[active[i]] * d + e, place[active[j]] * d + f]
                            s += frame[active[i], a, e] * value * frame[active[j], b, f]
                    W[i * d + a, j * d + b] += 0.5 * s
                    W[j * d + b, i * d + a] += 0.5 * s
    return W


@njit(cache=True, error_model="numpy", fastmath=FUSED)
def spread(columns, place, force, active, u):
    """Add to u (N d,) the displacement due to forces (k, d) on the active candidates."""
    d = force.shape[1]
    for j in range(active.size):
        for b in range(d):
            column, size = columns[:, place[active[j]] * d + b], force[j, b]
            for i in range(u.size):
                u[i] += column[i] * size


@njit(cache=True, error_model="numpy")
def put_in_order(contact, u, status):
    """Place candidates that touch exactly on the road, and those that stick where they stick."""
    place_all_on_surface(contact, u, status)
    for c in range(status.size):
        if status[c] == STICK:
            for b in range(u.shape[1]):
                s = -contact.gap[c] * contact.frame[c, 0, b]
                for a in range(1, u.shape[1]):
                    s += contact.reference[c, a - 1] * contact.frame[c, a, b]
                u[contact.nodes[c], b] = s
