"""The correction `direct`: factorise once, condense onto the nodes that touch, and run the same node loop on that small dense problem.

With W = A^-1 restricted to the nodes that may touch, S = W^-1 is the stiffness they feel with all other nodes in equilibrium.
The loop and Newton steps on S find the contact forces; one back-substitution spreads them. Nodes join the small problem only when
they would penetrate, and the factorisation and the columns of W serve all loads, steps and contact sets of a run.

A body held only by the contact has a singular A. It is then grounded by springs at a few candidates, and the springs are taken out of
the small problem again, exactly: the result is that of the body without them.
"""

import numpy as np
from scipy.sparse import bsr_array, csc_array, diags_array
from scipy.sparse.linalg import splu

from .blocks import BlockMatrix, defect
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
    """

    name = "direct"

    def __init__(self, A: bsr_array, loop: NodeLoop, grounded: np.ndarray):
        self.loop = loop
        N, d = loop.shape
        self.springs = np.zeros((loop.nodes.size, 1))
        matrix = csc_array(A)
        if grounded.size:
            self.springs[grounded] = np.mean(np.einsum("caa->ca", loop.block[grounded]))
            springs = np.zeros((N, d))
            springs[loop.nodes] = self.springs
            matrix = csc_array(matrix + diags_array(springs.ravel()))
        self.factor = splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
        self.members = np.zeros(0, dtype=np.int64)
        self.columns = np.zeros((loop.nodes.size * d, 0))
        self._defect = defect(d)
        self._join(grounded)

    def back_substitute(self, r: np.ndarray) -> np.ndarray:
        """Solve (A + springs) x = r for r (N, d)."""
        return self.factor.solve(r.ravel()).reshape(self.loop.shape)

    def solve(self, u: np.ndarray, status: np.ndarray, record: Record) -> None:
        """Solve the problem the loop is aimed at, from an admissible u (N, d) and status (n,), both updated in place."""
        loop = self.loop
        r = np.empty(loop.shape)
        while not record.finished(loop.residual(u, status)):
            self._defect(loop.A, loop.b, u, r)
            u += self._step(u, status, r, record)
            place_all_on_surface(loop.contact, u, status)
            loop.hold_sticking(u, status)
            record.cycles += 1

    def _step(self, u: np.ndarray, status: np.ndarray, r: np.ndarray, record: Record) -> np.ndarray:
        """Displacement from u to the solution, for the defect r of u; the small problem grows until nothing outside it penetrates."""
        loop = self.loop
        free = self.back_substitute(r)
        gap = loop.gaps(u, status)
        tiny = 1e-14 * gap.max(initial=0.0)
        self._join(np.flatnonzero(status))
        forces = np.zeros((loop.nodes.size, loop.shape[1]))
        while True:
            if self.members.size:
                self._solve_small(u, free, gap, status, forces, record)
            spread = (self.columns @ forces[self.members].ravel()).reshape(forces.shape)
            after = gap + np.einsum("ca,ca->c", loop.frame[:, 0], free[loop.nodes] + spread)
            after[self.members] = 0.0
            below = np.flatnonzero(after < -tiny)
            if below.size == 0:
                break
            self._join(below[np.argsort(after[below])][: max(8, self.members.size)])
        if not status.any() and not self.springs.any():
            return free
        r[loop.nodes] += forces
        return self.back_substitute(r)

    def _solve_small(self, u, free, gap, status, forces, record):
        """Set the status (n,) of the members and the forces (n, d) of road and springs on them, with everything else in equilibrium."""
        loop, members = self.loop, self.members
        target = free[loop.nodes[members]]
        rhs = (self.stiffness @ target.ravel()).reshape(target.shape)
        way = loop.sticking_place(members) - u[loop.nodes[members]]
        self.small.loop.slip_rate = loop.slip_rate
        self.small.loop.aim(rhs, gap[members], way, loop.contact.state[members])
        move, force, status[members] = self.small.solve(status[members], 0.1 * record.tolerance)
        forces[members] = force + self.springs[members] * move

    def _join(self, numbers: np.ndarray) -> None:
        """Let candidates join the small problem: their columns of A^-1 at all candidates, and the stiffness of the larger set."""
        new = np.setdiff1d(numbers, self.members)
        if new.size == 0:
            return
        loop = self.loop
        N, d = loop.shape
        for chunk in np.array_split(new, -(-new.size // 32)):
            units = np.zeros((N * d, chunk.size * d))
            unknowns = (loop.nodes[chunk, None] * d + np.arange(d)).ravel()
            units[unknowns, np.arange(unknowns.size)] = 1.0
            answers = self.factor.solve(units).reshape(N, d, -1)[loop.nodes]
            self.columns = np.hstack([self.columns, answers.reshape(loop.nodes.size * d, -1)])
        self.members = np.concatenate([self.members, new])
        self.turn()

    def turn(self) -> None:
        """Set up the small problem for the present members and normals."""
        loop, members = self.loop, self.members
        d, k = loop.shape[1], members.size
        W = self.columns.reshape(loop.nodes.size, d, k * d)[members].reshape(k * d, k * d)
        S = np.linalg.inv(0.5 * (W + W.T))
        self.stiffness = 0.5 * (S + S.T)
        S = self.stiffness - np.diag(np.repeat(self.springs[members, 0], d))
        blocks = np.ascontiguousarray(S.reshape(k, d, k, d).transpose(0, 2, 1, 3)).reshape(k * k, d, d)
        A = BlockMatrix(
            np.arange(0, k * k + 1, k, dtype=np.uint64), np.tile(np.arange(k, dtype=np.uint32), k), blocks
        )
        self.small = SmallProblem(A, loop.frame[members, 0], loop.friction)
