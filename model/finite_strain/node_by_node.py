"""The paper's loop on the forces of finite strain: node after node, each with what is missing there by then.

Nodes that share no cell do not see each other, so that those of one colour are visited together.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from model.dynamics.time_integrator import State, StepSolver, Touch


class NodeByNode:
    """The loop of one step: Newton's step for each node alone, put in order with the road as ever.

    Parameters
    ----------
    solver : StepSolver
        Of the step's tangent (N d, N d), of which the nodes' own blocks are taken.
    missing : callable
        Of a displacement (N, d) and how the last sweep ended, or None: the force missing (N, d).
    """

    def __init__(self, solver: StepSolver, missing: Callable):
        self.solver, self.missing = solver, missing
        A = solver.loop.A
        self.colours = colours(A.indptr.astype(int), A.indices.astype(int))
        self._touch: Touch | None = None

    def sweep(
        self,
        last: State,
        u1: np.ndarray,
        b: np.ndarray,
        gap: np.ndarray,
        normal: np.ndarray,
        back: np.ndarray,
    ) -> Touch:
        """Visit each node once, from u1 (N, d) on; other parameters as for `StepSolver.solve`."""
        loop, u, status, still = self.solver.loop, u1.copy(), last.status.copy(), np.zeros_like(u1)

        def pose() -> None:
            moved = (u - u1)[loop.nodes]
            self.solver.pose(b, gap + np.einsum("ca,ca->c", normal, moved), normal, back - moved, last)

        for colour in self.colours:
            pose()
            e, loop.order = still.copy(), colour
            loop.sweep(e, status)
            u += e
            b = self.missing(u, self._touch)
        pose()
        touch = self.solver.outcome(still, status, back, loop.residual(still, status), 0)
        self._touch = replace(touch, increment=u - u1)
        return self._touch


def colours(indptr: np.ndarray, indices: np.ndarray) -> list[np.ndarray]:
    """Return the rows of a matrix in groups of which no two are coupled, each row in one.

    Parameters
    ----------
    indptr, indices
        As of `scipy.sparse.csr_array`, or of blocks.

    Examples
    --------
    >>> from scipy.sparse import csr_array
    >>> chain = csr_array(np.eye(4) + np.eye(4, k=1) + np.eye(4, k=-1))
    >>> [rows.tolist() for rows in colours(chain.indptr, chain.indices)]
    [[0, 2], [1, 3]]
    """
    colour = np.full(indptr.size - 1, -1)
    for i in range(colour.size):
        taken = set(colour[indices[indptr[i] : indptr[i + 1]]].tolist())
        colour[i] = next(k for k in range(len(taken) + 1) if k not in taken)
    return [np.flatnonzero(colour == k).astype(np.uint32) for k in range(colour.max() + 1)]
