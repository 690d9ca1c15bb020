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
from scipy.sparse.linalg import LinearOperator, gcrotmk

from model.node_loop.blocks import (
    FUSED,
    BlockMatrix,
    backward_sweep,
    backward_sweep_with_defect,
    defect,
    diagonal_positions,
    generalised_inverses,
    sweep_from_zero,
)
from model.node_loop.contact_sweep import place_all_on_surface
from model.node_loop.friction_tangent import friction_tangent
from model.node_loop.node_loop import NodeLoop, place_on_road, stop_slip_that_turned
from model.node_loop.status import Status
from model.problem.rigid_modes import BALANCE, SEEN, RigidModes, null_space
from model.solvers.convergence_record import NotConverged, Record
from model.solvers.galerkin_coarsening import Level, coarsen, columns_of, interpolate, prolongation, recompute
from model.solvers.projected_search import projected_search
from model.solvers.static_condensation import Condensation

UNSTEADY = (
    0.3  # part of the defect that corrections leave while the contact set changes; 0.1 and 0.2 cost more
)
FORCING = (
    0.9,
    2.0,
)  # choice 2, gamma and alpha, of S. C. Eisenstat, H. F. Walker, SIAM J. Sci. Comput. 17 (1996)
PATIENCE = 8  # rounds in which the residual need not fall; then the problem is condensed
FALL = 0.9  # of the residual is progress
KRYLOV = 30  # cycles in one correction at most
GUESSES = 30  # rounds on a coarser mesh at most
NESTED = 1e-1  # natural residual to which coarser meshes solve for a first guess


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

    def __init__(self, levels: list[Level]):
        self.visits = self.sweeps = 1
        finest = replace(levels[0], inverse=levels[0].inverse.copy(), held=None)
        self.held, self.symmetric = np.flatnonzero(levels[0].held), True
        finest.hold(self.held, levels[0].T[self.held])
        coarser = [
            replace(level, A=level.A._replace(data=level.A.data.copy()), inverse=level.inverse.copy())
            for level in levels[1:]
        ]
        self.levels = [finest, *coarser]
        shapes = [level.inverse.shape[:2] for level in levels]
        self.corrections = [np.zeros(shape) for shape in shapes]
        self.defects = [np.zeros(shape) for shape in shapes]
        self.loads = [np.zeros(shape) for shape in shapes]
        self.solve_coarsest: Callable[[np.ndarray], np.ndarray] | None = None
        self.kernel = np.zeros((levels[-1].inverse.shape[0] * levels[-1].inverse.shape[1], 0))

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
        self.held = np.flatnonzero(finest.held)
        self.symmetric = np.array_equal(finest.L[self.held], finest.T[self.held])
        self.solve_coarsest = None
        changed = columns_of(finest.A, nodes, finest.inverse.shape[0])
        for fine, coarse in pairwise(self.levels):
            changed = columns_of(fine.P, changed, coarse.inverse.shape[0])
            recompute(fine, coarse, changed)

    def __call__(self, r: np.ndarray, number: int = 0, left: np.ndarray | None = None) -> np.ndarray:
        """One cycle for A z = r from z = 0, on level `number`; its defect is written into `left`, if given.

        The result is overwritten by the next call.
        """
        level, z = self.levels[number], self.corrections[number]
        if number == len(self.levels) - 1:
            if self.solve_coarsest is None:
                self.solve_coarsest = dense_solver(level, self.kernel, self.symmetric)
            z[:] = self.solve_coarsest(r.ravel()).reshape(r.shape)
            if left is not None:
                defect(r.shape[1])(level.A, r, z, left)
            return z
        rest, coarse_r, size = self.defects[number], self.loads[number + 1], r.shape[1]
        if self.symmetric or number == 0:
            sweep_from_zero(size)(level.A, level.middle, level.inverse, r, z, rest)
            for _ in range(self.sweeps - 1):
                more, still = np.empty_like(r), np.empty_like(r)
                sweep_from_zero(size)(level.A, level.middle, level.inverse, rest, more, still)
                z += more
                rest[:] = still
        else:
            z[:] = 0.0
            for _ in range(self.sweeps):
                backward_sweep(size)(level.A, level.inverse, r, z)
            defect(size)(level.A, r, z, rest)
        held = self.held if number == 0 else self.held[:0]
        project(rest, held, level.L)
        coarse_r[:] = 0.0
        interpolate(level.R, rest, coarse_r)
        interpolate(level.P, self._solve_coarse(coarse_r, number + 1), z)
        project(z, held, level.T)
        for _ in range(self.sweeps - (left is not None)):
            backward_sweep(size)(level.A, level.inverse, r, z)
        if left is not None:
            backward_sweep_with_defect(size)(level.A, level.middle, level.inverse, r, z, left)
        return z

    def _solve_coarse(self, r: np.ndarray, number: int) -> np.ndarray:
        """Visit a coarser level as often as it should be; each visit finds what the last has left."""
        z = self(r, number)
        if number == len(self.levels) - 1 or self.visits == 1:
            return z
        total, rest = z.copy(), np.empty_like(r)
        for _ in range(self.visits - 1):
            defect(r.shape[1])(self.levels[number].A, r, total, rest)
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
def project(x, nodes, projectors):
    """Leave of x (N, d), in place, at nodes (k,) what the projectors (N, d, d) do."""
    d = x.shape[1]
    left = np.empty(d)
    for i in nodes:
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


@njit(cache=True, error_model="numpy", fastmath=FUSED)
def step_along(alpha, direction, product, x, r):
    """Do x += alpha direction, r += alpha product, with product = -A direction; return the norm of r."""
    s = 0.0
    for i in range(x.shape[0]):
        for a in range(x.shape[1]):
            x[i, a] += alpha * direction[i, a]
            r[i, a] += alpha * product[i, a]
            s += r[i, a] * r[i, a]
    return np.sqrt(s)


@njit(cache=True, error_model="numpy", fastmath=FUSED)
def turn_direction(beta, z, r, left, direction, product):
    """Do direction = z + beta direction, and the same with `product`, -A direction, to which A z = r - left.

    Return direction . A direction.
    """
    s = 0.0
    for i in range(z.shape[0]):
        for a in range(z.shape[1]):
            direction[i, a] = z[i, a] + beta * direction[i, a]
            product[i, a] = left[i, a] - r[i, a] + beta * product[i, a]
            s -= direction[i, a] * product[i, a]
    return s


class Multigrid:
    """Rounds of one sweep of the node loop and a truncated multigrid correction.

    Without friction each sweep and each correction lowers the energy. With friction the correction is a step
    of Newton's.

    Parameters
    ----------
    loop : NodeLoop
        The loop on this mesh.
    levels : list of Level
        This mesh and all coarser ones.
    rigid : RigidModes
        Of this mesh and the loop's candidates.
    coarse_modes : (n d, m)
        The same modes on the coarsest mesh.
    coarser : CoarserMesh, optional
        The same contact problem on the next coarser mesh, from which a first guess is taken (nested
        iteration).
    """

    name = "multigrid"

    def __init__(
        self,
        loop: NodeLoop,
        levels: list[Level],
        rigid: RigidModes,
        coarse_modes: np.ndarray,
        coarser: "CoarserMesh | None" = None,
    ):
        self.loop, self.rigid, self.coarse_modes, self.coarser = loop, rigid, coarse_modes, coarser
        d = loop.shape[1]
        self.cycle = Cycle(levels)
        self.status = np.zeros(loop.nodes.size, dtype=np.int8)
        self.projectors = np.tile(np.eye(d), (loop.nodes.size, 1, 1))
        self.held = self.rubs = np.zeros(0, dtype=np.int64)
        self.last, self.springs = self.status.copy(), loop.springs
        self.by_pressure, self.support = np.zeros((loop.nodes.size, d)), np.zeros((loop.nodes.size, d, d))
        self.zero, self.x, self.direction, self.product, self.before, self.left = (
            np.zeros(loop.shape) for _ in range(6)
        )
        self.best = np.zeros(loop.shape)
        self._defect = defect(d)
        self._condensed: Condensation | None = None
        self._handed_over = False

    @property
    def steps(self) -> Any:
        """Steps (1,) of Newton and of pivoting in the condensed problem so far."""
        return np.zeros(1, dtype=np.int64) if self._condensed is None else self._condensed.steps

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
            elif idle < PATIENCE:
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
            self._condensed = Condensation(A, loop, self.rigid)
        return self._condensed

    def _correct(self, u: np.ndarray, status: np.ndarray, record: Record, steady: int, idle: int) -> bool:
        """Solve for the unknowns that are linear at present, to a third while the contact set still changes.

        The last one may leave the tolerance itself, for the sweep that follows leaves a third of that; less
        where sweeps undo what corrections gain, `idle` times by now, as with rubber they may. Return whether
        the next correction comes at once: slip would have turned round, and was stopped, or a node has come
        to the road, from which a sweep would lift it again where what bends the body is not yet gone.
        """
        loop, r, x = self.loop, self.loop.R, self.x
        scale = loop.load_size + float(np.linalg.norm(loop.force))
        self._project(r)
        kernel = self._free_modes()
        if kernel.shape[1]:
            drive = kernel.T @ r.ravel()
            motion = (kernel @ drive).reshape(r.shape)
            driven = np.linalg.norm(drive) > BALANCE * scale
            if driven and self._follow_to_next_node(motion, u, status):
                return True
            r -= motion
        # without friction the problem is linear now
        newton = 0.0 if loop.friction is None else forcing(record.history)
        part = newton if steady else UNSTEADY
        wanted = max(part * float(np.linalg.norm(r)), record.tolerance * scale)
        if steady:
            wanted *= UNSTEADY**idle
        if loop.friction is not None and np.any(status == Status.SLIP):
            record.cycles += self._with_friction(r, wanted)
        else:
            self.before[:] = r
            record.cycles += self._conjugate_gradients(r, wanted)
        if loop.friction is None:
            np.subtract(self.before, r, out=self.product)  # A x where nothing is held
            r[:] = self.before
            projected_search(loop.A, r, x, self.product, loop.contact, u, status)
            return False
        u += x
        turned, before = stop_slip_that_turned(loop, u, status), np.count_nonzero(status)
        place_on_road(loop, u, status)
        return turned or bool(np.count_nonzero(status) > before)

    def _follow_to_next_node(self, motion: np.ndarray, u: np.ndarray, status: np.ndarray) -> bool:
        """Move u (N, d) along a rigid motion (N, d) until the next node arrives at the road, if one does."""
        loop = self.loop
        gap, speed = loop.gaps(u, status), np.einsum("ca,ca->c", loop.frame[:, 0], motion[loop.nodes])
        falls = np.flatnonzero((status == Status.FREE) & (speed < -SEEN * np.abs(motion).max()))
        if not falls.size:
            return False
        times = np.maximum(gap[falls], 0.0) / -speed[falls]
        u += times.min() * motion
        status[falls[times == times.min()]] = Status.SLIP if loop.friction is None else Status.STICK
        place_all_on_surface(loop.contact, u, status)
        return True

    def _free_modes(self) -> np.ndarray:
        """Orthonormal columns (N d, z) of the rigid modes that what is held now leaves free."""
        modes, m = self.rigid.modes, self.rigid.count
        if m == 0:
            return modes
        nodes, rubs = self.loop.nodes, self.rubs
        at = self.rigid.at(nodes[self.held])
        rub = self.support[rubs] @ self.rigid.at(nodes[rubs]) / self.loop.diagonal.max()
        stopped = [(at - self.projectors[self.held] @ at).reshape(-1, m), rub.reshape(-1, m)]
        if self.springs is not None:
            stopped.append((self.springs @ self.rigid.at(nodes)).reshape(-1, m) / self.springs.max())
        free = null_space(np.linalg.qr(np.concatenate(stopped), mode="r"), np.abs(modes).max())
        self.cycle.set_kernel(self.coarse_modes @ free)
        return modes @ free

    def update_normals(self) -> None:
        """Follow the loop's new normals: what is held must be held anew."""
        self.status[self.held] = -1
        if self._condensed is not None:
            self._condensed.update_normals()
        if self.coarser is not None:
            self.coarser.update_normals(self.loop)

    def _linearise(self, u: np.ndarray, status: np.ndarray) -> None:
        """Find how friction follows pressure and slip at u (N, d)."""
        loop = self.loop
        if loop.friction is not None:
            before, followed = self.rubs, self.by_pressure.copy()
            friction_tangent(
                loop.contact,
                u,
                loop.R,
                loop.force,
                status,
                loop.friction.address,
                loop.slip_rate,
                self.by_pressure,
                self.support,
            )
            self.rubs = np.flatnonzero(self.support.any(axis=(1, 2)))
            self.status[before] = self.status[self.rubs] = -1
            self.status[np.any(self.by_pressure != followed, axis=1)] = -1

    def _truncate(self, status: np.ndarray) -> bool:
        """Hold the nodes as `status` says; True if that changed anything."""
        changed = np.flatnonzero(status != self.status)
        if changed.size:
            self.projectors[changed] = free_directions(self.loop, changed, status[changed])
            follow = self.by_pressure[changed, :, None] * self.loop.frame[changed, 0, None, :]
            tests = self.projectors[changed] @ (np.eye(follow.shape[1]) - follow)
            self.cycle.truncate(self.loop.nodes[changed], self.projectors[changed], tests)
            self.status[changed] = status[changed]
            self.held = np.flatnonzero(self.status)
        different = np.any(self.last != status)
        self.last[:] = status
        return bool(different)

    def _project(self, r: np.ndarray) -> None:
        """Zero the components of r (N, d) in which nodes are held or prescribed."""
        project(r, self.cycle.held, self.cycle.levels[0].T)
        r.flat[self.loop.prescribed] = 0.0

    def _conjugate_gradients(self, r: np.ndarray, wanted: float) -> int:
        """Set x with A x = r on what is linear, until the defect (in r) is below `wanted`.

        Return the number of cycles. A cycle leaves its defect: no other product with A is needed.
        """
        x, direction, product, left = self.x, self.direction, self.product, self.left
        x[:], direction[:], product[:] = 0.0, 0.0, 0.0
        before, cycles = 1.0, 0
        while cycles < KRYLOV:
            z = self.cycle(r, left=left)
            cycles += 1
            power = np.vdot(r, z)
            if power <= 0.0:  # nothing is missing from what is linear
                break
            self._project(left)
            stiffness = turn_direction(power / before, z, r, left, direction, product)
            before = power
            if stiffness <= 0.0:  # along a rigid motion, which nothing resists
                break
            if step_along(power / stiffness, direction, product, x, r) <= wanted:
                break
        return cycles

    def _with_friction(self, r: np.ndarray, wanted: float) -> int:
        """Set x as `_conjugate_gradients` does, the friction of slipping nodes following their pressure.

        That makes A unsymmetric.
        """
        loop, product, finest = self.loop, self.product, self.cycle.levels[0]
        cycles = 0

        def follow_friction(v: np.ndarray) -> np.ndarray:
            self._defect(loop.A, self.zero, v.reshape(loop.shape), product)
            project(product, self.cycle.held, finest.L)
            product.flat[loop.prescribed] = 0.0
            return -product.ravel()

        def precondition(v: np.ndarray) -> np.ndarray:
            nonlocal cycles
            cycles += 1
            return self.cycle(v.reshape(loop.shape)).ravel().copy()

        size = (r.size, r.size)
        x, _ = gcrotmk(
            LinearOperator(size, follow_friction, dtype=np.float64),
            r.ravel(),
            M=LinearOperator(size, precondition, dtype=np.float64),
            rtol=0.0,
            atol=wanted,
            m=KRYLOV,
            k=0,
            maxiter=1,
        )
        self.x[:] = x.reshape(loop.shape)
        return cycles


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

    def __init__(self, fine: NodeLoop, levels: list[Level], weights: Sequence[csr_array], rigid: RigidModes):
        self.level = levels[0]
        at_candidates = weights[0][fine.nodes]
        self.copies = np.flatnonzero(
            np.diff(at_candidates.indptr) == 1
        )  # candidates kept by the coarser mesh
        nodes = at_candidates[self.copies].indices
        self.loop = loop = NodeLoop(levels[1].A, nodes, fine.frame[self.copies, 0], fine.friction)
        copies = np.flatnonzero(np.diff(weights[0].indptr) == 1)
        kept = np.empty_like(copies)
        kept[weights[0][copies].indices] = copies
        rigid = rigid.of_coarser_mesh(kept, nodes)
        if len(weights) == 1:
            self.correction: Any = condensation(loop, rigid)
        else:
            coarser = CoarserMesh(loop, levels[1:], weights[1:], rigid)
            self.correction = Multigrid(loop, levels[1:], rigid, inject(rigid.modes, weights[1:]), coarser)
        self.weights = at_candidates[:, nodes]
        self.between = (
            np.abs(self.weights.sum(axis=1) - 1.0) < 1e-9
        )  # candidates whose parents are candidates

    def update_normals(self, fine: NodeLoop) -> None:
        """Follow the new normals of the finer mesh."""
        self.loop.update_normals(fine.frame[self.copies, 0])
        self.correction.update_normals()

    def first_guess(self, fine: NodeLoop, u: np.ndarray, status: np.ndarray, record: Record) -> None:
        """Correct u (N, d) and status (n,) of the fine mesh by the coarser solution.

        The residual at u must be the last that the fine loop has computed.
        """
        level, coarse, r = self.level, self.loop, fine.R
        r[fine.nodes] -= fine.force
        b = np.zeros(coarse.shape)
        interpolate(level.R, r, b)
        way = fine.sticking_place(self.copies) - u[fine.nodes[self.copies]]
        coarse.slip_rate = fine.slip_rate
        coarse.set_load(b, fine.gaps(u, status)[self.copies], way, fine.contact.state[self.copies])
        e = np.zeros(coarse.shape)
        in_contact = coarse.start(e, status[self.copies])
        with suppress(NotConverged):  # a guess is a guess
            # the coarsest answer is exact: it must have found the nodes that hold the body
            wanted = max(NESTED, record.tolerance) if isinstance(self.correction, Multigrid) else 1e-6
            enough = Record(wanted, GUESSES, record.sweeps, False)
            self.correction.solve(e, in_contact, enough)
        interpolate(level.P, e, u)
        fine.prescribe(fine.b, u)
        gap = fine.contact.gap + np.einsum("ca,ca->c", fine.frame[:, 0], u[fine.nodes])
        arrived = self.weights @ coarse.gaps(e, in_contact)
        lift = np.where(self.between, arrived - gap, 0.0)
        u[fine.nodes] += lift[:, None] * fine.frame[:, 0]
        stuck = self.weights @ (in_contact == Status.STICK).astype(float) > 1.0 - 1e-9
        status[:] = np.where(
            self.between & (arrived == 0.0), np.where(stuck, Status.STICK, Status.SLIP), Status.FREE
        )
        place_on_road(fine, u, status)


def condensation(loop: NodeLoop, rigid: RigidModes) -> Condensation:
    """The correction `direct` on a coarse mesh, with a unit diagonal where truncation left nothing."""
    A = bsr(loop.A)
    empty = np.where(A.diagonal() == 0.0, 1.0, 0.0)
    A = bsr_array(A + diags_array(empty), blocksize=A.blocksize)
    return Condensation(A, loop, rigid)


def geometric(loop: NodeLoop, prolongations: Sequence[csr_array], rigid: RigidModes) -> Multigrid:
    """Multigrid on nested meshes, from scalar prolongations, finest first."""
    levels = [Level(loop.A, loop.inverse, diagonal_positions(loop.A))]
    prescribed = np.flatnonzero(loop.uncoupled.any(axis=1))
    levels[0].hold(prescribed, np.eye(loop.shape[1]) * loop.loaded[prescribed, :, None])
    for weights in prolongations:
        levels.append(coarsen(levels[-1], prolongation(weights), weights.shape[1]))
    coarser = CoarserMesh(loop, levels, prolongations, rigid)
    return Multigrid(loop, levels, rigid, inject(rigid.modes, prolongations), coarser)


def inject(modes: np.ndarray, prolongations: Sequence[csr_array]) -> np.ndarray:
    """Values of modes (N d, m) at the nodes of the coarsest mesh, all of which finer meshes keep."""
    N, (rows, m) = prolongations[0].shape[0], modes.shape
    values = modes.reshape(N, rows // N, m)
    for weights in prolongations:
        kept = np.flatnonzero(np.diff(weights.indptr) == 1)
        coarse = np.zeros((weights.shape[1], *values.shape[1:]))
        coarse[weights[kept].indices] = values[kept]
        values = coarse
    return values.reshape(values.shape[0] * values.shape[1], m)


def bsr(A: BlockMatrix) -> bsr_array:
    """Hand a matrix back to scipy; the values are shared."""
    return bsr_array((A.data, A.indices.astype(np.int32), A.indptr.astype(np.int32)))
