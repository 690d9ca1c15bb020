"""Quasi-static load paths: friction remembers, so loads are applied step by step.

Within a step a node sticks at the tangential position it had at the end of the last step. That holds as well
for a node that touches only within the step: it sticks where it was at the step's beginning, not where it was
at the instant of touching. The error of that is first order in the size of the step; how the answer converges
with the number of steps is shown by the demos.
"""

from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np

from model.solvers.contact_solver import ContactSolver, Solution
from model.tolerances import TOLERANCE


def follow(
    solver: ContactSolver, loads: Iterable[np.ndarray], tolerance: float = TOLERANCE, **options: Any
) -> Iterator[Solution]:
    """Solve for one load after the other, each from the last solution, sticking where the last step ended.

    Parameters
    ----------
    solver : ContactSolver
        The body starts at rest with sticking positions `problem.tangential_reference`.
    loads : iterable of (N, d)
        The load vector of each step, e.g. `(k / 10 * b for k in range(1, 11))`.
    tolerance : float
        Natural residual of each step.
    **options
        Further arguments of `ContactSolver.solve`.

    Yields
    ------
    Solution
        One a step.
    """
    nodes = solver.problem.contact_nodes
    reference, options = solver.problem.tangential_reference, {"tolerance": tolerance, **options}
    for b in loads:
        solution = solver.solve(b, tangential_reference=reference, **options)
        yield solution
        reference = solution.displacement[nodes]
        options |= solution.next_start()
