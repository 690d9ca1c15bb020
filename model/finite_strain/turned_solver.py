"""One constant matrix for a body that turns: the contact problem of an increment in axes that turn with it.

At each node the axes turn with the body there: a matrix A becomes R A R^T, R block-diagonal, whose inverse is
R A^-1 R^T. So bending is followed as well as turning (warped stiffness: M. Mueller, J. Dorsey, L. McMillan,
R. Jagnow, B. Cutler, Symposium on Computer Animation 2002); what strain changes is not.

All that the loop or its corrections have made of the matrix (a factorisation, columns of its inverse,
hierarchies of meshes) then serves the whole run: only normals, loads and references are turned.
"""

from dataclasses import replace

import numpy as np
from numba import njit

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
        turn : (N, d, d)
            Rotation of the body at each node since rest.
        b, gap, normal, back, before
            As for `StepSolver.solve`; gaps of either sign.
        """
        at = turn[self.solver.loop.nodes]
        away, at_away = turn.swapaxes(1, 2), at.swapaxes(1, 2)
        touch = self.solver.solve(
            _turned(away, b), gap, _turned(at_away, normal), _turned(at_away, back), before
        )
        return replace(touch, increment=_turned(turn, touch.increment), force=_turned(at, touch.force))

    def face(self, normal: np.ndarray) -> None:
        """Leave the loop with the road's normals (n, d), by which records tell pressure from friction."""
        self.solver.take_planes(normal)


@njit(cache=True)
def _turned(turn, x):
    """Return vectors x (N, d) turned by rotations (N, d, d)."""
    y = np.zeros_like(x)
    for i in range(x.shape[0]):
        for a in range(x.shape[1]):
            for b in range(x.shape[1]):
                y[i, a] += turn[i, a, b] * x[i, b]
    return y
