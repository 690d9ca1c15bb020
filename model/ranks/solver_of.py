"""The solver of a contact problem, on one rank or shared by many."""

from typing import Any

from model.problem.contact_problem import ContactProblem
from model.ranks.shared_problem import SharedProblem
from model.ranks.shared_solver import SharedSolver
from model.solvers.contact_solver import ContactSolver


def solver_of(
    problem: ContactProblem,
    correction: str = "auto",
    order: Any = None,
    progress: bool = True,
    steps: bool = False,
) -> Any:
    """Return what solves a problem.

    Parameters
    ----------
    problem : ContactProblem or SharedProblem
    correction, order, progress
        As for `ContactSolver`.
    steps : bool
        Whether its loads are those of time steps, for which coarser meshes give ranks no first guess.

    Returns
    -------
    ContactSolver or SharedSolver

    Raises
    ------
    ValueError
        As they do, and for an order on several ranks.
    """
    if not isinstance(problem, SharedProblem):
        return ContactSolver(problem, correction, order, progress)
    trouble = "" if order is None else "On several ranks nodes are visited in their order; leave `order` out."
    problem.exchanges[0].agree(trouble)
    return SharedSolver(problem, correction, progress, nested=not steps)
