"""Why a solve does not converge: the likeliest causes, with this run's numbers."""

from typing import Any

import numpy as np

from model.node_loop.contact_sweep import FREE, SLIP
from model.node_loop.node_loop import NodeLoop
from model.solvers.iterative_refinement import rounding_floor

STILL_FALLING = 2.0  # times, over the last half of the residual tests


def likely_causes(
    loop: NodeLoop, u: np.ndarray, status: np.ndarray, history: Any, tolerance: float, correction: str
) -> list[str]:
    """Name the three likeliest causes, the likeliest first, each with a remedy.

    Every suspect is weighed by a number of the run: around 1 where it explains the failure by itself.

    Parameters
    ----------
    loop : NodeLoop
        Aimed at the problem.
    u, status : (N, d), (n,)
        Where the solve ended.
    history : sequence of float
        Natural residuals, the last one that of `u`.
    tolerance : float
        Natural residual wanted.
    correction : str
        Its name.
    """
    floor = rounding_floor(loop.A, u, loop.load_size + float(np.linalg.norm(loop.force)))
    diagonal = np.einsum("iaa->ia", loop.diagonal)[loop.loaded]
    span = float(diagonal.max(initial=1e-300) / max(diagonal.min(initial=np.inf), 1e-300))
    half = len(history) // 2 + 1
    fall = float(np.min(history[:half]) / np.min(history))
    touching, slipping = np.count_nonzero(status != FREE), np.count_nonzero(status == SLIP)
    mu = 0.0 if loop.friction is None else loop.friction.coefficient
    suspects = [
        (
            floor / tolerance,
            f"rounding, which alone leaves a residual of about {floor:.0e} here: ask for no less",
        ),
        (
            np.log10(span) / 12,
            f"stiffness, since the diagonal of A spans a factor of {span:.1e}: bring hard and soft parts, "
            "or the sizes of cells, closer together",
        ),
        (
            1.0 if fall > STILL_FALLING else 0.3,
            f"time, the residual having fallen by a factor of {fall:.2g} over the last half of "
            f"{len(history)} tests with the correction {correction!r}: raise limit or change it",
        ),
        (
            min(1.0, 0.3 + mu) if mu > 0.0 else 0.0,
            f"friction, with mu = {mu:g} and {slipping} nodes in slip: take smaller load steps, for where "
            "friction is large there may be several answers or none",
        ),
        (
            0.5 if touching <= loop.shape[1] else 0.2,
            f"support, with {touching} of {status.size} candidates in contact: fix the body, should nothing "
            "else hold it",
        ),
    ]
    return [sentence for _, sentence in sorted(suspects, key=lambda suspect: -suspect[0])[:3]]
