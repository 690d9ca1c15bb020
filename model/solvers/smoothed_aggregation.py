"""The correction `algebraic`.

The same truncated cycles where there are no nested meshes, on pyamg's smoothed aggregation. Of the strengths
and smoothers of prolongations that pyamg has, on triangles and tetrahedra of gmsh, with contact, these took
the fewest cycles: aggregates along strong connections (evolution measure: L. N. Olson, J. Schroder and R. S.
Tuminaro, Numer. Linear Algebra Appl. 17 (2010)), rigid motions smoothed to least energy, and W-cycles.
"""

import numpy as np
import pyamg
from scipy.sparse import bsr_array

from model.node_loop.blocks import BlockMatrix, diagonal_positions
from model.node_loop.node_loop import NodeLoop
from model.problem.rigid_modes import RigidModes, rigid_motions
from model.solvers.galerkin_coarsening import Level, coarsen
from model.solvers.truncated_multigrid import Multigrid


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
    hierarchy = pyamg.smoothed_aggregation_solver(
        A,
        B=motions,
        strength=("evolution", {"epsilon": 4.0, "k": 2, "proj_type": "l2"}),
        smooth=("energy", {"krylov": "cg", "maxiter": 2, "degree": 1}),
        max_coarse=100,
    )
    levels = [Level(loop.A, loop.inverse, diagonal_positions(loop.A))]
    for level in hierarchy.levels[:-1]:
        P = bsr_array(level.P)
        P.sort_indices()
        blocks = BlockMatrix(
            P.indptr.astype(np.uint64), P.indices.astype(np.uint32), np.ascontiguousarray(P.data)
        )
        levels.append(coarsen(levels[-1], blocks, P.shape[1] // P.blocksize[1]))
    coarse_modes = hierarchy.levels[-1].B @ np.linalg.lstsq(motions, rigid.modes)[0]
    multigrid = Multigrid(loop, levels, rigid, coarse_modes, visits=2)
    multigrid.name = "algebraic"
    return multigrid
