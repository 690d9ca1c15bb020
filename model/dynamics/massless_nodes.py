"""Nodes that carry no mass: their own small contact problem, the same on all ranks that share the body."""

from types import SimpleNamespace
from typing import Any

import numpy as np
from scipy.sparse import bsr_array, csc_array, csr_array
from scipy.sparse.linalg import spsolve

from model.dynamics.moving_body import MovingBody
from model.dynamics.time_integrator import State, StepSolver, Touch
from model.problem.contact_problem import ContactProblem


class MasslessNodes:
    """The candidates of a body, all others at rest; gathered where many ranks share them.

    Parameters
    ----------
    body : MovingBody
    tolerance, slip_rate : float
        As for `StepSolver`.
    """

    def __init__(self, body: MovingBody, tolerance: float, slip_rate: float):
        ranks, nodes, d = body.ranks, body.contact_nodes, body.dim
        self.ranks = ranks
        counts = ranks.stacked(np.array([nodes.size]))
        first = int(ranks.before(nodes.size))
        self.here = slice(first, first + nodes.size)
        number = np.full(len(body.coordinates), -1)
        number[nodes] = first + np.arange(nodes.size)
        ranks.update(number)
        K, n = body.K, int(counts.sum())
        places = csr_array((np.arange(K.indices.size), K.indices, K.indptr))[nodes]  # of the blocks
        rows, columns = np.repeat(number[nodes], np.diff(places.indptr)), number[places.indices]
        kept = columns >= 0
        rows, columns, data = (ranks.stacked(x[kept]) for x in (rows, columns, K.data[places.data]))
        order = np.lexsort((columns, rows))
        indptr = np.concatenate([[0], np.cumsum(np.bincount(rows, minlength=n))])
        self.K = bsr_array((data[order], columns[order], indptr), shape=(n * d, n * d))
        gap, normal = (ranks.stacked(x) for x in body.gaps(np.zeros_like(body.coordinates)))
        coordinates = ranks.stacked(body.coordinates[nodes])
        rest, gap = np.zeros((n, d)), np.maximum(gap, 0.0)
        problem = ContactProblem(self.K, rest, coordinates, np.arange(n), normal, gap, body.friction)
        self.solver = StepSolver(problem, "direct", tolerance, slip_rate, body.places)

    @property
    def normal(self) -> np.ndarray:
        """Normals (n, d) of the planes of this rank's candidates."""
        return self.solver.loop.normal[self.here]

    def settle(
        self, missing: np.ndarray, gap: np.ndarray, normal: np.ndarray, state: State
    ) -> tuple[Touch, float]:
        """Return how the nodes come into equilibrium, and the energy that this adds; collective.

        Parameters
        ----------
        missing, gap, normal : (n, d), (n,), (n, d)
            Force missing, gaps and normals of the road at the state.
        state : State
        """
        b, gaps, normals, status = map(self.ranks.stacked, (missing, gap, normal, state.status))
        at: Any = state if len(status) == len(state.status) else SimpleNamespace(status=status)
        touch, here = self.solver.solve(b, gaps, normals, np.zeros_like(b), at), self.here
        e = touch.increment
        added = 0.5 * float(e.ravel() @ (self.K @ e.ravel())) - float(np.vdot(b, e))
        e, force, decided, gaps = (x[here].copy() for x in (e, touch.force, touch.status, touch.gap))
        return Touch(e, force, decided, gaps, touch.count, touch.residual, touch.cycles), added

    def under(self, force: np.ndarray) -> np.ndarray:
        """Return where forces (n, d) move the nodes if none of them is held, (n, d); collective."""
        whole = self.ranks.stacked(force)
        return np.asarray(spsolve(csc_array(self.K), whole.ravel()).reshape(whole.shape)[self.here])
