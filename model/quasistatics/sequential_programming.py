"""Sequential quadratic programming: contact on the planes of a curved road, again and again.

Without friction J(u) = 1/2 u.A u - b.u is to be least over g(x + u) >= 0. Each iteration solves that on the
planes of the road at the nodes, with the road's own curvature as springs at the nodes that press on it,

    C = - p grad^2 g,

so that near the solution it converges as Newton's method does, and a body at the bottom of a hole, which the
planes alone would let slide, is held there (J. Nocedal and S. Wright, Numerical Optimization, 2006, ch. 18).
On hills C is negative. It counts there once the same nodes touch after whole steps, and as long as these
succeed; else it is 0, so that the programmes are convex.
Every step lowers an exact penalty function (`descent`), and is bounded where the planes leave a body free
(`proximal_springs`). At the solution no spring pulls, so that they and their stiffness do not matter.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from model.curved.tangent_planes import RoadPlanes, at_anchors, softness
from model.problem.rigid_modes import RigidModes
from model.quasistatics.approach import AWAY, CarriedOff, approach
from model.quasistatics.descent import Descent
from model.quasistatics.proximal_springs import ProximalSprings
from model.solvers.contact_solver import ContactSolver, Solution
from model.solvers.convergence_record import NotConverged, Record

ITERATIONS = 200  # ten times what the worst of twelve scenes on round and wavy roads takes
LOOSE = 0.1  # of the first residual is enough for cycles until the planes have settled: these leave as much
SHORT = 0.1  # of the steps that the planes want: those of which less is good are bounded
FALLS = 0.5  # of what forces turned: more is no step of Newton's method
# times a node's own softness: a hollow of 4,000 facets needs more than one, a bump was not seen from 1e51;
# both converge with 1e1 to 1e6
SOFTEST = 1e3
GONE = 10.0  # sizes: of bodies that rest in the end some have gone two
BENT = 1.0  # sizes by which strain moves a node: it is of the order of 1 then
IDLE = 8.0  # times the tolerance: what springs may still pull


@dataclass
class Posed:
    """What is to be solved: one load and one place of the road."""

    solver: ContactSolver
    rigid: RigidModes | None  # None: the body is held
    points: np.ndarray  # (n, d), candidates at zero displacement
    size: float  # of the body
    road: Any
    sticking: np.ndarray  # (n, d), nodes would stick at the points of the road nearest to it
    load: np.ndarray  # (N, d)
    tolerance: float
    marks: Callable[[np.ndarray], np.ndarray] | None  # as in `CurvedContact.solve`
    options: dict[str, Any]  # further arguments of `ContactSolver.solve`


class Beginning(NamedTuple):
    """Where to begin: displacement (N, d), pressures and status (n,), and the longest step in sizes.

    `held` is whether springs hold the body from the first.
    """

    u: np.ndarray
    pressure: np.ndarray
    status: np.ndarray
    longest: float
    held: bool


class SequentialProgramming:
    """Iterations from one beginning.

    Attributes
    ----------
    u : (N, d)
        Displacement that they have come to.
    planes : RoadPlanes
        The road where the nodes are then.
    """

    def __init__(self, posed: Posed, begin: Beginning):
        self.posed, self.begin, self.ranks = posed, begin, posed.solver.ranks
        self.loop, self.nodes = posed.solver.loop, posed.solver.problem.contact_nodes
        if posed.rigid is not None:
            self.loop.prescribe(posed.load, begin.u)
        self.u, self.guess, self.status, points = begin.u, begin.u, begin.status, posed.points
        sticking = None if self.loop.friction is None else posed.sticking
        at, self._soft = points + self.u[self.nodes], softness(self.loop)
        self.planes = RoadPlanes(posed.road, at, sticking, self._soft, posed.size, ranks=self.ranks)
        self.planes.bend(begin.pressure)
        anchor = self.planes.anchor
        self.places = anchor if posed.marks is None else posed.marks(anchor)
        force = self.ranks.sum(float(np.abs(self.ranks.own(posed.load)).sum()))
        self.hold = ProximalSprings(posed.rigid, force / posed.size, points.shape)
        if begin.held:
            self.hold.tighten()
        self.descent = Descent(self.loop, self.planes, points, posed.rigid)
        turns = self.ranks.any(bool((self.planes.normal != self.planes.normal[:1]).any()))
        self._enough = LOOSE if turns else 0.0
        self._springs = np.zeros_like(self.planes.springs)
        self._seen = GONE * posed.size  # how far it goes before it is looked whether it would ever rest
        self._convex, self._patience = 0, 0  # iterations without hills, to come and the last time
        self._solutions: list[Solution] = []

    def solve(self) -> Solution:
        """Iterate until every node that touches lies on the road, its force along the road's normal."""
        try:
            for _ in range(ITERATIONS):
                solution = self._on_planes()
                if solution is not None and self._advance(solution):
                    return self._all_iterations()
        finally:
            self.loop.put_springs(None)
        off = (self.planes.distances or [np.inf])[-1]
        raise self._not_converged(
            f"after {ITERATIONS} iterations nodes are {off:.1e} off it, or their forces still turn; take "
            "smaller load steps, or refine the body where the road is sharper than its elements."
        )

    def _on_planes(self) -> Solution | None:
        """The solution on the planes, with springs; None where these were too soft for there to be one."""
        posed, planes = self.posed, self.planes
        self._springs = planes.springs + self.hold.springs()
        bent = self.ranks.any(bool(self._springs.any()))
        try:
            solution = posed.solver.solve(
                normal=planes.normal,
                gap=planes.gaps(posed.points),
                tangential_reference=planes.anchor - posed.points,
                tolerance=posed.tolerance,
                springs=self._springs if bent else None,
                part=self._enough,
                start=self.guess,
                start_status=self.status,
                places=self.places,
                **posed.options,
            )
        except (NotConverged, np.linalg.LinAlgError):
            if planes.hills:
                self._leave_hills()
                planes.bend(self._solutions[-1].pressure_force)
                return None
            if not self.hold.needed():
                raise
            return None
        self._solutions.append(solution)
        return solution

    def _advance(self, solution: Solution) -> bool:
        """Go towards a solution and lay the planes there; return whether it was the solution on the road."""
        posed, planes, nodes = self.posed, self.planes, self.nodes
        changed = self.ranks.any(not np.array_equal(self.status, solution.status))
        self.status, force = solution.status, solution.contact_force
        moved = (solution.displacement - self.guess)[nodes]
        turn, pull = (-np.einsum("cab,cb->ca", by, moved) for by in (planes.springs, self._springs))
        scale = self.loop.load_size + self._norm(force)
        idle = self._norm(pull) <= IDLE * posed.tolerance * scale
        part, most = self._step(solution, pull)
        over = idle and self.u is solution.displacement and solution.residual <= posed.tolerance
        steady = np.inf if solution.history.size == 1 else 10 * posed.tolerance * scale
        unsteady = planes.unsteady
        if planes.follow(
            posed.points + self.u[nodes],
            at_anchors(self.loop, self.status),
            solution.pressure_force,
            steady if over else -1.0,
            (force, force + turn),
            posed.points + (solution.displacement if part > 0.0 else self.u)[nodes],
        ):
            return True
        if part < SHORT * most or (idle and part < 1.0):
            self.hold.tighten()
        elif part >= 1.0:
            self.hold.loosen()
        if planes.hills and (part == 0.0 or planes.unsteady > FALLS * unsteady):
            self._leave_hills()
        self._convex = max(self._convex - 1, 0)
        self._prepare()
        newton = self.loop.friction is None and part >= 1.0 and not (changed or self._convex)
        planes.bend(solution.pressure_force, hills=newton)
        return False

    def _step(self, solution: Solution, pull: np.ndarray) -> tuple[float, float]:
        """Go towards a solution as far as (1) of `descent` falls; return what part, and the most."""
        posed, wanted = self.posed, float(np.abs(solution.displacement - self.u).max())
        if posed.rigid is None:
            self.u = solution.displacement
            return 1.0, 1.0
        travelled = float(np.abs(self.u - self.begin.u).max())
        if travelled > self._seen and posed.rigid.count:
            self._seen = 2.0 * travelled
            self._require_rest(posed.rigid, solution.displacement, travelled)
        reach = self.begin.longest * (posed.size + travelled)
        longest = reach / (wanted or reach)
        self.u, part = self.descent.step(self.u, solution, pull, longest)
        return part, min(longest, 1.0)

    def _require_rest(self, rigid: RigidModes, u: np.ndarray, travelled: float) -> None:
        """Refuse a body that has gone too far, or that let go at u (N, d), rigid from now on, would do so.

        Without friction solves are quick, and one that yields may rest where a rigid one would fall.
        """
        posed = self.posed
        try:
            if travelled > AWAY * posed.size:
                motion = rigid.modes.T @ (self.u - self.begin.u).ravel()
                raise CarriedOff(rigid.in_words(motion), travelled)
            if self.loop.friction is not None:
                at, mu = posed.points + u[self.nodes], self.loop.coefficient
                approach(posed.road, at, rigid, posed.load, mu, self.planes.anchor, posed.size)
        except CarriedOff as gone:
            bent = float(np.abs(u - rigid.part_of(u)).max()) / posed.size
            if bent > BENT:
                raise self._not_converged(
                    f"the load deforms the body by {bent:.3g} times its size, where linear strain is no "
                    "model of it, and then carries it off; take a smaller load, or a stiffer body."
                ) from gone
            raise

    def _prepare(self) -> None:
        """Guess the next solution: nodes that touch are on the road."""
        planes, off = self.planes, self.planes.distances[-1]
        if off <= planes.near or off >= 0.5 * min(planes.distances[-2:-1], default=np.inf):
            self._enough = 0.0
        if self.loop.friction is None:  # from too deep no hollow is seen any more
            planes.softness = np.minimum(planes.softness, SOFTEST * self._soft)
        touches = np.flatnonzero(self.status)
        self.guess = self.u.copy()
        self.guess[self.nodes[touches]] = (planes.foot - self.posed.points)[touches]

    def _leave_hills(self) -> None:
        """Leave the hills out for some iterations, for longer each time: with them it went nowhere."""
        self._convex = self._patience = 2 * self._patience + 1

    def _norm(self, x: np.ndarray) -> float:
        """Euclidean norm of values at the candidates of all ranks."""
        return float(np.sqrt(self.ranks.sum(float(np.vdot(x, x)))))

    def _all_iterations(self) -> Solution:
        """The last solution with the gaps to the road, and what all iterations cost."""
        costs = ("sweeps", "cycles", "steps", "work_units", "seconds", "setup_seconds")
        total = {name: sum(getattr(s, name) for s in self._solutions) for name in costs}
        most = max(s.most_steps for s in self._solutions)
        return replace(self._solutions[-1], gap=self.planes.gap, most_steps=most, **total)

    def _not_converged(self, said: str) -> NotConverged:
        return NotConverged(
            f"No convergence on the curved road: {said}",
            Record(
                self.posed.tolerance,
                len(self._solutions),
                lambda: sum(s.sweeps for s in self._solutions),
                progress=False,
                history=self.planes.distances,
                cycles=sum(s.cycles for s in self._solutions),
            ),
        )
