"""The contact loop and truncated multigrid on many ranks."""

from contextlib import suppress
from functools import cached_property
from resource import RUSAGE_SELF, getrusage
from time import perf_counter
from types import SimpleNamespace
from typing import Any

import numpy as np

from checks import is_tolerance, positive
from model.node_loop.blocks import block_matrix, defect
from model.node_loop.friction_tangent import friction_tangent
from model.node_loop.node_loop import NodeLoop, length, place_on_road, stop_slip_that_turned
from model.node_loop.status import Status
from model.problem.contact_problem import shaped
from model.problem.rigid_modes import BALANCE
from model.ranks.first_guess import FirstGuess
from model.ranks.krylov import conjugate_gradients, flexible_gmres
from model.ranks.petsc_cycle import PetscCycle, has_petsc
from model.ranks.shared_levels import SharedCycle, SharedLevel
from model.ranks.shared_problem import SharedProblem
from model.ranks.shared_rigid_modes import SharedRigidModes
from model.solvers.compiling import announce_compilation
from model.solvers.contact_solver import Solution
from model.solvers.convergence_record import NotConverged, Record
from model.solvers.truncated_multigrid import (
    FALL,
    GUESSES,
    KRYLOV,
    PATIENCE,
    UNSTEADY,
    forcing,
    free_directions,
    supported,
)


class SharedLoop(NodeLoop):
    """The node loop within the rows of one rank; after each sweep the ranks tell each other.

    The nodes of other ranks stand still in the meantime, which is Gauss-Seidel within and Jacobi between
    the ranks.
    """

    def __init__(self, problem: SharedProblem):
        super().__init__(block_matrix(problem.A), problem.contact_nodes, problem.normal, problem.friction)
        self.exchange = problem.exchanges[0]

    def set_load(self, b: np.ndarray, gap: np.ndarray, reference: Any = None, state: Any = None) -> None:
        """Set what changes from step to step; collective."""
        super().set_load(b[: self.exchange.owned], gap, reference, state)
        self.load_size = self._all(self.load_size)

    def start(self, u: np.ndarray, status: np.ndarray | None = None) -> np.ndarray:
        """Make `u` (nodes held, d) admissible in place; collective."""
        status = super().start(u[: self.exchange.owned], status)
        self.exchange.update(u)
        return status

    def sweep(self, u: np.ndarray, status: np.ndarray, count: int = 1) -> None:
        """Sweep `count` times; collective."""
        for _ in range(count):
            super().sweep(u, status)
            self.exchange.update(u)

    def residual(self, u: np.ndarray, status: np.ndarray) -> float:
        """Natural residual of `u` (nodes held, d) on all ranks; collective."""
        super().residual(u, status)
        squares = np.array([length(self.R) ** 2, length(self.force) ** 2])
        missing, force = (float(size) for size in np.sqrt(self.exchange.sum(squares)))
        self.scale = self.load_size + force
        return 0.0 if missing == 0.0 else missing / (self.scale or missing)

    def norm(self, x: np.ndarray) -> float:
        """Euclidean norm of values (N, d) at all ranks' own nodes; collective."""
        return self._all(length(self.exchange.own(x)))

    def _all(self, size: float) -> float:
        """Norm of a vector of which each rank knows the norm of its part."""
        return float(np.sqrt(self.exchange.sum(size**2)))


def chosen(problem: SharedProblem, correction: str) -> str:
    """Return the correction that is meant, or refuse it (ValueError)."""
    nested, petsc = len(problem.prolongations) > 0, has_petsc()
    if correction == "auto":
        correction = "multigrid" if nested else "algebraic"
    if correction == "multigrid" and not nested:
        raise ValueError(
            "correction is 'multigrid', but the meshes are not nested; use Body.from_grid(grid, "
            "refinements), or 'algebraic'."
        )
    if correction in ("algebraic", "direct") and not petsc:
        raise ValueError(
            f"On several ranks the correction {correction!r} is PETSc's, which is not loaded here; install "
            "petsc4py, or use Body.from_grid(grid, refinements) with 'multigrid'."
        )
    if correction not in ("multigrid", "algebraic", "direct", "none"):
        raise ValueError(
            f"correction is {correction!r}, but it must be one of auto, none, direct, multigrid, algebraic."
        )
    return correction


class SharedSolver:
    """Solves one shared contact problem for any loads, gaps and stick positions.

    Rounds of one sweep of the node loop, which decides contact, stick and slip, and a correction by
    conjugate gradients with V-cycles for the unknowns that are linear at present, as `Multigrid` on one
    rank.

    Parameters
    ----------
    problem : SharedProblem
    progress : bool
        Show a bar on rank 0.
    correction : str
        "multigrid" on nested meshes; else "algebraic" or "direct" by PETSc, or "none".
    cycle : SharedCycle, optional
        For this problem, where it has been made.
    nested : bool
        Take first guesses from coarser meshes; for the rough loads of time steps they are no good.
    """

    def __init__(
        self,
        problem: SharedProblem,
        correction: str = "auto",
        progress: bool = True,
        nested: bool = True,
        cycle: SharedCycle | None = None,
    ):
        self.name = chosen(problem, correction)
        began = perf_counter()
        self.problem, self.exchange = problem, problem.exchanges[0]
        self.ranks = self.exchange
        self.progress = progress and self.exchange.comm.rank == 0
        if self.exchange.comm.rank == 0:
            announce_compilation()
        self.loop = SharedLoop(problem)
        N, d = problem.coordinates.shape
        self.projectors, self.alone = np.zeros((N, d, d)), np.nonzero(self.loop.uncoupled)
        self.cycle = self._make() if cycle is None else cycle
        nested = nested and self.name == "multigrid"
        self.first_guess = FirstGuess(problem, self.cycle, SharedSolver) if nested else None
        nodes = problem.contact_nodes
        self.contacts, copies = self.exchange.among(nodes)
        self.candidates, self.news = np.concatenate([nodes, copies]), np.zeros(N, dtype=bool)
        n = nodes.size
        self.follow, self.support = np.zeros((n, d)), np.zeros((n, d, d))
        self.rubs = np.zeros(0, dtype=np.int64)
        self.status, self.last = np.zeros(n, dtype=np.int8), np.zeros(n, dtype=np.int8)
        self.setup_seconds = perf_counter() - began

    @property
    def correction(self) -> Any:
        """What corrects, as time steps know it; made when asked, so that no solver refers to itself."""
        return SimpleNamespace(name=self.name, solve=self.solve_step)

    def _make(self) -> Any:
        """Make what corrects; collective."""
        problem, loop = self.problem, self.loop
        if self.name == "none":
            return None
        fixed = np.zeros(problem.coordinates.shape, dtype=bool)
        fixed[: self.exchange.owned] = loop.uncoupled
        self.exchange.update(fixed)
        finest = SharedLevel(loop.A, self.exchange, len(fixed), loop.inverse)
        if self.name == "multigrid":
            return SharedCycle(finest, problem.prolongations, problem.exchanges[1:], problem.ids[1:], fixed)
        cycle, held = PetscCycle(finest, problem.coordinates, self.name), np.flatnonzero(fixed.any(axis=1))
        cycle.truncate(held, np.eye(fixed.shape[1]) * ~fixed[held, :, None])
        return cycle

    def solve(
        self,
        b: np.ndarray | None = None,
        gap: np.ndarray | None = None,
        tangential_reference: np.ndarray | None = None,
        start: np.ndarray | None = None,
        start_status: np.ndarray | None = None,
        slipped: np.ndarray | None = None,
        places: np.ndarray | None = None,
        normal: np.ndarray | None = None,
        tolerance: float = 1e-10,
        limit: int = 1000,
        slip_rate: float = 1.0,
        springs: np.ndarray | None = None,
        part: float = 0.0,
    ) -> Solution:
        """Solve for one load; collective. Arguments and result as of `ContactSolver.solve`.

        Raises
        ------
        NotConverged
            On all ranks.
        ValueError
            If an argument is not finite or does not fit, a node starts below the road, or nothing can hold
            the body against the load; on all ranks.
        """
        began = perf_counter()
        problem, loop, owned = self.problem, self.loop, self.exchange.owned
        N, d = problem.coordinates.shape
        is_tolerance(tolerance)
        positive(limit=limit, slip_rate=slip_rate)
        trouble = ""
        try:
            b = problem.b if b is None else shaped("b", b, (N, d))[:owned]
            if gap is None:
                gap = problem.gap
            else:  # the distance to a plane that the road touches elsewhere may be negative
                gap = problem.checked_gap(gap) if normal is None else shaped("gap", gap, loop.nodes.shape)
            wanted = np.zeros(loop.force.shape) if tangential_reference is None else tangential_reference
            reference = shaped("tangential_reference", wanted, loop.force.shape)
            u = np.zeros((N, d)) if start is None else shaped("start", start, (N, d)).copy()
        except ValueError as error:
            trouble = str(error)
        self.exchange.agree(trouble)
        assert b is not None and gap is not None
        self.take_planes(problem.normal if normal is None else normal)
        loop.slip_rate = slip_rate
        if places is None and loop.friction is not None and loop.friction.by_place:
            on = problem.normal if normal is None else normal
            height = gap + np.einsum("ca,ca->c", on, reference)
            places = problem.coordinates[loop.nodes] + reference - height[:, None] * on
        if self.exchange.any(springs is not None or loop.springs is not None):
            loop.put_springs(springs)
            self.status[:] = -1
        state = loop.told(np.zeros(loop.nodes.size) if slipped is None else slipped, places)
        if normal is None:  # on a curved road others may hold the body in the end
            mu = np.zeros(loop.nodes.size) if loop.friction is None else state[:, 1]
            self.rigid.require_balance(b, mu, BALANCE)
        loop.set_load(b, gap, reference, state)
        if springs is not None:
            loop.pull(u[loop.nodes])
        status = loop.start(u, start_status)
        first = loop.sweeps
        record = Record(tolerance, limit, lambda: loop.sweeps - first, self.progress, part=part)
        self.solve_step(u, status, record)
        seconds = perf_counter() - began
        force, pressure = loop.reaction(u[loop.nodes] - reference)
        loop.confirm(status)
        return Solution(
            displacement=u,
            contact_force=force,
            pressure_force=pressure,
            gap=loop.part * loop.gaps(u, status),
            status=status,
            residual=record.history[-1],
            history=np.array(record.history),
            correction=self.name,
            sweeps=loop.sweeps - first,
            cycles=record.cycles,
            work_units=seconds / (loop.seconds_of_passes / loop.passes),
            seconds=seconds,
            setup_seconds=self.setup_seconds,
            peak_memory=getrusage(RUSAGE_SELF).ru_maxrss * 1024,
            state=np.asarray(status == Status.SLIP, dtype=np.float64),
        )

    @cached_property
    def rigid(self) -> SharedRigidModes:
        """Rigid modes of the problem; collective when first asked for."""
        return SharedRigidModes(self.problem)

    def take_planes(self, normal: np.ndarray) -> None:
        """Give every candidate a plane by its unit normal (n, d), unless it has it; collective."""
        if self.exchange.any(not np.array_equal(normal, self.loop.normal)):
            self.loop.update_normals(normal)
            self.status[self.status != Status.FREE] = -1
            if self.first_guess is not None:
                self.first_guess.update_normals(self.loop)

    def solve_step(self, u: np.ndarray, status: np.ndarray, record: Record) -> None:
        """Solve the problem that the loop holds, from an admissible u and status, in place; collective."""
        self.last[:] = status
        sprung = self.loop.springs is not None  # coarser loops have no springs
        if self.first_guess is not None and not sprung and self.loop.residual(u, status) > record.tolerance:
            self.first_guess.correct(self.loop, u, status)
        self._rounds(u, status, record)

    def guess(
        self, b: np.ndarray, gap: np.ndarray, reference: np.ndarray, told: np.ndarray, tolerance: float
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return displacement (nodes held, d) and status (n,) after a few rounds; collective."""
        loop = self.loop
        loop.set_load(b[: self.exchange.owned], gap, reference, told)
        u = np.zeros((len(b), b.shape[1]))
        status = loop.start(u, None)
        with suppress(NotConverged):
            self.solve_step(u, status, Record(tolerance, GUESSES, lambda: 0, False))
        return u, status

    def _rounds(self, u: np.ndarray, status: np.ndarray, record: Record) -> None:
        """Sweep and correct until the natural residual is below the tolerance; collective."""
        try:
            self._go_round(u, status, record)
        except NotConverged as error:
            error.everybody = True
            raise

    def _go_round(self, u: np.ndarray, status: np.ndarray, record: Record) -> None:
        loop, exchange = self.loop, self.exchange
        if self.name == "none":
            count = 1
            while not record.finished(loop.residual(u, status)):
                loop.sweep(u, status, count)
                count = min(2 * count, 100)
            return
        best, idle, steady, at_once = np.inf, 0, 0, False
        while True:
            if not at_once:
                loop.sweep(u, status)
            residual = loop.residual(u, status)
            if record.finished(residual):
                return
            best, idle = (residual, 0) if residual < FALL * best else (best, idle + 1)
            self._linearise(u, status)
            rubs = self.rubs
            with supported(self.cycle.levels[0], loop.nodes[rubs], self.support[rubs]):
                steady = 0 if self._truncate(status) else steady + 1
                R = np.zeros_like(u)
                R[: exchange.owned] = loop.R
                self._project(R)
                missing = np.sqrt(exchange.dot(R, R))
                part = 0.0 if loop.friction is None else forcing(record.history)
                part = UNSTEADY if steady == 0 else part
                wanted = max(part * missing, record.tolerance * loop.scale)
                if steady or idle > PATIENCE:  # less is left where sweeps undo what corrections gain
                    wanted *= UNSTEADY ** min(idle, PATIENCE)
                x, cycles = self._correction(R, wanted, status)
            record.cycles += cycles
            u += self._fall(x, u, status) * x
            before = np.count_nonzero(status)
            turned = loop.friction is not None and stop_slip_that_turned(loop, u, status)
            place_on_road(loop, u, status)
            arrived = loop.friction is not None and np.count_nonzero(status) > before
            at_once = exchange.any(turned or arrived)
            exchange.update(u)

    def _linearise(self, u: np.ndarray, status: np.ndarray) -> None:
        """Find how friction follows pressure and slip at u (nodes held, d)."""
        loop = self.loop
        if loop.friction is not None:
            law, forces, derivatives = (
                loop.friction.address,
                (loop.R, loop.force),
                (self.follow, self.support),
            )
            before = self.rubs
            friction_tangent(loop.contact, u, *forces, status, law, loop.slip_rate, *derivatives)
            self.rubs = np.flatnonzero(self.support.any(axis=(1, 2)))
            self.status[before] = self.status[self.rubs] = -1

    def _fall(self, x: np.ndarray, u: np.ndarray, status: np.ndarray) -> float:
        """Part of a correction x after which no node is deeper below the road than one is above it now."""
        loop, comm = self.loop, self.exchange.comm
        gap = loop.gaps(u, status)
        move = np.einsum("ca,ca->c", loop.frame[:, 0], x[loop.nodes])
        highest = float(-comm.allreduce(-gap.max(initial=0.0), op=min))
        falls = move < 0.0
        part = float(np.min((gap[falls] + highest) / -move[falls], initial=1.0))
        return float(comm.allreduce(part, op=min)) if highest > 0.0 else 1.0

    def _correction(self, R: np.ndarray, wanted: float, status: np.ndarray) -> tuple[np.ndarray, int]:
        """Solve for the unknowns that are linear at present; collective."""
        loop, exchange, owned = self.loop, self.exchange, self.exchange.owned
        nothing, product = np.zeros_like(R), np.zeros_like(R)

        def minus(v: np.ndarray) -> np.ndarray:
            defect(R.shape[1])(loop.A, nothing, v, product[:owned])
            pressure = np.einsum("ca,ca->c", normal, product[nodes])
            self._project(product)
            product[nodes] -= pressure[:, None] * follow
            return product

        slipping = np.flatnonzero(status == Status.SLIP)
        slipping = slipping[:0] if loop.friction is None else slipping
        nodes, normal, follow = loop.nodes[slipping], loop.frame[slipping, 0], self.follow[slipping]
        method = flexible_gmres if exchange.any(slipping.size > 0) else conjugate_gradients
        return method(minus, self.cycle, R, wanted, KRYLOV, exchange.sum)

    def _truncate(self, status: np.ndarray) -> bool:
        """Hold the nodes as `status` says; True if that changed anything anywhere; collective."""
        loop, changed = self.loop, np.flatnonzero(status != self.status)
        anew, different = self.exchange.sum(np.array([changed.size, np.sum(self.last != status)]))
        self.last[:] = status
        if anew:
            nodes = loop.nodes[changed]
            self.projectors[nodes] = free_directions(loop, changed, status[changed])
            self.news[nodes] = True
            self.contacts.update(self.projectors)
            self.contacts.update(self.news)
            here = self.candidates[self.news[self.candidates]]
            self.news[here] = False
            self.cycle.truncate(here, self.projectors[here])
            self.status[changed] = status[changed]
        return bool(different)

    def _project(self, r: np.ndarray) -> None:
        """Zero the components of r (nodes held, d) in which owned nodes are held or prescribed."""
        held = self.loop.nodes[self.status != Status.FREE]
        r[held] = np.einsum("cab,cb->ca", self.projectors[held], r[held])
        r[self.alone] = 0.0
