"""Static contact with a road that is not flat: the same solver, on planes that follow the nodes.

Without friction J(u) = 1/2 u.A u - b.u is to be least over g(x + u) >= 0. Each iteration solves that on the
planes of the road at the nodes, with the road's own curvature as springs at the nodes that press on it,

    C = - p grad^2 g    in hollows, 0 on hills,

which makes it sequential quadratic programming: near the solution it converges as Newton's method does, and a
body at the bottom of a hole, which the planes alone would let slide, is held there (J. Nocedal and S. Wright,
Numerical Optimization, 2006, ch. 18). Far from it steps are shortened (`descent`) or bounded
(`proximal_springs`), and a body that nothing holds is first brought to the road as a rigid one (`approach`).
At the solution no spring pulls, so that they and their stiffness do not matter there.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from model.curved.tangent_planes import RoadPlanes
from model.node_loop.status import Status
from model.quasistatics.approach import approach
from model.quasistatics.descent import part_of_step
from model.quasistatics.proximal_springs import ProximalSprings
from model.solvers.contact_solver import ContactSolver, Solution
from model.solvers.convergence_record import NotConverged, Record
from model.tolerances import ON_ROAD, TOLERANCE

ITERATIONS = 200  # ten times what the worst of twelve scenes on round and wavy roads takes
LOOSE = 0.1  # of the first residual is enough for cycles until the planes have settled: these leave as much
IDLE = 5.0  # times the tolerance: what springs may still pull
SHORT = 0.1  # steps of which only a smaller part is good are bounded


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
        solver, points, nodes = self.solver, self.points, self.solver.problem.contact_nodes
        problem, loop, size = solver.problem, solver.loop, self.size
        reference = problem.tangential_reference if tangential_reference is None else tangential_reference
        load = problem.b if options.get("b") is None else options["b"]
        u = np.zeros(problem.coordinates.shape) if start is None else start.copy()
        pressure = self._land(road, u, load, options.get("start_status"))
        sticking = None if loop.friction is None else points + reference
        near = ON_ROAD * size
        planes = RoadPlanes(road, points + u[nodes], sticking, softness(loop), near, ranks=solver.ranks)
        if pressure.any():
            options["start_status"] = np.where(pressure > 0.0, Status.SLIP, Status.FREE)
            planes.bend(pressure, size)
        options["places"] = planes.anchor if marks is None else marks(planes.anchor)
        options["start"], self.distances = u, planes.distances
        force = solver.ranks.sum(float(np.abs(solver.ranks.own(load)).sum()))
        hold = ProximalSprings(self.rigid, force / size, points.shape)
        iterations: list[Solution] = []
        turns = solver.ranks.any(bool((planes.normal != planes.normal[:1]).any()))
        enough = LOOSE if turns and solver.correction.name == "multigrid" else 0.0
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
                    if not hold.tighten():
                        raise
                    continue
                iterations.append(solution)
                status, moved = solution.status, (solution.displacement - options["start"])[nodes]
                turn = -np.einsum("cab,cb->ca", planes.springs, moved)
                pull = -np.einsum("cab,cb->ca", springs, moved)
                part = 1.0
                if self.rigid is not None:
                    part = part_of_step(loop, planes, points, u, solution, pull)
                u = u + part * (solution.displacement - u)
                nothing_to_do = solution.history.size == 1
                settled = planes.follow(
                    points + u[nodes],
                    status,
                    solution.pressure_force,
                    np.inf if nothing_to_do else 10 * tolerance,
                    solution.pressure_force[:, None] * planes.normal + part * turn,
                )
                idle = solver.ranks.max(float(np.linalg.norm(pull))) <= IDLE * tolerance * force
                solved = enough == 0.0 or solution.residual <= tolerance
                if settled and idle and part == 1.0 and solved:
                    self.normal, self.foot = planes.normal, planes.foot
                    return _all_iterations(iterations, planes.gap)
                if settled:
                    enough = 0.0
                if part < SHORT:
                    hold.tighten()
                else:
                    hold.loosen()
                guess, touches = u.copy(), np.flatnonzero(status)
                if not settled:
                    guess[nodes[touches]] = (planes.foot - points)[touches]
                planes.bend(solution.pressure_force, size)
                options |= {"start": guess, "start_status": status}
        finally:
            loop.put_springs(None)
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

    def _land(self, road: Any, u: np.ndarray, load: np.ndarray, status: Any) -> np.ndarray:
        """Bring a body that nothing holds, and that touches nothing yet, to the road; u (N, d) in place.

        Return the pressures (n,) that hold it there, about; zero if it need not move.
        """
        solver, pressure = self.solver, np.zeros(len(self.points))
        rigid, friction = self.rigid, solver.loop.friction
        if rigid is None or rigid.count == 0 or (status is not None and np.any(status)):
            return pressure
        at = self.points + u[rigid.nodes]
        mu = 0.0 if friction is None else solver.loop.told(pressure, at)[:, 1]
        motion, found = approach(road, at, rigid, load, mu, self.size)
        u += motion
        return found if motion.any() else pressure

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
