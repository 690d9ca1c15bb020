"""One constant matrix for a body that turns: the contact problem of an increment in axes that turn with it.

All that the loop or its corrections have made of the matrix (a factorisation, columns of its inverse,
hierarchies of meshes) then serves the whole run: only normals, loads and references are turned.
"""

from dataclasses import replace

import numpy as np

from model.dynamics.time_integrator import State, StepSolver, Touch


class TurnedSolver:
    """Solves for increments with a matrix that turns with the body.

    Parameters
    ----------
    solver : StepSolver
        With the matrix as it is at rest.
    """

    def __init__(self, solver: StepSolver):
        self.solver = solver

    def solve(
        self,
        turn: np.ndarray,
        b: np.ndarray,
        gap: np.ndarray,
        normal: np.ndarray,
        back: np.ndarray,
        before: State,
    ) -> Touch:
        """Find the increment, all in the axes of the road.

        Parameters
        ----------
        turn : (d, d)
            Rotation of the body since rest.
        b, gap, normal, back, before
            As for `StepSolver.solve`; gaps of either sign.
        """
        touch = self.solver.solve(b @ turn, gap, normal @ turn, back @ turn, before)
        return replace(touch, increment=touch.increment @ turn.T, force=touch.force @ turn.T)

    def face(self, normal: np.ndarray) -> None:
        """Leave the loop with the road's normals (n, d), by which records tell pressure from friction."""
        self.solver.take_planes(normal)


def mean_rotation(X: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Return the rotation (d, d) that brings nodes at X (N, d) nearest to x (N, d) (Kabsch)."""
    U, _, V = np.linalg.svd((x - x.mean(axis=0)).T @ (X - X.mean(axis=0)))
    U[:, -1] *= np.sign(np.linalg.det(U @ V))
    return np.asarray(U @ V)
