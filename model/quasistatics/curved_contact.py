"""Static contact with a road that is not flat: the same solver, on planes that follow the nodes.

Without friction J(u) = 1/2 u.A u - b.u is to be least over g(x + u) >= 0. Each iteration solves that on the
planes of the road at the nodes, with the road's own curvature as springs at the nodes that press on it,

    C = - p grad^2 g    in hollows, 0 on hills,

which makes it sequential quadratic programming: near the solution it converges as Newton's method does, and a
body at the bottom of a hole, which the planes alone would let slide, is held there (J. Nocedal and S. Wright,
Numerical Optimization, 2006, ch. 18). Every step lowers an exact penalty function (`descent`), and is bounded
where the planes leave a body free (`proximal_springs`); one that nothing holds is first brought to the road
as a rigid one (`approach`). At the solution no spring pulls, so that they and their stiffness do not matter.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from model.curved.tangent_planes import RoadPlanes, at_anchors, softness
from model.node_loop.status import Status
from model.quasistatics.approach import AWAY, LONG, CarriedOff, approach
from model.quasistatics.descent import Descent
from model.quasistatics.proximal_springs import ProximalSprings
from model.solvers.contact_solver import ContactSolver, Solution
from model.solvers.convergence_record import NotConverged, Record
from model.tolerances import TOLERANCE

ITERATIONS = 200  # ten times what the worst of twelve scenes on round and wavy roads takes
LOOSE = 0.1  # of the first residual is enough for cycles until the planes have settled: these leave as much
NO_LEAP = 0.1  # of the size: a step, where longer ones have leapt over what would have held the body
SHORT = 0.1  # of the steps that the planes want: those of which less is good are bounded
IDLE = 8.0  # times the tolerance: what springs may still pull


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
        self.rigid = solver.rigid if isinstance(solver, ContactSolver) else None  # many ranks: held

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
        settle = partial(self._settle, road, self.points + reference, load, tolerance, marks, options)
        gone: CarriedOff | None = None
        for begin in self._beginnings(road, road.closest(self.points + reference)[2], u, load, status):
            if isinstance(begin, CarriedOff):
                gone = gone or begin
                continue
            try:
                return settle(*begin)
            except CarriedOff as error:
                gone = gone or error
            except NotConverged:
                if gone is None:
                    raise
        assert gone is not None
        raise gone

    def _beginnings(
        self, road: Any, anchor: np.ndarray, u: np.ndarray, load: np.ndarray, status: np.ndarray
    ) -> Iterator[Any]:
        """Where to begin, one after the other as long as the load carries the body off.

        From where it is on the road; from where it would rest if it were rigid; and from where it was put,
        for one that is soft may yield and rest where it would else fall. A body that would rest if it were
        rigid is not said to be carried off before it has been in short steps, which leap over nothing.

        Yields u, pressures, status, and the longest step in sizes.
        """
        nothing = np.zeros(status.size)
        if status.any():
            yield u, np.where(status > 0, self.pressure, 0.0), status, LONG
            u = np.zeros_like(u)
        try:
            motion, held = self._let_go(road, anchor, u, load)
        except CarriedOff as gone:
            yield gone
            yield u, nothing, nothing, LONG
        else:
            rest = u + motion, held, np.where(held > 0.0, Status.SLIP, Status.FREE)
            if motion.any():
                yield *rest, LONG
            yield u, nothing, nothing, LONG
            yield *rest, NO_LEAP

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

    def _settle(
        self,
        road: Any,
        sticking: np.ndarray,
        load: np.ndarray,
        tolerance: float,
        marks: Any,
        options: dict[str, Any],
        u: np.ndarray,
        pressure: np.ndarray,
        status: np.ndarray,
        longest_step: float,
    ) -> Solution:
        """Iterate from u (N, d), pressures and status (n,); nodes stick nearest to `sticking` (n, d)."""
        solver, points, size = self.solver, self.points, self.size
        loop, nodes = solver.loop, solver.problem.contact_nodes
        if self.rigid is not None:
            loop.prescribe(load, u)
        planes = RoadPlanes(
            road,
            points + u[nodes],
            None if loop.friction is None else sticking,
            softness(loop),
            size,
            ranks=solver.ranks,
        )
        planes.bend(pressure)
        options = options | {"start": u, "start_status": status}
        options["places"] = planes.anchor if marks is None else marks(planes.anchor)
        self.distances = planes.distances
        force = solver.ranks.sum(float(np.abs(solver.ranks.own(load)).sum()))
        hold = ProximalSprings(self.rigid, force / size, points.shape)
        if pressure.any():  # it rests, about: far from there it has no business
            hold.tighten()
        arrived, descent = u.copy(), Descent(loop, planes, points)
        iterations: list[Solution] = []
        turns = solver.ranks.any(bool((planes.normal != planes.normal[:1]).any()))
        enough = LOOSE if turns else 0.0
        try:
            for _ in range(ITERATIONS):
                springs = planes.springs + hold.springs()
                bent = solver.ranks.any(bool(springs.any()))
                try:
                    solution = solver.solve(
                        normal=planes.normal,
                        gap=planes.gaps(points),
                        tangential_reference=planes.anchor - points,
                        tolerance=tolerance,
                        springs=springs if bent else None,
                        part=enough,
                        **options,
                    )
                except (NotConverged, np.linalg.LinAlgError):
                    if not hold.needed():
                        raise
                    continue
                iterations.append(solution)
                status, there = solution.status, solution.displacement
                moved = (there - options["start"])[nodes]
                turn, pull = (-np.einsum("cab,cb->ca", by, moved) for by in (planes.springs, springs))
                reach = np.inf
                if self.rigid is not None:
                    travelled = float(np.abs(u - arrived).max())
                    if travelled > AWAY * size and self.rigid.count:
                        motion = self.rigid.modes.T @ (u - arrived).ravel()
                        raise CarriedOff(self.rigid.in_words(motion), travelled)
                    reach = longest_step * (size + travelled)
                    longest = reach / float(np.abs(there - u).max() or reach)
                    lower = descent.step(u, solution, pull, longest)
                    there = u if lower is None else lower
                wanted, gone = (float(np.abs(x - u).max()) for x in (solution.displacement, there))
                short = gone < SHORT * min(wanted, reach)
                u, whole = there, there is solution.displacement
                nothing_to_do = solution.history.size == 1
                scale = loop.load_size + _norm(solution.contact_force, solver.ranks)
                idle = _norm(pull, solver.ranks) <= IDLE * tolerance * scale
                over = idle and whole and solution.residual <= tolerance
                steady = np.inf if nothing_to_do else 10 * tolerance * scale
                if planes.follow(
                    points + u[nodes],
                    at_anchors(loop, status),
                    solution.pressure_force,
                    steady if over else -1.0,
                    solution.contact_force,
                    turn,
                    points + solution.displacement[nodes],
                ):
                    self.normal, self.foot = planes.normal, planes.foot
                    self.pressure = solution.pressure_force
                    return _all_iterations(iterations, planes.gap)
                off = self.distances[-1]
                if off <= planes.near or off >= 0.5 * min(self.distances[-2:-1], default=np.inf):
                    enough = 0.0
                if short or (idle and not whole):
                    hold.tighten()
                elif whole:
                    hold.loosen()
                guess, touches = u.copy(), np.flatnonzero(status)
                guess[nodes[touches]] = (planes.foot - points)[touches]
                planes.bend(solution.pressure_force)
                options |= {"start": guess, "start_status": status}
        finally:
            loop.put_springs(None)
        raise NotConverged(
            f"No convergence on the curved road: after {ITERATIONS} iterations nodes "
            f"are {self.distances[-1] if self.distances else np.inf:.1e} "
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


def _norm(x: np.ndarray, ranks: Any) -> float:
    """Euclidean norm of values at the candidates of all ranks."""
    return float(np.sqrt(ranks.sum(float(np.vdot(x, x)))))


def _all_iterations(iterations: list[Solution], gap: np.ndarray) -> Solution:
    """Return the last solution with the gaps (n,) to the road, and what all iterations cost."""
    total = {
        name: sum(getattr(s, name) for s in iterations)
        for name in ("sweeps", "cycles", "steps", "work_units", "seconds", "setup_seconds")
    }
    return replace(iterations[-1], gap=gap, **total)
