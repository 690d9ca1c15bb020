"""The contact loop and truncated multigrid on many ranks."""

from functools import cached_property
from time import perf_counter
from typing import Any

import numpy as np

from model.node_loop.blocks import BlockMatrix, block_matrix
from model.node_loop.node_loop import NodeLoop, length, place_on_road, stop_slip_that_turned
from model.ranks.first_guess import GatheredCoarserMesh, SharedCoarserMesh
from model.ranks.petsc_cycle import PetscCycle, has_petsc
from model.ranks.shared_levels import SharedCycle, SharedLevel
from model.ranks.shared_problem import SharedProblem
from model.ranks.shared_rigid_modes import SharedRigidModes
from model.solvers.compiling import announce_compilation
from model.solvers.contact_solver import ContactSolver, Relaxation
from model.solvers.truncated_multigrid import CoarserMesh, Multigrid, inject


class SharedLoop(NodeLoop):
    """The node loop within the rows of one rank; after each sweep the ranks tell each other.

    The nodes of other ranks stand still in the meantime, which is Gauss-Seidel within and Jacobi between
    the ranks.

    Parameters
    ----------
    A : BlockMatrix
        Rows of the owned nodes.
    nodes, normal, friction
        As for `NodeLoop`.
    ranks : geometry.exchange.Exchange
    held : int
        Nodes held here, ghosts counted.
    """

    def __init__(self, A: BlockMatrix, nodes: Any, normal: Any, friction: Any, ranks: Any, held: int):
        super().__init__(A, nodes, normal, friction)
        self.ranks, self.field_shape = ranks, (held, self.shape[1])

    def set_load(self, b: np.ndarray, gap: np.ndarray, reference: Any = None, state: Any = None) -> None:
        """Set what changes from step to step; collective."""
        super().set_load(self.ranks.own(b), gap, reference, state)
        self.load_size = float(np.sqrt(self.ranks.sum(self.load_size**2)))

    def start(self, u: np.ndarray, status: np.ndarray | None = None) -> np.ndarray:
        """Make `u` (nodes held, d) admissible in place; collective."""
        status = super().start(self.ranks.own(u), status)
        self.ranks.update(u)
        return status

    def sweep(self, u: np.ndarray, status: np.ndarray, count: int = 1) -> None:
        """Sweep `count` times; collective."""
        for _ in range(count):
            super().sweep(u, status)
            self.ranks.update(u)

    def residual(self, u: np.ndarray, status: np.ndarray) -> float:
        """Natural residual of `u` (nodes held, d) on all ranks; collective."""
        super().residual(u, status)
        squares = np.array([length(self.R) ** 2, length(self.force) ** 2])
        missing, force = (float(size) for size in np.sqrt(self.ranks.sum(squares)))
        self.scale = self.load_size + force
        return 0.0 if missing == 0.0 else missing / (self.scale or missing)


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


class SharedMultigrid(Multigrid):
    """Rounds of one sweep of the node loop, which decides contact, stick and slip, and a shared correction.

    Parameters
    ----------
    loop : SharedLoop
    cycle : SharedCycle or PetscCycle
    coarser : CoarserMesh, optional
    """

    condenses = False

    def __init__(self, loop: SharedLoop, cycle: Any, coarser: CoarserMesh | None = None):
        super().__init__(loop, cycle, coarser=coarser)
        N, d = loop.field_shape
        self._contacts, copies = loop.ranks.among(loop.nodes)
        self._candidates = np.concatenate([loop.nodes, copies])
        self._projectors, self._news = np.zeros((N, d, d)), np.zeros(N, dtype=bool)

    def _hold(self, nodes: np.ndarray, projectors: np.ndarray, tests: np.ndarray) -> None:
        """Let the cycles of all ranks hold nodes (k,); collective."""
        self._projectors[nodes], self._news[nodes] = projectors, True
        self._contacts.update(self._projectors)
        self._contacts.update(self._news)
        here = self._candidates[self._news[self._candidates]]
        self._news[here] = False
        self.cycle.truncate(here, self._projectors[here])
        self.cycle.levels[0].L[nodes] = tests

    def _missing(self) -> np.ndarray:
        """Return what is missing from equilibrium, zero at other ranks' nodes."""
        R = np.zeros(self.loop.field_shape)
        R[: len(self.loop.R)] = self.loop.R
        return R

    def _move(
        self, x: np.ndarray, missing: np.ndarray, left: np.ndarray, u: np.ndarray, status: np.ndarray
    ) -> bool:
        """Correct u (nodes held, d) by as much of x as leaves no node too deep below the road; collective."""
        loop, ranks = self.loop, self.loop.ranks
        u += self._fall(x, u, status) * x
        before = np.count_nonzero(status)
        turned = loop.friction is not None and stop_slip_that_turned(loop, u, status)
        place_on_road(loop, u, status)
        arrived = loop.friction is not None and np.count_nonzero(status) > before
        ranks.update(u)
        return bool(ranks.any(turned or arrived))

    def _fall(self, x: np.ndarray, u: np.ndarray, status: np.ndarray) -> float:
        """Part of a correction x after which no node is deeper below the road than one is above it now."""
        loop, ranks = self.loop, self.loop.ranks
        gap = loop.gaps(u, status)
        move = np.einsum("ca,ca->c", loop.frame[:, 0], x[loop.nodes])
        highest = ranks.max(gap.max(initial=0.0))
        falls = move < 0.0
        part = float(np.min((gap[falls] + highest) / -move[falls], initial=1.0))
        return -ranks.max(-part) if highest > 0.0 else 1.0


class SharedSolver(ContactSolver):
    """Solves one shared contact problem for any loads, gaps and stick positions.

    Parameters
    ----------
    problem : SharedProblem
    correction : str
        "multigrid" on nested meshes; else "algebraic" or "direct" by PETSc, or "none".
    progress : bool
        Show a bar on rank 0.
    nested : bool
        Take first guesses from coarser meshes; for the rough loads of time steps they are no good.
    """

    def __init__(self, problem: Any, correction: str = "auto", progress: bool = True, nested: bool = True):
        name, self.ranks = chosen(problem, correction), problem.exchanges[0]
        began = perf_counter()
        self.problem, self.progress = problem, progress and self.ranks.comm.rank == 0
        if self.ranks.comm.rank == 0:
            announce_compilation()
        there = problem.contact_nodes, problem.normal, problem.friction
        A, N, owned = block_matrix(problem.A), len(problem.coordinates), self.ranks.owned
        A = A._replace(indptr=A.indptr[: owned + 1])
        self.loop = SharedLoop(A, *there, self.ranks, N)
        self.correction = correction_of(problem, self.loop, name, nested)
        self.setup_seconds = self._unpaid = perf_counter() - began

    @cached_property
    def rigid(self) -> Any:
        """Rigid modes of the problem; collective when first asked for."""
        return SharedRigidModes(self.problem)

    def _floor(self, u: np.ndarray) -> float:
        """Natural residual to which rounding is looked for: none, as no rank knows the others' parts."""
        return 0.0

    def _causes(self, u: np.ndarray, status: np.ndarray, tests: list[float], tolerance: float) -> list[str]:
        """Say nothing of causes, of which each rank sees its part."""
        return []


def correction_of(problem: SharedProblem, loop: SharedLoop, name: str, nested: bool) -> Any:
    """Return what corrects by its name; collective."""
    if name == "none":
        return Relaxation(loop)
    ranks = loop.ranks
    fixed = np.zeros(loop.field_shape, dtype=bool)
    fixed[: ranks.owned] = loop.uncoupled
    ranks.update(fixed)
    finest = SharedLevel(loop.A, ranks, len(fixed), loop.inverse)
    supported = np.flatnonzero(fixed.any(axis=1))
    projectors = np.eye(finest.d) * ~fixed[supported, :, None]
    if name == "multigrid":
        finest.hold(supported, projectors)
        cycle = SharedCycle(finest, problem.prolongations, problem.exchanges[1:], problem.ids[1:])
        return on_meshes(loop, cycle, problem.coordinates, problem.prolongations, nested)
    by_petsc = PetscCycle(finest, problem.coordinates, name)
    by_petsc.truncate(supported, projectors)
    multigrid = SharedMultigrid(loop, by_petsc)
    multigrid.name = name
    return multigrid


def on_meshes(
    loop: SharedLoop, cycle: SharedCycle, coordinates: np.ndarray, prolongations: Any, nested: bool
) -> SharedMultigrid:
    """Return multigrid by the cycle on nested meshes, with first guesses from coarser ones; collective."""
    if not nested:
        return SharedMultigrid(loop, cycle)
    weights, level = prolongations[0], cycle.levels[0]
    ranks = level.coarser.ranks
    at = inject(coordinates.reshape(-1, 1), prolongations[:1]).reshape(-1, level.d)
    ranks.update(at)
    there = loop, level, weights, ranks
    if len(cycle.levels) == 2:
        return SharedMultigrid(loop, cycle, GatheredCoarserMesh(*there, at, cycle.coarsest))
    coarser, below = SharedCoarserMesh(*there), cycle.below()
    A, normal = below.levels[0].A, loop.frame[coarser.copies, 0]
    coarser.loop = SharedLoop(A, coarser.nodes, normal, loop.friction, ranks, len(at))
    coarser.correction = on_meshes(coarser.loop, below, at, prolongations[1:], nested)
    return SharedMultigrid(loop, cycle, coarser)
