"""What all time integrators share: the state, the start, and one contact problem a step.

Every scheme guesses the end of the step, and the contact loop finds the increment from the guess:

    A e = b + contact forces,    g(guess) + n . e >= 0,                                                (1)

with A constant, b the force that is missing at the guess, and sticking where e brings a node back to where it
was. So the loop sees forces and small displacements, whatever dt and however far the body has travelled.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, field
from time import perf_counter
from typing import Any

import numpy as np

from checks import array, instance, is_tolerance, positive, refused, whole
from model.dynamics.contact_update import advance, confirm_contact, contact_work, forget_rounding
from model.dynamics.initial_acceleration import consistent_acceleration
from model.dynamics.moving_body import MovingBody
from model.node_loop.status import Status
from model.problem.contact_problem import ContactProblem
from model.problem.held_below_road import held_below_road
from model.ranks.solver_of import solver_of
from model.solvers.convergence_record import Record
from model.solvers.iterative_refinement import ROUNDING
from model.solvers.static_condensation import Condensation
from model.solvers.truncated_multigrid import Multigrid
from model.tolerances import ON_ROAD, TOLERANCE

LIMIT = 100_000  # residual tests in one step, for the loop alone; corrections give up by themselves
# Unknowns in space beyond which a step is quicker by multigrid than by back-substitution. Processor time of
# a step to 1e-8, direct / multigrid in ms: quarter of a half ball of 2,571 unknowns 1.1 / 2.7, of 17,811
# 20 / 20, of 132,387 404 / 167 (set-up 28 / 0.7 s). In the plane never: ring of 75,264 unknowns 35 / 100.
MULTIGRID_PAYS = 20_000
# Natural residual asked of a step's small problem, whatever the tolerance. The body is moved by the forces
# that the small problem finds, its nodes are put where they stick: what lies between is work that comes from
# nowhere. 1e-11 let the noise of a block at rest grow tenfold in 2,500 steps until it was as large.
SMALL = 1e-14


@dataclass
class Work:
    """What the forces did in one step, by the mean force that the scheme works with.

    Attributes
    ----------
    normal, friction : float
        Work of the road on the body along the normals and along the surface.
    damping : float
        Work of the damping forces, never positive.
    load : float
        Work of changing loads beyond that of the scheme's mean load.
    road : float
        Work that a road does by moving: forces times the way that it carries what they act on.
    impulse : (d,)
        Impulse of the road.
    numerical : float
        What the scheme says its own step adds to the energy; NaN if it has no closed form.
    """

    normal: float = 0.0
    friction: float = 0.0
    damping: float = 0.0
    load: float = 0.0
    impulse: Any = 0.0
    numerical: float = 0.0
    road: float = 0.0


@dataclass
class State:
    """Where a body is after a step; N nodes, n of which may touch, d dimensions.

    Attributes
    ----------
    step : int
    time : float
    displacement, velocity, acceleration : (N, d)
    contact_force : (n, d)
        Of the road on the body.
    gap : (n,)
        Distance to the road, >= 0, exactly 0 in contact.
    status : (n,)
        0 free, 1 slip (and every frictionless contact), 2 stick.
    mean_force : (n, d)
        The scheme's mean contact force over the step.
    work : Work
        What was done in the step that ended here.
    residual : float
        Natural residual of the step.
    cycles : int
        Corrections made beyond the first.
    count : int
        Nodes that touch.
    seconds : float
        Time that the step took.
    memory : (n, d)
        What else a scheme remembers at the nodes that may touch.
    """

    step: int
    time: float
    displacement: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray
    contact_force: np.ndarray
    gap: np.ndarray
    status: np.ndarray
    mean_force: np.ndarray
    work: Work = field(default_factory=Work)
    residual: float = 0.0
    cycles: int = 0
    count: int = 0
    seconds: float = 0.0
    memory: np.ndarray | None = None


@dataclass
class Touch:
    """How a step's contact problem ended.

    Attributes
    ----------
    increment : (N, d)
        From the guess.
    force : (n, d)
        Of the road on the body.
    status, gap : (n,)
    count : int
        Nodes that touch.
    residual : float
    cycles : int
    """

    increment: np.ndarray
    force: np.ndarray
    status: np.ndarray
    gap: np.ndarray
    count: int
    residual: float
    cycles: int


class StepSolver:
    """The contact problem (1) of every step, with one matrix and what can be kept of it.

    Parameters
    ----------
    problem : ContactProblem or SharedProblem
        Its matrix, symmetric positive definite, candidates and friction law.
    correction : str
        As for `ContactSolver`.
    tolerance : float
        Natural residual of each step; where a step moves so far that rounding alone causes more, what
        rounding causes is good enough.
    slip_rate : float
        1/dt, which makes speeds of slips.
    places : callable, optional
        Of the state before the step: points (n, d) of the road at which nodes stick, for friction that
        depends on them.
    """

    def __init__(
        self,
        problem: ContactProblem,
        correction: str,
        tolerance: float,
        slip_rate: float,
        places: Callable[[Any], np.ndarray] | None = None,
    ):
        self.places = places
        solver = solver_of(problem, correction, progress=False, steps=True)
        self.tolerance, self.slip_rate, self.ranks = tolerance, slip_rate, solver.ranks
        self.loop, self.correction, self.take_planes = solver.loop, solver.correction, solver.take_planes
        largest = self.ranks.max(float(np.abs(self.loop.diagonal).max(initial=0.0)))
        self._rounding = 2 * ROUNDING * largest  # of the forces, for a unit of way

    def solve(
        self, b: np.ndarray, gap: np.ndarray, normal: np.ndarray, back: np.ndarray, before: State
    ) -> Touch:
        """Solve for one step.

        Parameters
        ----------
        b : (N, d)
            Force missing at the guess.
        gap, normal : (n,), (n, d)
            Gap at the guess, negative where the guess penetrates, and the road's normals.
        back : (n, d)
            What brings each candidate back to where it was at the step's beginning.
        before : State
            Statuses to start from.

        Raises
        ------
        NotConverged
            If the tolerance is not reached.
        """
        loop, correction = self.loop, self.correction
        self.pose(b, gap, normal, back, before)
        e, status, cycles = np.zeros_like(b), before.status.copy(), 0
        if isinstance(correction, Condensation):
            correction.improve(e, status, b.copy(), SMALL)
        else:
            status = loop.start(e, status)
        residual = loop.residual(e, status)
        if not residual <= self.tolerance:
            first = loop.sweeps
            rounding = self._rounding * np.sqrt(self.ranks.dot(e, e)) / (loop.scale or 1.0)
            since = f" from time {before.time:.4g}" if hasattr(before, "time") else ""
            causes = [f"friction and contact change too much in the step{since}: take smaller steps"]
            if loop.friction is not None and loop.friction.weakens:
                causes.append(f"{loop.friction}, which weakens with the slip faster than the body can follow")
            record = Record(
                max(self.tolerance, rounding),
                LIMIT,
                lambda: loop.sweeps - first,
                progress=False,
                causes=lambda tests: causes,
                ranks=self.ranks,
            )
            correction.solve(e, status, record)
            residual, cycles = record.history[-1], record.cycles
        return self.outcome(e, status, back, residual, cycles)

    def pose(
        self, b: np.ndarray, gap: np.ndarray, normal: np.ndarray, back: np.ndarray, before: State
    ) -> None:
        """Give the loop a problem; parameters as for `solve`."""
        loop = self.loop
        self.take_planes(normal)
        loop.slip_rate = self.slip_rate
        told = None
        if loop.friction is not None:
            places = self.places(before) if self.places is not None and loop.friction.by_place else None
            told = loop.told((before.status == Status.SLIP).astype(np.float64), places)
        loop.set_load(b, gap, back, told)

    def outcome(
        self, e: np.ndarray, status: np.ndarray, back: np.ndarray, residual: float, cycles: int
    ) -> Touch:
        """Return how a problem ended, from the loop's last residual."""
        loop, after = self.loop, np.empty(status.size)
        law = None if loop.friction is None else loop.friction.address
        count = self.ranks.sum(confirm_contact(loop.contact, e, loop.force, law, status, after))
        force, _ = loop.reaction(e[loop.nodes] - back)
        return Touch(e, force, status, loop.part * after, count, residual, cycles)


class TimeIntegrator(ABC):
    """A scheme that carries a body from step to step, contact exact at the end of each.

    On a road that is not a plane it is made one whose steps end on the road itself, see `curved_steps`.

    Parameters
    ----------
    body : MovingBody
    dt : float
        Time step.
    correction : str
        "direct" (one factorisation serves the run), another of `ContactSolver`, or "auto": multigrid on
        nested meshes in space of more than 20,000 unknowns, whose cycles are quicker than
        back-substitutions, and on all nested meshes that ranks share, else direct.
    tolerance : float
        Natural residual of each step.

    Raises
    ------
    ValueError
        If dt is not a positive finite number, or the body is one of finite strain and the scheme is not.
    """

    name = ""
    finite_strain = False
    part_inside = 1.0  # of the tolerance that the contact problems within a step may miss
    rounding = ON_ROAD  # of the body's size, in gaps

    def __new__(cls, body: MovingBody, *args: Any, **options: Any) -> "TimeIntegrator":
        """Choose by the road."""
        if not isinstance(body, MovingBody):
            raise refused("body", "a MovingBody, say MovingBody.from_contact(contact)", body)
        if getattr(body.road, "flat", False):
            return super().__new__(cls)
        from model.dynamics.curved_steps import on_curved_road  # which builds on this file

        return super().__new__(on_curved_road(cls))

    def __init__(self, body: MovingBody, dt: float, correction: str = "auto", tolerance: float = TOLERANCE):
        positive(dt=dt)
        is_tolerance(tolerance)
        if body.finite_strain and not self.finite_strain:
            raise ValueError(
                f"{type(self).__name__} is for linear strain; a FiniteBody takes EnergyMomentum."
            )
        self.body, self.dt = body.in_steps(dt), float(dt)
        self.correction = choose(body) if correction == "auto" else correction
        self.tolerance = tolerance
        self.M = self.mass()
        self.posed: Any = None  # guess, missing force and outcome of the last contact problem
        began = perf_counter()
        self.solvers = {"step": self.step_solver(self.effective_matrix())}
        self.setup_seconds = perf_counter() - began

    def mass(self) -> Any:
        """Return the mass matrix that the scheme moves."""
        return self.body.M

    @abstractmethod
    def effective_matrix(self) -> Any:
        """Return A of (1)."""

    @abstractmethod
    def step(self, before: State) -> State:
        """Return the state one step later; `before` stays as it is."""

    def step_solver(self, A: Any, friction: bool = True) -> StepSolver:
        """Set up the contact problems of the whole body with the matrix A."""
        body = self.body
        rest = np.zeros_like(body.coordinates)
        gap, normal = body.gaps(rest)
        problem = body.problem(A, rest, body.contact_nodes, normal, np.maximum(gap, 0.0), friction)
        tolerance = self.part_inside * self.tolerance
        solver = StepSolver(problem, self.correction, tolerance, 1.0 / self.dt, body.places)
        if isinstance(solver.correction, Multigrid):
            solver.correction.take_time_steps()
        return solver

    def start(self, displacement: np.ndarray | None = None, velocity: np.ndarray | None = None) -> State:
        """Return the state at time 0, with accelerations and contact forces in keeping with it.

        Parameters
        ----------
        displacement, velocity : (N, d), optional
            Default zero. Prescribed unknowns start where, and as fast as, their motion does at time 0.

        Raises
        ------
        ValueError
            If they do not fit the body or are not finite, a prescribed unknown is given another displacement,
            or a node starts below the road.
        """
        body = self.body
        u, v = _initial("displacement", displacement, body), _initial("velocity", velocity, body)
        if body.supported:
            g = body.prescribed_at(0.0)
            off = np.where(body.prescribed, np.abs(u - g), 0.0)
            trouble = ""
            if displacement is not None and off.max() > ON_ROAD * body.size:
                node, axis = np.unravel_index(int(np.argmax(off)), off.shape)
                trouble = (
                    f"The initial displacement of node {node} is {u[node, axis]:g} along {'xyz'[axis]}, but "
                    f"{g[node, axis]:g} is prescribed there; start where the supports are."
                )
            body.ranks.agree(trouble)
            u = np.where(body.prescribed, g, u)
            v = np.where(body.prescribed, body.prescribed_rates(0.0, self.dt)[0], v)
        gap, normal = body.gaps(u)
        trouble = ""
        if not gap.min(initial=0.0) > -ON_ROAD * body.size:
            trouble = (
                f"Node {body.contact_nodes[np.argmin(gap)]} starts {-gap.min():g} below the road; "
                "move the body or the road so that every gap is >= 0."
            )
        body.ranks.agree(trouble)
        gap = np.where(gap < ON_ROAD * body.size, 0.0, gap)
        a, force, status = self.accelerate(u, v, gap, normal)
        count = body.ranks.sum(int(np.count_nonzero(status)))
        return self.supported(State(0, 0.0, u, v, a, force, gap, status, force.copy(), count=count))

    def accelerate(
        self, u: np.ndarray, v: np.ndarray, gap: np.ndarray, normal: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return accelerations (N, d), contact forces (n, d) and status (n,) at the start."""
        return consistent_acceleration(self.body, u, v, gap, normal, self.dt, self.correction)

    def run(self, state: State, steps: int) -> State:
        """Return the state so many steps later; see `integrate` for runs that report and record."""
        instance(State, state=state)
        whole(0, steps=steps)
        for _ in range(steps):
            state = self.step(state)
        return state

    def touch(self, before: State, moved: np.ndarray, b: np.ndarray, solver: str = "step") -> Touch:
        """Find the increment from the guess `before.displacement + moved` for the missing force b (N, d)."""
        gap, normal = self.ground(before)
        there = moved[self.body.contact_nodes]
        advance(gap, normal, there)
        b = self.driven(before, moved, b, solver)
        touch = self.solvers[solver].solve(b, gap, normal, -there, before)
        self.posed = moved, b, touch
        return touch

    def way(self, before: State) -> np.ndarray | float:
        """How far (n, d) a moving road carries the nodes that may touch in the step after `before`."""
        body = self.body
        if not body.road_moves:
            return 0.0
        was = body.positions(before.displacement)
        return body.carried(was, before.step * self.dt, (before.step + 1) * self.dt) - was

    def driven(self, before: State, moved: np.ndarray, b: np.ndarray, solver: str) -> np.ndarray:
        """Return b (N, d) such that prescribed unknowns end the step where their motion is then."""
        body = self.body
        if not body.supported:
            return b
        diagonal = np.einsum("naa->na", self.solvers[solver].loop.diagonal)
        missing = body.prescribed_at((before.step + 1) * self.dt) - before.displacement - moved
        own, driven = body.ranks.own, b.copy()
        driven[: len(diagonal)] = np.where(own(body.prescribed), diagonal * own(missing), own(b))
        return driven

    def supported(self, state: State) -> State:
        """Return the state, displacement, velocity and acceleration of supports set in place.

        Raises
        ------
        ValueError
            If supports hold a node below the road.
        """
        body = self.body
        if body.supported:
            rates = body.prescribed_rates(state.time, self.dt)
            known = (body.prescribed_at(state.time), *rates)
            for values, prescribed in zip((state.displacement, state.velocity, state.acceleration), known):
                values[body.prescribed] = prescribed[body.prescribed]
            body.ranks.agree(self._buried(state))
        return state

    def _buried(self, state: State) -> str:
        """Say which node that may touch supports hold below the road."""
        body, u = self.body, state.displacement
        some = body.led
        if not some.size:
            return ""
        nodes, road = body.contact_nodes[some], body.road_at(state.time)
        near, when = ON_ROAD * (body.size + float(np.abs(u[nodes]).max())), f" at time {state.time:.6g}"
        gap, normal, _ = road.closest(body.positions(u)[some])
        return held_below_road(gap, normal, nodes, body.prescribed[nodes], u[nodes], near, when)

    def ground(self, state: State) -> tuple[np.ndarray, np.ndarray]:
        """Gap (n,) and normal (n, d) under the body; gaps of nodes that touch are 0, whatever rounding."""
        gap, normal = self.body.gaps(state.displacement, state.time)
        forget_rounding(gap, state.status, self.rounding * self.body.size)
        return gap, normal

    def after(
        self,
        before: State,
        touch: Touch,
        began: float,
        displacement: np.ndarray,
        velocity: np.ndarray,
        acceleration: np.ndarray,
        mean_force: np.ndarray,
        work: Work,
        memory: np.ndarray | None = None,
    ) -> State:
        """Return the state that ends a step begun at perf_counter() = `began`."""
        step, seconds = before.step + 1, perf_counter() - began
        fields = displacement, velocity, acceleration, touch.force, touch.gap, touch.status, mean_force
        counts = touch.residual, touch.cycles, touch.count
        state = State(step, step * self.dt, *fields, work, *counts, seconds, memory)
        if self.body.limits is not None:
            self.body.limits.check(self.body.expand(state.displacement))
        return self.supported(state)

    def mean_load(self, before: State) -> np.ndarray:
        """Nodal forces (N, d) that the scheme works with in the step after `before`."""
        body = self.body
        if not callable(body.load):
            return body.load_at(before.time)
        return 0.5 * (body.load_at(before.time) + body.load_at(before.time + self.dt))

    def work(self, force: np.ndarray, change: np.ndarray, before: State, gap: np.ndarray) -> Work:
        """Work and impulse of a mean contact force (n, d) while the body moves by `change` (N, d).

        Along the normals by the gaps (n,) before and after, which are exactly 0 in contact. Of a road that
        moves, what the body does relative to it counts as such work, and the rest as the road's.
        """
        impulse = np.zeros(force.shape[1])
        total = self.body.ranks.sum
        if not self.body.ranks.any(bool(force.any())):
            return Work(impulse=impulse)
        loop = self.solvers["step"].loop
        opening, way = gap - before.gap, self.way(before)
        if np.any(way):
            change = change.copy()
            change[self.body.contact_nodes] -= way
        normal, friction = contact_work(loop.nodes, loop.normal, force, change, opening, impulse)
        road = total(float(np.sum(force * way)))
        return Work(total(normal), total(friction), impulse=self.dt * total(impulse), road=road)

    def damping_work(self, speed: np.ndarray, change: np.ndarray) -> float:
        """Work of the damping forces C speed over the displacement `change`, both (N, d)."""
        if self.body.C is None:
            return 0.0
        return -float(self.body.ranks.sum(change.ravel() @ (self.body.C @ speed.ravel())))


def choose(body: MovingBody) -> str:
    """Pick the correction for `auto`."""
    nested = len(body.prolongations) > 0 and not body.finite_strain
    large = body.dim == 3 and body.coordinates.size > MULTIGRID_PAYS
    return "multigrid" if nested and (large or body.exchanges) else "direct"


def _initial(name: str, values: np.ndarray | None, body: MovingBody) -> np.ndarray:
    """Check an initial field."""
    if values is None:
        return np.zeros_like(body.coordinates)
    return array(name, values, body.coordinates.shape).copy()
