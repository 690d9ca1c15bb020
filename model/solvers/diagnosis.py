"""Why a solve does not converge: the likeliest causes, with this run's numbers."""

from typing import Any

import numpy as np

from model.node_loop.contact_sweep import FREE, SLIP
from model.node_loop.node_loop import NodeLoop, length
from model.solvers.convergence_record import ASTRAY
from model.solvers.iterative_refinement import ROUNDING, rounding_floor

DIGITS = 16  # of a double
NEAR = 10.0  # times what rounding leaves: so near a solve takes what is left for rounding


def likely_causes(
    loop: NodeLoop,
    u: np.ndarray,
    status: np.ndarray,
    history: Any,
    tolerance: float,
    correction: str,
    held: bool,
) -> list[str]:
    """Name the three likeliest causes, the likeliest first, each with a remedy.

    Every suspect is weighed by the part of the residual that it explains, from 0 to 1: rounding by the
    residual that it alone may leave, stiffness by the digits of that which it has cost, time by how far as
    many tests again would come, friction and support by where the missing force sits: along the road at nodes
    that touch, or in its sum over the body.

    Parameters
    ----------
    loop : NodeLoop
        That holds the problem.
    u, status : (N, d), (n,)
        Where the solve ended.
    history : sequence of float
        Natural residuals, the last one that of `u`.
    tolerance : float
        Natural residual wanted.
    correction : str
        Its name.
    held : bool
        Supports and planes hold the body without friction: there is an answer, whatever the friction (see
        `uniqueness`).
    """
    residual = max(loop.residual(u, status), 1e-300)
    missing = loop.R
    floor = ROUNDING + rounding_floor(loop.A, u, loop.scale)
    diagonal = np.einsum("iaa->ia", loop.diagonal)[loop.loaded]
    span = float(diagonal.max(initial=1e-300) / max(diagonal.min(initial=np.inf), 1e-300))
    explained = 1.0 if residual <= min(NEAR * floor, ASTRAY) else min(floor / residual, 1.0)
    fall = float(np.min(history[: len(history) // 2 + 1]) / max(np.min(history), 1e-300))
    touching, slipping = np.count_nonzero(status != FREE), np.count_nonzero(status == SLIP)
    along = np.einsum("cab,cb->ca", loop.frame[:, 1:], missing[loop.nodes])[status != FREE]
    mu = float(np.max(loop.coefficient, initial=0.0))
    suspects = [
        (
            explained,
            f"rounding, which alone leaves a residual of about {floor:.0e} here: ask for no less",
        ),
        (
            explained * np.log10(span) / DIGITS,
            f"stiffness, since the diagonal of A spans a factor of {span:.1e}: bring hard and soft parts, "
            "or the sizes of cells, closer together",
        ),
        (
            min(np.log(max(fall, 1.0)) / max(np.log(residual / tolerance), 1.0), 1.0),
            f"time, the residual having fallen by a factor of {fall:.2g} over the last half of "
            f"{len(history)} tests with the correction {correction!r}: raise limit or change it",
        ),
        (
            (length(along) / max(length(missing), 1e-300)) ** 2 if mu > 0.0 else 0.0,
            f"friction, with mu = {mu:g} and {slipping} nodes in slip: take smaller load steps, for "
            + ("there is an answer, since " if held else "there may be none, since not even ")
            + "supports and planes hold the body without friction, "
            + ("but where friction is large there may be several" if held else "and friction may not"),
        ),
        (
            length(missing.sum(axis=0)) / max(float(np.linalg.norm(missing, axis=1).sum()), 1e-300),
            f"support, with {touching} of {status.size} candidates in contact: fix the body, should nothing "
            "else hold it",
        ),
    ]
    return [sentence for _, sentence in sorted(suspects, key=lambda suspect: -suspect[0])[:3]]
