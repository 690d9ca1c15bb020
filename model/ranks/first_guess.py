"""Nested iteration: the first guess of a shared contact problem, from the next coarser mesh."""

from contextlib import suppress
from typing import Any

import numpy as np
from scipy.sparse import bsr_array, diags_array

from model.node_loop.node_loop import place_on_road
from model.node_loop.status import Status
from model.problem.contact_problem import ContactProblem
from model.ranks.gathered_meshes import GatheredCycle
from model.ranks.shared_levels import SharedCycle, SharedLevel
from model.ranks.shared_problem import SharedProblem
from model.solvers.contact_solver import ContactSolver
from model.solvers.convergence_record import NotConverged
from model.solvers.galerkin_coarsening import interpolate
from model.solvers.truncated_multigrid import NESTED

EXACT = 1e-6  # natural residual of a small mesh: it must have found the nodes that hold the body


class GatheredSolver:
    """The contact problem of a mesh that is too small to be shared, gathered and solved on every rank.

    Parameters
    ----------
    problem : SharedProblem
    level : SharedLevel
        Its matrix, truncated at supports only.
    meshes : GatheredCycle
        The mesh, and those below it.
    """

    def __init__(self, problem: SharedProblem, level: SharedLevel, meshes: GatheredCycle):
        mesh, self.level = meshes.mesh, level
        self.mesh = mesh
        candidate = np.zeros((level.nodes, 1 + level.d))
        candidate[problem.contact_nodes, 0] = 1.0
        candidate[problem.contact_nodes, 1:] = problem.normal
        whole = mesh.gather(candidate)
        self.nodes, self.own = np.flatnonzero(whole[:, 0]), mesh.number[problem.contact_nodes]
        A = mesh.matrix(level.A)
        empty = np.where(A.diagonal() == 0.0, 1.0, 0.0)  # truncation has left nothing there
        gathered = ContactProblem(
            bsr_array(A + diags_array(empty), blocksize=A.blocksize),
            np.zeros((len(whole), level.d)),
            mesh.gather(problem.coordinates),
            self.nodes,
            whole[self.nodes, 1:],
            np.zeros(self.nodes.size),
            None if problem.friction is None else problem.friction.with_each(lambda value: 0.0),
            prolongations=meshes.prolongations,
        )
        nested = len(meshes.prolongations) > 0
        self.solver = ContactSolver(gathered, "multigrid" if nested else "direct", progress=False)
        self.tolerance = NESTED if nested else EXACT

    def solve(
        self, b: np.ndarray, gap: np.ndarray, normal: np.ndarray, reference: np.ndarray, told: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return displacement (nodes held, d) and status (n,) of the owned candidates; collective."""
        mesh, d = self.mesh, b.shape[1]
        spread = np.zeros((self.level.nodes, 1 + 2 * d + told.shape[1]))
        spread[self.own - mesh.first] = np.column_stack([gap, normal, reference, told])
        whole = mesh.gather(spread)[self.nodes]
        told = whole[:, 1 + 2 * d :]
        law: Any = self.solver.loop.friction
        if law is not None:
            columns = iter(told[:, 1:].T)
            self.solver.loop.friction = law.with_each(lambda value: next(columns).copy())
        solution = self.solver.solve(
            mesh.gather(b),
            whole[:, 0],
            normal=whole[:, 1 : d + 1],
            tangential_reference=whole[:, d + 1 : 2 * d + 1],
            slipped=told[:, 0],
            tolerance=self.tolerance,
        )
        status = np.zeros(mesh.size, dtype=np.int8)
        status[self.nodes] = solution.status
        return solution.displacement[mesh.number], status[self.own]


class FirstGuess:
    """The contact problem on the next coarser mesh, from which a first guess comes.

    Parameters
    ----------
    problem : SharedProblem
        On the finer mesh.
    cycle : SharedCycle
        On the finer mesh, truncated at supports only.
    solver : class
        Of the shared problem on meshes that are not the coarsest.
    """

    def __init__(self, problem: SharedProblem, cycle: SharedCycle, solver: Any):
        fine = cycle.levels[0]
        self.fine, self.exchange = fine, problem.exchanges[1]
        weights = problem.prolongations[0]
        at_candidates = weights[problem.contact_nodes]
        self.copies = np.flatnonzero(np.diff(at_candidates.indptr) == 1)
        nodes = at_candidates[self.copies].indices.astype(np.int64)
        small = len(cycle.levels) == 2
        below = None if small else cycle.below()
        A = fine.coarser.A if below is None else below.levels[0].A
        coordinates = np.zeros((weights.shape[1], problem.coordinates.shape[1]))
        copies = np.flatnonzero(np.diff(weights.indptr) == 1)
        coordinates[weights[copies].indices] = problem.coordinates[copies]
        self.exchange.update(coordinates)
        coarse = problem.coarser(
            A,
            coordinates,
            nodes,
            problem.normal[self.copies],
            None if problem.friction is None else problem.friction.of(self.copies),
        )
        self.nodes, self.weights = nodes, at_candidates
        self.normal = problem.normal[self.copies]
        candidate = np.zeros(len(coordinates))
        candidate[nodes] = 1.0
        self.exchange.update(candidate)
        self.between = np.abs(at_candidates @ candidate - at_candidates.sum(axis=1)) < 1e-9
        self.gathered = GatheredSolver(coarse, fine.coarser, cycle.coarsest) if small else None
        self.solver = None if small else solver(coarse, progress=False, cycle=below)

    def update_normals(self, loop: Any) -> None:
        """Follow the new normals of the finer mesh; collective."""
        self.normal = loop.frame[self.copies, 0]
        if self.solver is not None:
            self.solver.take_planes(self.normal)

    def correct(self, loop: Any, u: np.ndarray, status: np.ndarray) -> None:
        """Correct u (nodes held, d) and status (n,) of the finer mesh; collective.

        The residual at u must be the last that the finer loop has computed.
        """
        fine, d, r = self.fine, u.shape[1], loop.R
        r[loop.nodes] -= loop.force
        b = np.zeros((self.weights.shape[1], d))
        interpolate(fine.R, r, b)
        self.exchange.add(b)
        gap = loop.gaps(u, status)
        way = loop.sticking_place(self.copies) - u[loop.nodes[self.copies]]
        told = loop.contact.state[self.copies]
        e, found = np.zeros(b.shape), np.zeros(self.copies.size, dtype=np.int8)
        with suppress(NotConverged, ValueError):  # a guess is a guess
            if self.gathered is not None:
                e, found = self.gathered.solve(b, gap[self.copies], self.normal, way, told)
            elif self.solver is not None:
                e, found = self.solver.guess(b, gap[self.copies], way, told, NESTED)
        interpolate(fine.P, e, u)
        loop.prescribe(loop.b, u[: len(loop.b)])
        marks = np.zeros((len(e), 2))
        left = gap[self.copies] + np.einsum("ca,ca->c", loop.frame[self.copies, 0], e[self.nodes])
        marks[self.nodes, 0] = np.where(found == Status.FREE, left, 0.0)
        marks[self.nodes, 1] = found == Status.STICK
        self.exchange.update(marks)
        arrived, stuck = (self.weights @ marks).T
        now = loop.contact.gap + np.einsum("ca,ca->c", loop.frame[:, 0], u[loop.nodes])
        lift = np.where(self.between, arrived - now, 0.0)
        u[loop.nodes] += lift[:, None] * loop.frame[:, 0]
        sticks = np.where(stuck > 1.0 - 1e-9, Status.STICK, Status.SLIP)
        status[:] = np.where(self.between & (arrived == 0.0), sticks, Status.FREE)
        place_on_road(loop, u, status)
        loop.exchange.update(u)
