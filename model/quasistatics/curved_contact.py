"""Static contact with a road that is not flat: the same solver, on planes that follow the nodes."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from model.curved.tangent_planes import RoadPlanes
from model.node_loop.status import Status
from model.solvers.contact_solver import ContactSolver, Solution
from model.solvers.convergence_record import NotConverged, Record
from model.tolerances import ON_ROAD, TOLERANCE

ITERATIONS = 200  # ten times what the worst of twelve scenes on round and wavy roads takes


class CurvedContact:
    """A contact problem on a curved road.

    Parameters
    ----------
    solver : ContactSolver
        Of the problem with the road's normals and gaps at the start; what it keeps serves all iterations and
        loads.
    points : (n, d)
        Positions of the candidates at zero displacement.

    Attributes
    ----------
    normal, foot : (n, d)
        Normals and nearest points of the road at the last solution.
    distances : list of float
        After each iteration of the last solution, how far nodes that touched were from the road, or others
        below it.

    Examples
    --------
    >>> from forms import Elasticity, Isotropic, Support
    >>> from geometry import Body, RoundRoad, half_cylinder
    >>> from model import BodyOnRoad
    >>> elasticity = Elasticity(Body.from_grid(half_cylinder(10.0)), Isotropic(E=210e3, nu=0.3))
    >>> support = Support(elasticity.body).fix("top", x=0.0)
    >>> system = elasticity.system(elasticity.total_force("top", (0.0, -1e3)), support)
    >>> road = RoundRoad(radius=20.0)
    >>> pressed = BodyOnRoad(system, "arc", road)
    >>> curved = CurvedContact(ContactSolver(pressed.problem), pressed.points)
    >>> round(float(curved.solve(road).contact_force[:, 1].sum()), 6)
    1000.0
    """

    def __init__(self, solver: ContactSolver, points: np.ndarray):
        self.solver, self.points = solver, np.asarray(points, dtype=np.float64)
        self.size = extent(solver.problem.coordinates, solver.ranks)
        self.normal = solver.problem.normal
        self.foot = self.points - solver.problem.gap[:, None] * self.normal
        self.distances: list[float] = []

    def solve(
        self,
        road: Any,
        tangential_reference: np.ndarray | None = None,
        start: np.ndarray | None = None,
        tolerance: float = TOLERANCE,
        marks: Callable[[np.ndarray], np.ndarray] | None = None,
        **options: Any,
    ) -> Solution:
        """Solve for one load and one place of the road.

        Parameters
        ----------
        road : Road
            Its `closest(points)` returns gap, normal and closest point.
        tangential_reference : (n, d), optional
            Displacement from which nodes stick: to the point of the road nearest to them then. Default
            the problem's. Where a road moves, add what it moved in the step.
        start : (N, d), optional
            First guess; default zero.
        tolerance : float
            Natural residual to reach; normals are found to ten times that.
        marks : callable, optional
            From points (n, d) of the road to where they lie on it at time 0, for friction that depends on
            that; default the points themselves.
        **options
            Further arguments of `ContactSolver.solve`, but `gap`.

        Returns
        -------
        Solution
            Its gaps are distances to the road itself; its sweeps, cycles, steps, work and seconds are of
            all iterations.

        Raises
        ------
        NotConverged
            If an iteration does not converge, or the iterations come to no end.
        """
        solver, points, nodes = self.solver, self.points, self.solver.problem.contact_nodes
        reference = (
            solver.problem.tangential_reference if tangential_reference is None else tangential_reference
        )
        at = points if start is None else points + start[nodes]
        sticking = None if solver.loop.friction is None else points + reference
        near = ON_ROAD * self.size
        planes = RoadPlanes(road, at, sticking, softness(solver.loop), near, ranks=solver.ranks)
        options["places"] = planes.anchor if marks is None else marks(planes.anchor)
        self.distances = planes.distances
        iterations: list[Solution] = []
        options["start"] = start
        while len(iterations) < ITERATIONS:
            solution = solver.solve(
                normal=planes.normal,
                gap=planes.gaps(points),
                tangential_reference=planes.anchor - points,
                tolerance=tolerance,
                **options,
            )
            iterations.append(solution)
            u, status = solution.displacement, solution.status
            nothing_to_do = solution.history.size == 1
            steady = np.inf if nothing_to_do else 10 * tolerance
            if planes.follow(points + u[nodes], status, solution.pressure_force, steady):
                self.normal, self.foot = planes.normal, planes.foot
                return _all_iterations(iterations, planes.gap)
            guess, in_contact = u.copy(), status != Status.FREE
            guess[nodes[in_contact]] = (planes.foot - points)[in_contact]
            options |= {"start": guess, "start_status": status}
        raise NotConverged(
            f"No convergence on the curved road: after {ITERATIONS} iterations nodes "
            f"are {self.distances[-1]:.1e} "
            "off it, or their forces still turn; take smaller load steps, or refine the body where the road "
            "is sharper than its elements.",
            Record(
                tolerance,
                ITERATIONS,
                lambda: sum(s.sweeps for s in iterations),
                progress=False,
                history=self.distances,
                cycles=sum(s.cycles for s in iterations),
            ),
        )

    def follow(
        self, road: Any, steps: Iterable[tuple[float, np.ndarray]], **options: Any
    ) -> Iterator[Solution]:
        """Solve for one time after the other: nodes stick where they were, and go where the road goes.

        Parameters
        ----------
        road : MovingRoad
            Its `at(time)` is the road at a time, `carried(points, start, end)` (n, d) where points that go
            with it come to be.
        steps : iterable of (time, load (N, d))
        **options
            Further arguments of `solve`.

        Yields
        ------
        Solution
            One a step.
        """
        nodes, reference = self.solver.problem.contact_nodes, self.solver.problem.tangential_reference
        before = 0.0
        for time, b in steps:
            sticking = road.carried(self.points + reference, before, time) - self.points
            before = time
            marks = partial(road.carried, start=time, end=0.0)
            solution = self.solve(road.at(time), tangential_reference=sticking, b=b, marks=marks, **options)
            yield solution
            reference = solution.displacement[nodes]
            options |= solution.next_start()


def extent(coordinates: np.ndarray, ranks: Any) -> float:
    """Return the longest extent along an axis of points (N, d) that ranks may share."""
    return max(ranks.max(x.max()) + ranks.max(-x.min()) for x in coordinates.T)


def softness(loop: Any) -> np.ndarray:
    """How far each candidate of a loop moves by a unit of force with its neighbours held, (n,)."""
    return 1.0 / np.einsum("caa->ca", loop.diagonal[loop.nodes]).mean(axis=1)


def _all_iterations(iterations: list[Solution], gap: np.ndarray) -> Solution:
    """Return the last solution with the gaps (n,) to the road, and what all iterations cost."""
    total = {
        name: sum(getattr(s, name) for s in iterations)
        for name in ("sweeps", "cycles", "steps", "work_units", "seconds", "setup_seconds")
    }
    return replace(iterations[-1], gap=gap, **total)
