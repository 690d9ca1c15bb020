"""The correction `multigrid`.

The node loop decides, truncated multigrid removes the smooth error that relaxation cannot.

Each round: the loop sweeps the finest mesh and decides contact, stick and slip; conjugate gradients
preconditioned by one V-cycle then solve for the unknowns that are linear at present (free nodes whole, slip
nodes along the surface, their friction force held); nodes that would penetrate are put back on the road.
Coarse matrices are truncated where the finest mesh is held, and repaired only around nodes whose status
changed. With friction GMRES takes the place of conjugate gradients, and the cycles see that the friction of
slipping nodes follows their pressure: what is missing there is tested by L = T - w n^T, w the friction that
comes with a unit of pressure, on the finest mesh and, in P^T L A T P, on all below it. Where the residual
falls no further, as with much friction it may, the problem is condensed onto its candidates and solved as by
`direct`. Source: Graeser and Kornhuber, J. Comput. Math. 27 (2009), with the paper's loop as the non-linear
smoother.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
from numba import njit
from scipy.linalg.lapack import dgetrf, dgetrs
from scipy.sparse import bsr_array, csr_array, diags_array

from model.node_loop.blocks import (
    BlockMatrix,
    defect,
    diagonal_positions,
    generalised_inverses,
)
from model.node_loop.contact_sweep import place_all_on_surface
from model.node_loop.friction_tangent import friction_tangent
from model.node_loop.node_loop import NodeLoop, place_on_road, stop_slip_that_turned
from model.node_loop.status import Status
from model.one_rank import ONE_RANK
from model.problem.rigid_modes import BALANCE, RigidModes, arrivals, null_space
from model.solvers.convergence_record import NotConverged, Record
from model.solvers.galerkin_coarsening import Level, columns_of, hierarchy, interpolate, recompute
from model.solvers.krylov import conjugate_gradients, flexible_gmres
from model.solvers.projected_search import projected_search
from model.solvers.static_condensation import Condensation

# part of the defect that corrections leave while the contact set changes; 0.1 and 0.2 cost more
UNSTEADY = 0.3
# choice 2, gamma and alpha, of S. C. Eisenstat, H. F. Walker, SIAM J. Sci. Comput. 17 (1996)
FORCING = 0.9, 2.0
PATIENCE = 8  # rounds in which the residual need not fall; then the problem is condensed
FALL = 0.9  # of the residual is progress
KRYLOV = 30  # cycles in one correction at most
GUESSES = 30  # rounds on a coarser mesh at most
NESTED, EXACT = 1e-1, 1e-6  # natural residuals to which coarser meshes, and the coarsest, solve for a guess


class Cycle:
    """V-cycles on a hierarchy of levels whose finest unknowns are truncated where they are held.

    Parameters
    ----------
    levels : list of Level
        Finest first. What truncation changes is copied: what is held of the finest, and every coarser matrix.

    Attributes
    ----------
    visits : int
        Cycles on a coarser level for each on the next finer one: 1 for V-cycles, 2 for W-cycles.
    sweeps : int
        Before and after each correction from the coarser level.
    """

    symmetric, visits, sweeps = True, 1, 1

    def __init__(self, levels: list[Level]):
        finest = replace(levels[0], inverse=levels[0].inverse.copy(), held=None)
        finest.hold(held := np.flatnonzero(levels[0].held), levels[0].T[held])
        coarser = [
            replace(level, A=level.A._replace(data=level.A.data.copy()), inverse=level.inverse.copy())
            for level in levels[1:]
        ]
        self._take([finest, *coarser])
        self.solve_coarsest: Callable[[np.ndarray], np.ndarray] | None = None
        self.kernel = np.zeros((levels[-1].inverse.shape[0] * levels[-1].inverse.shape[1], 0))

    def _take(self, levels: Sequence[Any]) -> None:
        """Take these levels, and make room for what each cycle does on them."""
        self.levels = list(levels)
        self.corrections, self.defects, self.loads = (
            [np.zeros(level.shape) for level in levels] for _ in range(3)
        )

    def set_kernel(self, kernel: np.ndarray) -> None:
        """Tell which motions (n d, z) of the coarsest mesh nothing resists."""
        if kernel.shape != self.kernel.shape or np.any(kernel != self.kernel):
            self.kernel, self.solve_coarsest = kernel, None

    def truncate(self, nodes: np.ndarray, projectors: np.ndarray, tests: np.ndarray) -> None:
        """Hold nodes (k,) to the ranges of their projectors (k, d, d), and test them by tests (k, d, d).

        Only the rows of the coarse matrices that see these nodes are computed anew.
        """
        finest = self.levels[0]
        blocks = finest.A.data[finest.middle[nodes]]
        finest.inverse[nodes] = projected_inverses(blocks, projectors, tests)
        finest.hold(nodes, projectors, tests)
        self.symmetric = np.array_equal(finest.L[finest.held], finest.T[finest.held])
        self.renew(columns_of(finest.A, nodes, len(finest.inverse)))

    def renew(self, changed: np.ndarray) -> None:
        """Compute the coarser matrices anew where rows (k,) of the finest have changed."""
        self.solve_coarsest = None
        for fine, coarse in pairwise(self.levels):
            changed = columns_of(fine.P, changed, len(coarse.inverse))
            recompute(fine, coarse, changed)

    def __call__(self, r: np.ndarray, number: int = 0, left: np.ndarray | None = None) -> np.ndarray:
        """One cycle for A z = r from z = 0, on level `number`; its defect is written into `left`, if given.

        The result is overwritten by the next call.
        """
        level, z = self.levels[number], self.corrections[number]
        if number == len(self.levels) - 1:
            self._visit_coarsest(r, z)
            if left is not None:
                level.missing(r, z, left)
            return z
        rest, load = self.defects[number], self.loads[number + 1]
        if self.symmetric or number == 0:
            level.sweep_from_zero(r, z, rest)
            for _ in range(self.sweeps - 1):
                more, still = np.empty_like(r), np.empty_like(r)
                level.sweep_from_zero(rest, more, still)
                z += more
                rest[:] = still
        else:
            z[:] = 0.0
            for _ in range(self.sweeps):
                level.sweep_back(r, z)
            level.missing(r, z, rest)
        if number == 0:
            project(rest, level.held, level.T if self.symmetric else level.L)
        load[:] = 0.0
        interpolate(level.R, rest, load)
        self.levels[number + 1].ranks.add(load)
        interpolate(level.P, self._solve_coarse(load, number + 1), z)
        if number == 0:
            project(z, level.held, level.T)
        for _ in range(self.sweeps - 1):
            level.sweep_back(r, z)
        level.sweep_back(r, z, left)
        return z

    def _visit_coarsest(self, r: np.ndarray, z: np.ndarray) -> None:
        """Set z to what solves A z = r on the coarsest mesh."""
        if self.solve_coarsest is None:
            self.solve_coarsest = dense_solver(self.levels[-1], self.kernel, self.symmetric)
        z[:] = self.solve_coarsest(r.ravel()).reshape(r.shape)

    def _solve_coarse(self, r: np.ndarray, number: int) -> np.ndarray:
        """Visit a coarser level as often as it should be; each visit finds what the last has left."""
        z = self(r, number)
        if number == len(self.levels) - 1 or self.visits == 1:
            return z
        total, rest = z.copy(), np.empty_like(r)
        for _ in range(self.visits - 1):
            self.levels[number].missing(r, total, rest)
            total += self(rest, number)
        return total


@contextmanager
def supported(finest: Any, nodes: np.ndarray, supports: np.ndarray) -> Iterator[None]:
    """Add to the diagonal blocks of nodes (k,) the stiffness (k, d, d) of supports, for a while.

    The finest matrix belongs to others: on leaving it is what it was, to the last bit. `truncate` lets
    coarser ones see it.
    """
    at = finest.middle[nodes]
    kept = finest.A.data[at]
    finest.A.data[at] = kept + supports
    try:
        yield
    finally:
        finest.A.data[at] = kept


@njit(cache=True, error_model="numpy")
def project(x, held, projectors):
    """Leave of x (N, d), in place, at nodes that are `held` (N,) what the projectors (N, d, d) do."""
    d = x.shape[1]
    left = np.empty(d)
    for i in np.flatnonzero(held):
        for a in range(d):
            left[a] = 0.0
            for b in range(d):
                left[a] += projectors[i, a, b] * x[i, b]
        x[i] = left


def projected_inverses(blocks: np.ndarray, projectors: np.ndarray, tests: np.ndarray) -> np.ndarray:
    """Inverses (k, d, d) of symmetric blocks, tested, on the ranges of their projectors, zero elsewhere."""
    inside = tests @ blocks @ projectors
    inverses = np.empty_like(inside)
    generalised_inverses(inside, np.arange(len(inside)), inverses)
    return projectors @ inverses @ tests


def dense_solver(level: Level, kernel: np.ndarray, symmetric: bool) -> Callable[[np.ndarray], np.ndarray]:
    """Solve for (n d,) with a small mesh's matrix, as what is held leaves it, where it resists anything.

    Motions in its `kernel` (n d, z) would meet rounding: they get a resistance, which moves them some way.
    """
    A, (n, d) = level.A, level.inverse.shape[:2]
    full = np.zeros((n, d, n, d))
    rows = np.repeat(np.arange(n), np.diff(A.indptr).astype(np.int64))
    L, T = (np.where(level.held[:, None, None], held, np.eye(d)) for held in (level.L, level.T))
    full[rows, :, A.indices] = L[rows] @ A.data @ T[A.indices]
    matrix = full.reshape(n * d, n * d)
    unit = np.linalg.qr(kernel)[0]
    matrix += matrix.diagonal().max() * (unit @ unit.T)
    supported = np.flatnonzero(matrix.diagonal() > 0.0)
    inside = matrix[np.ix_(supported, supported)]
    factor, swaps, failed = dgetrf(inside)
    singular = failed or np.any(np.abs(factor.diagonal()) < 1e-11 * inside.diagonal())
    inverse = np.linalg.pinv(inside, rcond=1e-12, hermitian=symmetric) if singular else None

    def solve(r: np.ndarray) -> np.ndarray:
        z, known = np.zeros_like(r), r[supported]
        z[supported] = dgetrs(factor, swaps, known)[0] if inverse is None else inverse @ known
        return z

    return solve


class Multigrid:
    """Rounds of one sweep of the node loop and a truncated multigrid correction.

    Without friction each sweep and each correction lowers the energy. With friction the correction is a step
    of Newton's.

    Parameters
    ----------
    loop : NodeLoop
        The loop on this mesh.
    cycle : Cycle
        On this mesh and all coarser ones.
    rigid : RigidModes, optional
        Of this mesh and the loop's candidates, if some may be left free.
    coarse_modes : (n d, m), optional
        The same modes on the coarsest mesh.
    coarser : CoarserMesh, optional
        The same contact problem on the next coarser mesh, from which a first guess is taken (nested
        iteration).

    Attributes
    ----------
    status : (n,)
        As what the cycle holds each candidate; -1 where it must be told anew.
    """

    name = "multigrid"
    condenses = True  # where the corrections lead nowhere

    def __init__(
        self,
        loop: NodeLoop,
        cycle: Any,
        rigid: RigidModes | None = None,
        coarse_modes: np.ndarray | None = None,
        coarser: "CoarserMesh | None" = None,
    ):
        self.loop, self.cycle, self.rigid = loop, cycle, rigid
        self.coarse_modes, self.coarser = coarse_modes, coarser
        n, d = loop.force.shape
        self.status = np.zeros(n, dtype=np.int8)
        self.projectors = np.tile(np.eye(d), (n, 1, 1))
        self.rubs = np.zeros(0, dtype=np.int64)
        self.last, self.springs = self.status.copy(), loop.springs
        self.by_pressure, self.support = np.zeros((n, d)), np.zeros((n, d, d))
        self.zero = np.zeros(loop.shape)
        self.product, self.left, self.best = (np.zeros(loop.field_shape) for _ in range(3))
        self._defect = defect(d)
        self._condensed: Condensation | None = None
        self._handed_over = False

    @property
    def steps(self) -> Any:
        """Steps (1,) of Newton and of pivoting in the condensed problem so far."""
        return np.zeros(2, dtype=np.int64) if self._condensed is None else self._condensed.steps

    def solve(self, u: np.ndarray, status: np.ndarray, record: Record) -> None:
        """Solve the problem that the loop holds, from an admissible u (N, d) and status (n,), in place.

        Coarser meshes, where there are any, first correct u as far as they can (nested iteration).
        """
        loop, self.last[:] = self.loop, status
        if self.springs is not loop.springs:
            self.springs = loop.springs
            self.status[:] = -1
        if record.earlier and self._handed_over:  # only digits are wanted of what has been found
            self._direct().solve(u, status, record)
            return
        self._handed_over = False
        sprung = loop.springs is not None  # coarser loops have no springs
        if self.coarser is not None and not sprung and loop.residual(u, status) > record.tolerance:
            self.coarser.first_guess(loop, u, status, record)
        best, best_status, idle, steady, at_once = np.inf, status.copy(), 0, 0, False
        while True:
            if not at_once:
                loop.sweep(u, status)
            residual = loop.residual(u, status)
            if record.finished(residual):
                return
            if residual < FALL * best:
                best, idle = residual, 0
                self.best[:], best_status[:] = u, status
            elif idle < PATIENCE or not self.condenses:
                idle += 1
            else:  # the corrections lead nowhere
                u[:], status[:], self._handed_over = self.best, best_status, True
                self._direct().solve(u, status, record)
                return
            self._linearise(u, status)
            rubs = self.rubs
            with supported(self.cycle.levels[0], loop.nodes[rubs], self.support[rubs]):
                steady = 0 if self._truncate(status) else steady + 1
                at_once = self._correct(u, status, record, steady, idle)

    def take_time_steps(self) -> None:
        """Serve the steps of a run in time, whose loads are rough, and whose matrices hold much mass.

        Coarser meshes see little of such loads: on a ball in impact their first guess misses 20 times the
        forces at work, none misses 0.7 of them, and the increment of the last step 0.9 to 1.8. Two sweeps a
        visit take as long as one, in fewer cycles.
        """
        self.coarser, self.cycle.sweeps = None, 2

    def _direct(self) -> Condensation:
        """Factorise the matrix, once."""
        if self._condensed is None:
            loop, springs = self.loop, self.loop.springs
            loop.put_springs(None)
            A = bsr(loop.A).copy()
            loop.put_springs(springs)
            assert self.rigid is not None
            self._condensed = Condensation(A, loop, self.rigid)
        return self._condensed

    def _correct(self, u: np.ndarray, status: np.ndarray, record: Record, steady: int, idle: int) -> bool:
        """Solve for the unknowns that are linear at present, to a third while the contact set still changes.

        The last one may leave the tolerance itself, for the sweep that follows leaves a third of that; less
        where sweeps undo what corrections gain, `idle` times by now, as with rubber they may. Return whether
        the next correction comes at once: slip would have turned round, and was stopped, or a node has come
        to the road, from which a sweep would lift it again where what bends the body is not yet gone.
        """
        loop, ranks, r = self.loop, self.loop.ranks, self._missing()
        self._project(r)
        kernel = self._free_modes()
        if kernel.shape[1]:
            drive = kernel.T @ r.ravel()
            motion = (kernel @ drive).reshape(r.shape)
            driven = np.linalg.norm(drive) > BALANCE * loop.scale
            if driven and self._follow_to_next_node(motion, u, status):
                return True
            r -= motion
        # without friction the problem is linear now
        newton = 0.0 if loop.friction is None else forcing(record.history)
        part = newton if steady else UNSTEADY
        wanted = max(part * np.sqrt(ranks.sum(np.vdot(r, r))), record.tolerance * loop.scale)
        if steady or idle > PATIENCE:
            wanted *= UNSTEADY ** min(idle, PATIENCE)
        missing = r.copy()
        if loop.friction is not None and ranks.any(bool(np.any(status == Status.SLIP))):
            x, cycles = flexible_gmres(self._minus, self.cycle, r, wanted, KRYLOV, ranks)
        else:
            x, cycles = conjugate_gradients(self._cycled, r, wanted, KRYLOV, ranks)
        record.cycles += cycles
        return self._move(x, missing, r, u, status)

    def _missing(self) -> np.ndarray:
        """Return what is missing from equilibrium, as a field (N, d)."""
        return self.loop.R

    def _move(
        self, x: np.ndarray, missing: np.ndarray, left: np.ndarray, u: np.ndarray, status: np.ndarray
    ) -> bool:
        """Correct u (N, d) by x, which leaves of what was missing what is `left`; see `_correct`."""
        loop = self.loop
        if loop.friction is None:
            # the difference is A x where nothing is held
            projected_search(loop.A, missing, x, missing - left, loop.contact, u, status)
            return False
        u += x
        turned, before = stop_slip_that_turned(loop, u, status), np.count_nonzero(status)
        place_on_road(loop, u, status)
        return turned or bool(np.count_nonzero(status) > before)

    def _follow_to_next_node(self, motion: np.ndarray, u: np.ndarray, status: np.ndarray) -> bool:
        """Move u (N, d) along a rigid motion (N, d) until the next node arrives at the road, if one does."""
        loop = self.loop
        gap, speed = loop.gaps(u, status), np.einsum("ca,ca->c", loop.frame[:, 0], motion[loop.nodes])
        times = arrivals(gap, np.where(status == Status.FREE, speed, 0.0), np.abs(motion).max())
        first = times.min()
        if first == np.inf:
            return False
        u += first * motion
        status[times == first] = Status.SLIP if loop.friction is None else Status.STICK
        place_all_on_surface(loop.contact, u, status)
        return True

    def _free_modes(self) -> np.ndarray:
        """Orthonormal columns (N d, z) of the rigid modes that what is held now leaves free."""
        if self.rigid is None or self.rigid.count == 0:
            return np.zeros((0, 0))
        modes, m = self.rigid.modes, self.rigid.count
        nodes, rubs, held = self.loop.nodes, self.rubs, np.flatnonzero(self.status)
        at = self.rigid.at(nodes[held])
        rub = self.support[rubs] @ self.rigid.at(nodes[rubs]) / self.loop.diagonal.max()
        stopped = [(at - self.projectors[held] @ at).reshape(-1, m), rub.reshape(-1, m)]
        if self.springs is not None:
            stopped.append((self.springs @ self.rigid.at(nodes)).reshape(-1, m) / self.springs.max())
        free = null_space(np.linalg.qr(np.concatenate(stopped), mode="r"), np.abs(modes).max())
        self.cycle.set_kernel(self.coarse_modes @ free)
        return modes @ free

    def update_normals(self) -> None:
        """Follow the loop's new normals: what is held must be held anew."""
        self.status[self.status != Status.FREE] = -1
        if self._condensed is not None:
            self._condensed.update_normals()
        if self.coarser is not None:
            self.coarser.update_normals(self.loop)

    def _linearise(self, u: np.ndarray, status: np.ndarray) -> None:
        """Find how friction follows pressure and slip at u (N, d)."""
        loop = self.loop
        if loop.friction is not None:
            before, followed, law = self.rubs, self.by_pressure.copy(), loop.friction.address
            forces, derivatives = (loop.R, loop.force), (self.by_pressure, self.support)
            friction_tangent(loop.contact, u, *forces, status, law, loop.slip_rate, *derivatives)
            self.rubs = np.flatnonzero(self.support.any(axis=(1, 2)))
            self.status[before] = self.status[self.rubs] = -1
            self.status[np.any(self.by_pressure != followed, axis=1)] = -1

    def _truncate(self, status: np.ndarray) -> bool:
        """Hold the nodes as `status` says; True if that changed anything."""
        loop, changed = self.loop, np.flatnonzero(status != self.status)
        anew, different = loop.ranks.sum(np.array([changed.size, np.count_nonzero(self.last != status)]))
        self.last[:] = status
        if anew:
            self.projectors[changed] = free_directions(loop, changed, status[changed])
            follow = self.by_pressure[changed, :, None] * loop.frame[changed, 0, None, :]
            tests = self.projectors[changed] @ (np.eye(follow.shape[1]) - follow)
            self._hold(loop.nodes[changed], self.projectors[changed], tests)
            self.status[changed] = status[changed]
        return bool(different)

    def _hold(self, nodes: np.ndarray, projectors: np.ndarray, tests: np.ndarray) -> None:
        """Let the cycle hold nodes (k,), as `Cycle.truncate` does."""
        self.cycle.truncate(nodes, projectors, tests)

    def _project(self, r: np.ndarray) -> None:
        """Zero the components of r (N, d) in which nodes are held or prescribed."""
        finest = self.cycle.levels[0]
        project(r, finest.held, finest.T)
        r.flat[self.loop.prescribed] = 0.0

    def _cycled(self, r: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return what a cycle makes of r (N, d), and what that leaves of r."""
        z = self.cycle(r, left=self.left)
        self._project(self.left)
        return z, self.left

    def _minus(self, v: np.ndarray) -> np.ndarray:
        """Return -A v, (N, d), where nothing is held, the friction of slipping nodes following pressure.

        That makes A unsymmetric.
        """
        loop, finest = self.loop, self.cycle.levels[0]
        self._defect(loop.A, self.zero, v, self.product[: len(self.zero)])
        project(self.product, finest.held, finest.L)
        self.product.flat[loop.prescribed] = 0.0
        return self.product


def forcing(history: Sequence[float]) -> float:
    """Part of the defect that a step of Newton's may leave: the less, the more the step before has done.

    Where friction turns fast, at the onset of sliding, steps halve the residual however exact they are. The
    first leaves the square of the residual, as Newton's method would.
    """
    factor, power = FORCING
    part = factor * (history[-1] / history[-2]) ** power if len(history) > 1 else history[-1]
    return min(UNSTEADY, part)


def free_directions(loop: NodeLoop, numbers: np.ndarray, status: np.ndarray) -> np.ndarray:
    """Projectors (k, d, d) onto the directions in which candidates of the given status are free to move."""
    loaded = loop.loaded[loop.nodes[numbers]].astype(float)
    T = loaded[:, :, None] * np.eye(loop.shape[1])
    normal = loaded * loop.frame[numbers, 0]
    length = np.linalg.norm(normal, axis=1)
    normal[length > 1e-12] /= length[length > 1e-12, None]
    slips = status == Status.SLIP
    T[slips] -= normal[slips, :, None] * normal[slips, None, :]
    T[status == Status.STICK] = 0.0
    return T


class CoarserMesh:
    """The contact problem on the next coarser mesh.

    Where it takes its load and gaps from, and how its answer comes back.

    Parameters
    ----------
    fine : NodeLoop
        The loop on the finer mesh.
    levels : list of Level
        The finer mesh and all coarser ones.
    weights : list of csr_array
        Scalar prolongations from the coarser mesh and the ones below.
    rigid : RigidModes
        Of the finer mesh, to see which rigid motions the contact must hold.
    """

    loop: NodeLoop
    correction: Any

    def __init__(self, fine: NodeLoop, levels: list[Level], weights: Sequence[csr_array], rigid: RigidModes):
        self._meet(fine, levels[0], weights[0])
        self.loop = loop = NodeLoop(levels[1].A, self.nodes, fine.frame[self.copies, 0], fine.friction)
        kept, coarse = copies_of(weights[0])
        rigid = rigid.of_coarser_mesh(kept[np.argsort(coarse)], self.nodes)
        if len(weights) == 1:
            self.correction = Condensation(with_unit_diagonal(bsr(loop.A)), loop, rigid)
        else:
            coarser = CoarserMesh(loop, levels[1:], weights[1:], rigid)
            modes = inject(rigid.modes, weights[1:])
            self.correction = Multigrid(loop, Cycle(levels[1:]), rigid, modes, coarser)

    def _meet(self, fine: NodeLoop, level: Any, weights: csr_array, ranks: Any = ONE_RANK) -> None:
        """Find the candidates (k,) that the coarser mesh keeps, and its own (k,); ranks share its nodes."""
        self.level, self.ranks, self.weights = level, ranks, weights[fine.nodes]
        self.copies, self.nodes = copies_of(self.weights)
        candidate = np.zeros(weights.shape[1])
        candidate[self.nodes] = 1.0
        ranks.update(candidate)
        # candidates whose parents are candidates
        self.between = np.abs(self.weights @ candidate - 1.0) < 1e-9

    def update_normals(self, fine: NodeLoop) -> None:
        """Follow the new normals of the finer mesh."""
        self.loop.update_normals(fine.frame[self.copies, 0])
        self.correction.update_normals()

    def first_guess(self, fine: NodeLoop, u: np.ndarray, status: np.ndarray, record: Record) -> None:
        """Correct u (N, d) and status (n,) of the fine mesh by the coarser solution.

        The residual at u must be the last that the fine loop has computed.
        """
        level, copies, r = self.level, self.copies, fine.R
        r[fine.nodes] -= fine.force
        b = np.zeros((self.weights.shape[1], r.shape[1]))
        interpolate(level.R, r, b)
        self.ranks.add(b)
        way = fine.sticking_place(copies) - u[fine.nodes[copies]]
        given = fine.gaps(u, status)[copies], way, fine.contact.state[copies], status[copies]
        e, gaps, found = self._solve(b, given, fine.slip_rate, record)
        interpolate(level.P, e, u)
        fine.prescribe(fine.b, u)
        marks = np.zeros((len(e), 2))
        marks[self.nodes] = np.column_stack([gaps, found == Status.STICK])
        self.ranks.update(marks)
        arrived, stuck = (self.weights @ marks).T
        gap = fine.contact.gap + np.einsum("ca,ca->c", fine.frame[:, 0], u[fine.nodes])
        lift = np.where(self.between, arrived - gap, 0.0)
        u[fine.nodes] += lift[:, None] * fine.frame[:, 0]
        sticks = np.where(stuck > 1.0 - 1e-9, Status.STICK, Status.SLIP)
        status[:] = np.where(self.between & (arrived == 0.0), sticks, Status.FREE)
        place_on_road(fine, u, status)
        fine.ranks.update(u)

    def _solve(
        self, b: np.ndarray, given: Sequence[np.ndarray], slip_rate: float, record: Record
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return displacement (N, d), gaps and status (k,) of the coarser mesh.

        For a load b (N, d) and what is `given` of its candidates: gap, stick position, what the friction law
        is told, and status; see `NodeLoop.set_load`.
        """
        loop, e = self.loop, np.zeros(b.shape)
        loop.slip_rate = slip_rate
        loop.set_load(b, *given[:3])
        status = loop.start(e, given[3])
        # the coarsest answer is exact: it must have found the nodes that hold the body
        wanted = max(NESTED, record.tolerance) if isinstance(self.correction, Multigrid) else EXACT
        with suppress(NotConverged):  # a guess is a guess
            self.correction.solve(e, status, Record(wanted, GUESSES, record.sweeps, False))
        return e, loop.gaps(e, status), status


def with_unit_diagonal(A: bsr_array) -> bsr_array:
    """Return a coarse matrix (n d, n d), with a unit on its diagonal where truncation has left nothing."""
    empty = np.where(A.diagonal() == 0.0, 1.0, 0.0)
    return bsr_array(A + diags_array(empty), blocksize=A.blocksize)


def geometric(loop: NodeLoop, prolongations: Sequence[csr_array], rigid: RigidModes) -> Multigrid:
    """Multigrid on nested meshes, from scalar prolongations, finest first."""
    finest = Level(loop.A, loop.inverse, diagonal_positions(loop.A))
    prescribed = np.flatnonzero(loop.uncoupled.any(axis=1))
    finest.hold(prescribed, np.eye(loop.shape[1]) * loop.loaded[prescribed, :, None])
    levels = hierarchy(finest, prolongations)
    coarser = CoarserMesh(loop, levels, prolongations, rigid)
    return Multigrid(loop, Cycle(levels), rigid, inject(rigid.modes, prolongations), coarser)


def copies_of(weights: csr_array) -> tuple[np.ndarray, np.ndarray]:
    """Return the rows (k,) of a prolongation that keep a node of the coarser mesh, and these nodes (k,)."""
    copies = np.flatnonzero(np.diff(weights.indptr) == 1)
    return copies, weights[copies].indices.astype(np.int64)


def inject(modes: np.ndarray, prolongations: Sequence[csr_array]) -> np.ndarray:
    """Values of modes (N d, m) at the nodes of the coarsest mesh, all of which finer meshes keep."""
    N, (rows, m) = prolongations[0].shape[0], modes.shape
    values = modes.reshape(N, rows // N, m)
    for weights in prolongations:
        kept, nodes = copies_of(weights)
        coarse = np.zeros((weights.shape[1], *values.shape[1:]))
        coarse[nodes] = values[kept]
        values = coarse
    return values.reshape(values.shape[0] * values.shape[1], m)


def bsr(A: BlockMatrix) -> bsr_array:
    """Hand a matrix back to scipy; the values are shared."""
    return bsr_array((A.data, A.indices.astype(np.int32), A.indptr.astype(np.int32)))
