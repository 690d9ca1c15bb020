"""Nested iteration: the first guess of a shared contact problem, from the next coarser mesh."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.sparse import csr_array

from model.node_loop.node_loop import NodeLoop
from model.problem.contact_problem import ContactProblem
from model.ranks.gathered_meshes import GatheredCycle
from model.solvers.contact_solver import ContactSolver
from model.solvers.convergence_record import Record
from model.solvers.truncated_multigrid import CoarserMesh, with_unit_diagonal


class SharedCoarserMesh(CoarserMesh):
    """The contact problem on the next coarser mesh, shared as well; `loop` and `correction` are set later.

    Parameters
    ----------
    fine : SharedLoop
        On the finer mesh.
    level : SharedLevel
        The finer mesh, truncated at supports only.
    weights : csr_array
        Scalar prolongation from the coarser mesh.
    ranks : geometry.exchange.Exchange
        Of the coarser mesh.
    """

    def __init__(self, fine: NodeLoop, level: Any, weights: csr_array, ranks: Any):
        self._meet(fine, level, weights, ranks)


class GatheredCoarserMesh(SharedCoarserMesh):
    """The contact problem on a mesh too small to be shared, gathered and solved on every rank.

    Parameters
    ----------
    fine, level, weights, ranks
        As for `SharedCoarserMesh`.
    coordinates : (N, d)
        Of the coarser mesh.
    meshes : GatheredCycle
        The coarser mesh, and those below it.
    """

    def __init__(
        self,
        fine: NodeLoop,
        level: Any,
        weights: csr_array,
        ranks: Any,
        coordinates: np.ndarray,
        meshes: GatheredCycle,
    ):
        super().__init__(fine, level, weights, ranks)
        self.mesh = mesh = meshes.mesh
        marks = np.zeros(weights.shape[1], dtype=bool)
        marks[self.nodes] = True
        self.everybody = np.flatnonzero(mesh.gather(marks))
        self.own = np.searchsorted(self.everybody, mesh.number[self.nodes])
        problem = ContactProblem(
            with_unit_diagonal(mesh.matrix(level.coarser.A)),
            np.zeros((mesh.size, coordinates.shape[1])),
            mesh.gather(coordinates),
            self.everybody,
            self._gathered(fine.frame[self.copies, 0]),
            np.zeros(self.everybody.size),
            None if fine.friction is None else fine.friction.with_each(lambda value: 0.0),
            prolongations=meshes.prolongations,
        )
        solver = ContactSolver(problem, "multigrid" if meshes.prolongations else "direct", progress=False)
        self.loop, self.correction = solver.loop, solver.correction

    def _gathered(self, values: np.ndarray) -> np.ndarray:
        """Return values (m, ...) at all ranks' candidates, from those (k, ...) at this one's; collective."""
        spread = np.zeros((len(self.mesh.number), *values.shape[1:]), values.dtype)
        spread[self.nodes] = values
        return self.mesh.gather(spread)[self.everybody]

    def update_normals(self, fine: NodeLoop) -> None:
        """Follow the new normals of the finer mesh; collective."""
        self.loop.update_normals(self._gathered(fine.frame[self.copies, 0]))
        self.correction.update_normals()

    def _solve(
        self, b: np.ndarray, given: Sequence[np.ndarray], slip_rate: float, record: Record
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Solve the gathered problem on every rank; collective."""
        mesh, whole = self.mesh, [self._gathered(values) for values in given]
        e, *found = super()._solve(mesh.gather(b), whole, slip_rate, record)
        gaps, status = (values[self.own] for values in found)
        return e[mesh.number], gaps, status
