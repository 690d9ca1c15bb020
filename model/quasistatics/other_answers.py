"""Look for other answers than one that was found, from other starts.

Where friction is large, and on hills, a solution may be one of several, and nothing in it need show that (see
`model.solvers.uniqueness`). A search that finds none proves nothing either.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np

from checks import is_contact, refused, whole
from model.node_loop.status import Status
from model.problem.contact_problem import ContactProblem
from model.problem.rigid_modes import centred
from model.quasistatics.solve import solve
from model.solvers.contact_solver import Solution
from model.solvers.convergence_record import NotConverged

DIFFERENT = 1e-4  # of the largest force, or displacement: solves to 1e-10 of soft bodies differed by 1e-7
FAR = (0.01, 0.3)  # of the largest displacement: starts are so far from the answer, one after the other


def other_answers(
    contact: Any, solution: Solution, tries: int = 10, seed: int = 0, **options: Any
) -> list[Solution]:
    """Solve again from other starts, and return the answers that differ.

    All candidates stick at first, then those that touch, then these slip; then statuses are drawn at random,
    and by how much the body is pushed and strained.

    Parameters
    ----------
    contact : BodyOnRoad or ContactProblem
    solution : Solution
        What `solve` returned.
    tries : int
        Solves to make.
    seed : int
        The same seed draws the same starts.
    **options
        As for `solve`, which the solution came from.

    Returns
    -------
    list of Solution
        One for each answer that was found, that of `solution` left out; empty where there is no other, or
        none was found.

    Raises
    ------
    ValueError
        As `solve`, or if `solution` is none, `tries` no whole number >= 1, or `seed` none >= 0.

    Examples
    --------
    >>> import numpy as np
    >>> from scipy.sparse import csr_array
    >>> from model import ContactProblem, Status, other_answers, solve
    >>> problem = ContactProblem(  # a node that sticks, or goes aside and is lifted by that
    ...     A=csr_array([[1.0, -2.0], [-2.0, 5.0]]),
    ...     b=np.array([[0.7, -1.45]]),
    ...     coordinates=np.zeros((1, 2)),
    ...     contact_nodes=np.array([0]),
    ...     normal=np.array([[0.0, 1.0]]),
    ...     gap=np.array([0.1]),
    ...     friction=0.8,
    ... )
    >>> found = solve(problem)
    >>> others = other_answers(problem, found)
    >>> [Status(answer.status[0]).name for answer in (found, *others)]
    ['FREE', 'STICK']
    """
    if not isinstance(solution, Solution):
        raise refused("solution", "what solve returned", solution)
    whole(1, tries=tries)
    whole(0, seed=seed)
    if not isinstance(contact, ContactProblem):
        is_contact(contact)
    if solution.time is not None:
        options.setdefault("time", solution.time)
    found = [solution]
    for start, status in _starts(contact, solution, tries, np.random.default_rng(seed)):
        try:
            answer = solve(contact, start=start, start_status=status, **options)
        except NotConverged:
            continue
        if all(_differ(answer, other) for other in found):
            found.append(answer)
    return found[1:]


def _starts(
    contact: Any, solution: Solution, tries: int, random: np.random.Generator
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Displacements (N, d) and statuses (n,) to start from."""
    u, touches = solution.displacement, solution.status != Status.FREE
    problem = getattr(contact, "problem", contact)
    x, size = centred(problem.coordinates), np.abs(u).max()
    fixed = (np.full(touches.size, Status.STICK), Status.STICK * touches, Status.SLIP * touches)
    for k in range(tries):
        if k < len(fixed):
            yield u, fixed[k]
        else:
            push, strain = random.normal(size=x.shape[1]), random.normal(size=2 * x.shape[1:])
            away = FAR[k % len(FAR)] * size * (push + x @ strain)
            yield u + away, random.integers(0, 3, touches.size)


def _differ(one: Solution, other: Solution) -> bool:
    """Whether two solutions are not the same, but for rounding and what a body may do that nothing holds."""
    apart = [(one.contact_force, other.contact_force)]
    if one.unique and other.unique:
        apart.append((one.displacement, other.displacement))
    return any(np.abs(a - b).max() > DIFFERENT * max(np.abs(a).max(), np.abs(b).max()) for a, b in apart)
