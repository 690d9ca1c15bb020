"""Static contact with a road that is not flat: the same solver, on planes that follow the nodes.

Each attempt is a sequence of quadratic programmes (`sequential_programming`); a body that nothing holds is
first brought to the road as a rigid one (`approach`).
"""

from collections.abc import Callable, Iterable, Iterator
from functools import partial
from typing import Any

import numpy as np

from model.curved.tangent_planes import RoadPlanes
from model.node_loop.status import Status
from model.one_rank import ONE_RANK
from model.quasistatics.approach import LONG, CarriedOff, approach
from model.quasistatics.sequential_programming import Beginning, Posed, SequentialProgramming
from model.solvers.contact_solver import ContactSolver, Solution
from model.solvers.convergence_record import NotConverged
from model.tolerances import TOLERANCE

HARD = 1e-200  # softness of what gives way nowhere
NO_LEAP = 0.1  # of the size: a step, where longer ones have leapt over what would have held the body


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
        self.pressure = np.zeros(len(points))
        self.rigid = solver.rigid if solver.ranks is ONE_RANK else None  # many ranks: held

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
        ValueError
            As `ContactSolver.solve`, or if the load carries the body off along the road.
        """
        problem = self.solver.problem
        reference = problem.tangential_reference if tangential_reference is None else tangential_reference
        load = problem.b if options.get("b") is None else options["b"]
        u = np.zeros(problem.coordinates.shape) if start is None else start.copy()
        status = options.pop("start_status", None)
        status = np.zeros(len(self.points)) if status is None else np.asarray(status)
        sticking = self.points + reference
        posed = Posed(
            self.solver, self.rigid, self.points, self.size, road, sticking, load, tolerance, marks, options
        )
        gone: CarriedOff | None = None
        lost: NotConverged | None = None
        for begin in self._beginnings(road, road.closest(sticking)[2], u, load, status):
            if isinstance(begin, CarriedOff):
                gone = gone or begin
                continue
            try:
                return self._settle(posed, begin)
            except CarriedOff as error:
                gone = gone or error
            except NotConverged as error:
                lost = lost or error
        failed = gone or lost
        assert failed is not None
        raise failed

    def _beginnings(
        self, road: Any, anchor: np.ndarray, u: np.ndarray, load: np.ndarray, status: np.ndarray
    ) -> Iterator[Beginning | CarriedOff]:
        """Where to begin, one after the other as long as the load carries the body off or nothing converges.

        From where it is on the road; from where it would rest if it were rigid; and from where it was put,
        for one that is soft may yield and rest where it would else fall. A body that would rest if it were
        rigid is not said to be carried off before it has been in short steps, which leap over nothing.

        Yields the beginnings, and where a rigid body is carried off, that it is.
        """
        nothing = np.zeros(status.size)
        if status.any():
            pressure = np.where(status > 0, self.pressure, 0.0)
            yield Beginning(u, pressure, status, LONG, held=bool(pressure.any()))
            u = np.zeros_like(u)
        try:
            motion, held = self._let_go(road, anchor, u, load)
        except CarriedOff as gone:
            yield gone
            yield Beginning(u, nothing, nothing, LONG, held=True)
        else:
            rest = u + motion, held, np.where(held > 0.0, Status.SLIP, Status.FREE)
            if motion.any():
                yield Beginning(*rest, LONG, held=bool(held.any()))
            yield Beginning(u, nothing, nothing, LONG, held=False)
            yield Beginning(*rest, NO_LEAP, held=bool(held.any()))

    def _let_go(
        self, road: Any, anchor: np.ndarray, u: np.ndarray, load: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """The motion (N, d) to where the body at u would rest if it were rigid, and pressures (n,) there."""
        rigid, friction, nothing = self.rigid, self.solver.loop.friction, np.zeros(len(self.points))
        if rigid is None or rigid.count == 0:
            return np.zeros_like(u), nothing
        at = self.points + u[rigid.nodes]
        mu = 0.0 if friction is None else self.solver.loop.told(nothing, at)[:, 1]
        return approach(road, at, rigid, load, mu, anchor, self.size)

    def _settle(self, posed: Posed, begin: Beginning) -> Solution:
        """Iterate from a beginning."""
        iterations = SequentialProgramming(posed, begin)
        planes, self.distances = iterations.planes, iterations.planes.distances
        solution = iterations.solve()
        self.normal, self.foot, self.pressure = planes.normal, planes.foot, solution.pressure_force
        self._last = posed.road, self.points + solution.displacement[iterations.nodes]
        return solution

    def turning(self) -> np.ndarray:
        """How the road resists the last solution as it turns its pressures, (n, d, d): negative on hills.

        It is looked at from so near that nothing but its own curvature counts.
        """
        road, at = self._last
        planes = RoadPlanes(road, at, None, np.full(len(at), HARD), self.size)
        planes.bend(self.pressure, hills=True)
        return planes.springs

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
