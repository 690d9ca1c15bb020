"""The correction `algebraic`.

The same truncated cycles where there are no nested meshes, on pyamg's smoothed aggregation, with rigid
motions smoothed to least energy. Of the strengths and smoothers that pyamg has these were the quickest, with
contact: in the plane aggregates along strong connections (evolution measure: L. N. Olson, J. Schroder and
R. S. Tuminaro, Numer. Linear Algebra Appl. 17 (2010)) and W-cycles; in space, where such aggregates are small
and many, aggregates of whole neighbourhoods and V(2,2) cycles. On a cube of 57,000 unknowns, nu = 0.45, one
takes 2.9 + 1.1 s (set-up, solve) and 23 cycles, the other 1.1 + 0.55 s and 22.
"""

import numpy as np
import pyamg
from scipy.sparse import bsr_array

from model.node_loop.blocks import diagonal_positions
from model.node_loop.node_loop import NodeLoop
from model.problem.rigid_modes import RigidModes, rigid_motions
from model.solvers.galerkin_coarsening import Level, hierarchy
from model.solvers.truncated_multigrid import Cycle, Multigrid

STRENGTH = {
    2: ("evolution", {"epsilon": 4.0, "k": 2, "proj_type": "l2"}),
    3: ("symmetric", {"theta": 0.0}),
}


def algebraic(A: bsr_array, loop: NodeLoop, rigid: RigidModes) -> Multigrid:
    """Multigrid on aggregates of nodes, built by pyamg from the rigid motions of the body.

    Parameters
    ----------
    A : bsr_array (N d, N d)
    loop : NodeLoop
        The loop on A.
    rigid : RigidModes
        Of A and the loop's candidates.
    """
    N, d = loop.shape
    motions = rigid_motions(rigid.coordinates, turning=rigid.turning)
    motions[loop.uncoupled] = 0.0
    motions = motions.reshape(N * d, -1)
    aggregates = pyamg.smoothed_aggregation_solver(
        A,
        B=motions,
        strength=STRENGTH[d],
        smooth=("energy", {"krylov": "cg", "maxiter": 2, "degree": 1}),
        max_coarse=100,
    )
    finest = Level(loop.A, loop.inverse, diagonal_positions(loop.A))
    levels = hierarchy(finest, [bsr_array(level.P) for level in aggregates.levels[:-1]])
    coarse_modes = aggregates.levels[-1].B @ np.linalg.lstsq(motions, rigid.modes)[0]
    multigrid = Multigrid(loop, Cycle(levels), rigid, coarse_modes)
    multigrid.cycle.visits, multigrid.cycle.sweeps = (2, 1) if d == 2 else (1, 2)
    multigrid.name = "algebraic"
    return multigrid
