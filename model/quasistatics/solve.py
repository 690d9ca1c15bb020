"""Solve a scene once, or step by step: the same two verbs whatever the road's shape."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from checks import finite, is_contact, is_tolerance
from model.problem.contact_problem import ContactProblem, shaped
from model.quasistatics import load_stepping
from model.quasistatics.curved_contact import CurvedContact
from model.ranks.solver_of import solver_of
from model.solvers.contact_solver import ContactSolver, Solution
from model.solvers.uniqueness import look_for_others
from model.tolerances import TOLERANCE

OF_SOLVER = ("order", "progress")


class AtRest:
    """A road that does not move, for load steps that ask where it is."""

    def __init__(self, road: Any):
        self.road = road

    def at(self, time: float) -> Any:
        """Return the road."""
        return self.road

    def carried(self, points: np.ndarray, start: float, end: float) -> np.ndarray:
        """Return where points (n, d) that go with it have come to be: they stay."""
        return points


def solve(
    contact: Any,
    correction: str = "auto",
    tolerance: float = TOLERANCE,
    time: float | None = None,
    **options: Any,
) -> Solution:
    """Solve a contact problem once.

    On a plane that is one problem. On any other road the problem is solved with a tangent plane at each
    candidate, and solved again where the nodes have come to be, until all that touch are on the road itself.

    Parameters
    ----------
    contact : BodyOnRoad or ContactProblem
        The load and the prescribed displacements of a BodyOnRoad are read anew, a ContactProblem has its own.
        A ContactProblem knows no road but the planes of its candidates.
    correction : str
        "none", "direct", "multigrid", "algebraic" or "auto".
    tolerance : float
        Natural residual to reach.
    time : float, optional
        Time (or load parameter) at which load, prescribed displacements and a moving road are taken; default
        what the user's constants hold now.
    **options
        `order` and `progress` of `ContactSolver`; `start`, `start_status`, `limit`, `slip_rate` of
        `ContactSolver.solve`.

    Returns
    -------
    Solution

    Raises
    ------
    ValueError, NotConverged
        As `ContactSolver` and its `solve`, and `CurvedContact`.

    Warns
    -----
    BeyondLinear
        Once for each BodyOnRoad, where linear strain is not true to the solution.
    SeveralAnswers
        Where friction is proved to let there be others; looked for by the correction "direct" alone.
    UnstableBalance
        Where a body without friction is proved to be balanced on a hill of a curved road; likewise.

    Examples
    --------
    >>> from forms import Elasticity, Isotropic, Support
    >>> from geometry import Body, RoundRoad, rectangle
    >>> from model import BodyOnRoad
    >>> elasticity = Elasticity(Body.from_grid(rectangle(2.0, 1.0, 8, 4)), Isotropic(E=1e3, nu=0.3))
    >>> support = Support(elasticity.body).fix("top", x=0.0, y=-0.02)
    >>> system = elasticity.system(elasticity.body_force((0.0, 0.0)), support)
    >>> contact = BodyOnRoad(system, "bottom", RoundRoad((1.0, 0.0), radius=5.0))
    >>> solution = solve(contact)
    >>> bool(solution.gap.min() == 0.0 and solution.contact_force[:, 1].sum() > 0.0)
    True
    """
    is_tolerance(tolerance)
    made = {name: options.pop(name) for name in OF_SOLVER if name in options}
    if isinstance(contact, ContactProblem):
        solver = ContactSolver(contact, correction, **made)
        solution = solver.solve(tolerance=tolerance, **options)
        look_for_others(solver, solution)
        return solution
    _is_linear(contact)
    time = None if time is None else _time(time)
    problem = replace(contact.problem, b=contact.system.load_at(time))
    solver = solver_of(problem, correction, **made)
    road, turning = contact.road, None
    if getattr(road, "flat", False) and not hasattr(road, "at"):
        solution = solver.solve(tolerance=tolerance, **options)
    else:
        if hasattr(road, "at"):
            now = 0.0 if time is None else time
            options["marks"], road = partial(road.carried, start=now, end=0.0), road.at(now)
        curved = CurvedContact(solver, contact.points)
        solution, turning = curved.solve(road, tolerance=tolerance, **options), curved.turning
    look_for_others(solver, solution, turning)
    contact.check_strain(solution)
    return replace(solution, time=time)


def follow(
    contact: Any,
    steps: Iterable[Any],
    correction: str = "auto",
    tolerance: float = TOLERANCE,
    **options: Any,
) -> Iterator[Solution]:
    """Solve for one load after the other, each from the last solution, sticking where the last step ended.

    Parameters
    ----------
    contact : BodyOnRoad, ContactProblem or ContactSolver
        The body starts at rest with sticking positions `problem.tangential_reference`.
    steps : iterable
        Of the load vectors (R, dim) of each step; or, for a BodyOnRoad, of times (or load parameters), at
        which loads, prescribed displacements and a moving road are taken; or of None: what the user's
        constants hold when the step is asked for.
    correction : str
        As for `solve`; a ContactSolver has its own.
    tolerance : float
        Natural residual of each step.
    **options
        As for `solve`.

    Yields
    ------
    Solution
        One a step.

    Warns
    -----
    BeyondLinear, SeveralAnswers, UnstableBalance
        As `solve`, at the first step of which it is true.

    Examples
    --------
    >>> from forms import Elasticity, Isotropic, Support
    >>> from geometry import Body, Plane, rectangle
    >>> from model import BodyOnRoad
    >>> elasticity = Elasticity(Body.from_grid(rectangle(2.0, 1.0, 4, 2)), Isotropic(E=1e3, nu=0.0))
    >>> support = Support(elasticity.body).fix("top", x=0.0, y=lambda t: -0.01 * t)
    >>> system = elasticity.system(elasticity.body_force((0.0, 0.0)), support)
    >>> contact = BodyOnRoad(system, "bottom", Plane(), friction=0.3)
    >>> [round(float(s.pressure_force.sum()), 9) for s in follow(contact, [0.5, 1.0])]
    [10.0, 20.0]
    """
    if isinstance(contact, ContactSolver):
        yield from _looked_at(contact, load_stepping.follow(contact, steps, tolerance, **options))
        return
    is_tolerance(tolerance)
    made = {name: options.pop(name) for name in OF_SOLVER if name in options}
    if isinstance(contact, ContactProblem):
        solver = ContactSolver(contact, correction, **made)
        yield from _looked_at(solver, load_stepping.follow(solver, steps, tolerance, **options))
        return
    _is_linear(contact)
    solver, road, turning = solver_of(contact.problem, correction, **made), contact.road, None
    times: list[float | None] = []
    if getattr(road, "flat", False):
        loads = (load for _, load in _loads(contact, steps, times))
        path = load_stepping.follow(solver, loads, tolerance, **options)
    else:
        road = road if hasattr(road, "at") else AtRest(road)
        curved = CurvedContact(solver, contact.points)
        path = curved.follow(road, _loads(contact, steps, times), tolerance=tolerance, **options)
        turning = curved.turning
    for solution in _looked_at(solver, path, turning):
        contact.check_strain(solution)
        yield replace(solution, time=times[-1])


def _looked_at(
    solver: Any, path: Iterable[Solution], turning: Callable[[], np.ndarray] | None = None
) -> Iterator[Solution]:
    """Yield the solutions of a path, and warn of the first that is one of several, or unstable."""
    said = False
    for solution in path:
        said = said or look_for_others(solver, solution, turning)
        yield solution


def _is_linear(contact: Any) -> None:
    """Refuse what is no contact (TypeError), or one of finite strain (ValueError)."""
    is_contact(contact)
    if contact.system.elastic is not None:
        raise ValueError(
            "The contact is of a body of finite strain (Hyperelasticity), which solve and follow would take "
            "for a linear one; take FiniteContact(contact).solve() or .follow(times)."
        )


def _time(time: Any) -> float:
    """Return a time as a float, or refuse what is no finite number (ValueError)."""
    finite(time=time)
    return float(time)


def _loads(
    contact: Any, steps: Iterable[Any], times: list[float | None]
) -> Iterator[tuple[float, np.ndarray]]:
    """Time and load (R, dim) of each step; `times` becomes those that were given."""
    if not isinstance(steps, Iterable):
        raise TypeError(f"steps is {steps!r}; give a list of times, or of load vectors.")
    for number, step in enumerate(steps, start=1):
        if step is None or np.ndim(step) == 0:
            times.append(None if step is None else _time(step))
            yield (number if step is None else _time(step)), contact.system.load_at(times[-1])
        else:
            times.append(None)
            yield number, shaped(f"The load of step {number}", step, contact.system.load.shape)
