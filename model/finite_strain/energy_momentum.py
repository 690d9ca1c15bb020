"""Time steps of finite rotation and finite strain that gain no energy, and keep momentum and spin.

    u1 = u0 + dt v0 + e,     v1 = v0 + 2 e / dt,     2 M e / dt^2 + R(u0, u1) = load + p1,

where R is the step's mean internal force (`Hyperelasticity.step_force`), whose work is the change of the
elastic energy and which has no moment. Contact is that of the end of the step: p1 >= 0, g1 >= 0, p1 g1 = 0,
so that it does the work -p1 g0 <= 0, and friction the work -mu p1 |slip|. With the nodes that may touch
massless, and brought into equilibrium where contact plays a part, energy never grows.

Newton's method goes around the contact loop: each iteration is a contact problem for an increment, with the
gaps of the present configuration, to planes that follow the nodes where the road bends. Its matrix is
constant, 2 M / dt^2 + K / 2 turned at each node with the body there, and Anderson's extrapolation makes good
what it lacks; where that fails, the symmetric part of the exact tangent takes over, damped; where that fails,
the step is halved. With correction="none" no matrix of the body is solved: the paper's loop visits node after
node, each with what is then missing there.

Source: Simo and Tarnow, Z. angew. Math. Phys. 43 (1992) 757; Gonzalez, Comput. Methods Appl. Mech. Engrg. 190
(2000) 1763; Khenous, Laborde and Renard, Eur. J. Mech. A/Solids 27 (2008) 918.
"""

from abc import abstractmethod
from dataclasses import replace
from time import perf_counter
from typing import Any

import numpy as np
from scipy.sparse import bsr_array

from checks import whole
from model.curved.anderson_acceleration import Anderson
from model.curved.tangent_planes import RoadPlanes, softness
from model.dynamics.mass_redistribution import MassRedistribution
from model.dynamics.midpoint import Midpoint
from model.dynamics.time_integrator import State, StepSolver, Touch, Work
from model.finite_strain.definite import shifted
from model.finite_strain.local_rotations import LocalRotations
from model.finite_strain.moving_body import FiniteBody
from model.finite_strain.node_by_node import NodeByNode
from model.finite_strain.turned_solver import TurnedSolver
from model.node_loop.node_loop import along_road, length
from model.node_loop.status import Status
from model.problem.contact_problem import ContactProblem
from model.solvers.convergence_record import NotConverged, Record

CONSTANT = 60  # iterations with the constant matrix
EXACT = 40  # iterations with the exact tangent
SWEEPS = 100_000  # of the paper's loop: stiff bodies of many nodes take thousands a step
HALVINGS = 4  # of the step
# Times the tolerance: what may be missing where the massless nodes come to rest. Their energy is least there,
# so that it counts by its square in the ledger; forces are then good to 1e-8.
SETTLED = 100.0
IN_FLIGHT = 0.01  # of the tolerance that may be missing: there it shows in energy and spin, which are kept
SLOW = 0.5  # fall of what is missing in an iteration that asks for an exact tangent
# Iterations in which what is missing has not fallen to half of the least before, after which it will not: of
# 680 attempts that succeeded, with 131 others that failed, all but three fell sooner.
PATIENCE = 16
DAMPING = (1.0, 0.5, 0.25, 0.125, 0.0625)  # parts of a Newton step that are tried


class FiniteMidpoint(Midpoint):
    """The step of `Midpoint` for finite strain: Newton's method around the contact loop."""

    body: FiniteBody
    turned: TurnedSolver
    iterations: int
    part_missing = 1.0  # of the tolerance that a step may miss
    part_inside = 0.1  # each of Newton's iterations is solved well enough for the step to end there
    _rotations: LocalRotations
    _at_rest: np.ndarray
    _diagonal: float

    @abstractmethod
    def _two_halves(self, before: State, began: float) -> State:
        """Take the step in two halves."""

    def step(self, before: State) -> State:
        """Return the state one step later."""
        began, dt = perf_counter(), self.dt
        u0, v0 = before.displacement, before.velocity
        self.iterations = 0
        try:
            u1, touch = self._end(before)
        except NotConverged:
            return self._two_halves(before, began)
        self.turned.face(self._normal)
        v1 = 2.0 / dt * (u1 - u0) - v0
        return self.after(
            before,
            touch,
            began,
            displacement=u1,
            velocity=v1,
            acceleration=(v1 - v0) / dt,
            mean_force=self._mean_force(touch),
            work=self._contact_work(touch, u1 - u0, before),
        )

    def _end(self, before: State) -> tuple[np.ndarray, Touch]:
        """Return the displacement (N, d) at the end of a step, and what touches there."""
        if self.correction == "none":
            return self._iterate(before, self._by_nodes(before).sweep, SWEEPS, combined=False)
        try:
            return self._iterate(before, self._turned_increment, CONSTANT)
        except NotConverged:
            return self._iterate(before, self._exact_increment, EXACT, damped=True)

    def _iterate(
        self, before: State, increment: Any, limit: int, damped: bool = False, combined: bool = True
    ) -> tuple[np.ndarray, Touch]:
        """Newton's method from the guess, with `increment(before, u1, b, gap, normal, back)` for a step."""
        body, nodes = self.body, self.body.contact_nodes
        load, anderson, flat = self.mean_load(before), Anderson(np.inf), getattr(body.road, "flat", False)
        u1, sizes, least = self._guess(before, checked=damped or not combined), [], 0
        floor = 1e-15 * float(np.abs(body.coordinates + u1).max()) * self._diagonal
        self._turn = self._rotations(0.5 * (before.displacement + u1))
        touch: Any = before
        missing, scale = self._missing(before, load, u1, None)
        planes = None if flat else self._planes(before, u1)
        for _ in range(limit):
            if planes is None:
                gap, self._normal = body.gaps(u1)
                back = (before.displacement - u1)[nodes]
            else:
                at = body.positions(u1)
                gap, self._normal, back = planes.gaps(at), planes.normal, planes.anchor - at
            last = replace(before, status=touch.status)
            touch = increment(last, u1, missing, gap, self._normal, back)
            self.iterations += 1
            sizes.append(self._left(missing, touch))
            image, forces = u1 + touch.increment, scale + length(touch.force)
            part = self.part_missing if before.count or touch.count else IN_FLIGHT
            good = part * self.tolerance * forces
            falls, lies = sizes[-1] <= SLOW * sizes[least] or len(sizes) == 1, True
            least = len(sizes) - 1 if falls else least
            if not falls and sizes[-1] <= self.tolerance * forces:  # more than the tolerance is wished for,
                floor = max(floor, sizes[-1])  # if rounding lets it
            if planes is not None:
                pressure = np.maximum(np.einsum("ca,ca->c", self._normal, touch.force), 0.0)
                steady = 10 * self.tolerance * forces
                lies = planes.follow(body.positions(image), touch.status, pressure, steady)
                touch = replace(touch, gap=np.where(touch.status == Status.FREE, planes.gap, 0.0))
            if lies and sizes[-1] <= max(good, floor):
                return self._checked(before, image, touch, sizes[-1] / (forces or 1.0))
            hopeless = flat and combined and len(sizes) - least > PATIENCE
            if hopeless or not np.isfinite(sizes[-1]) or sizes[-1] > 1e6 * sizes[least]:
                break
            if damped:
                u1, missing, scale = self._damped(before, load, u1, touch)
            elif flat and len(sizes) > 1 and sizes[-1] ** 2 <= good * sizes[-2]:  # as it falls, this is it
                u1 = image
                missing, scale = self._missing(before, load, u1, touch)
                left = self._left(missing, touch)
                if left <= good:
                    return self._checked(before, image, touch, left / forces)
            else:
                u1 = anderson.combine(touch.increment, image) if combined else image
                missing, scale = self._missing(before, load, u1, touch)
        raise NotConverged(
            f"Newton's method in the step after time {before.time:g} is not done in {limit} iterations.",
            Record(self.tolerance, limit, lambda: 0, progress=False, history=sizes or [np.inf]),
        )

    def _planes(self, before: State, u1: np.ndarray) -> RoadPlanes:
        """Return the planes of a road that bends."""
        body, loop = self.body, self.turned.solver.loop
        sticking = None if body.friction is None else body.positions(before.displacement)
        return RoadPlanes(body.road, body.positions(u1), sticking, softness(loop), body.size)

    def _left(self, missing: np.ndarray, touch: Touch) -> float:
        """Return the size of what is missing (N, d) with the forces of the road; supports bear their own."""
        left = missing.copy()
        left[self.body.contact_nodes] += self._free(touch.force)
        return length(left)

    def _free(self, force: np.ndarray) -> np.ndarray:
        """Return forces (n, d) at nodes that may touch without what supports there bear."""
        body = self.body
        return np.where(body.prescribed[body.contact_nodes], 0.0, force) if body.supported else force

    def _checked(
        self, before: State, u1: np.ndarray, touch: Touch, residual: float
    ) -> tuple[np.ndarray, Touch]:
        """Return the end of a step unless a cell is turned over there."""
        if not self.body.forces.volume_ratio(u1) > 0.0:
            raise self._turned_over(before)
        return u1, replace(touch, residual=residual)

    def _turned_over(self, before: State) -> NotConverged:
        return NotConverged(
            f"Every step of Newton's method after time {before.time:g} turns a cell over.",
            Record(self.tolerance, EXACT, lambda: 0, progress=False, history=[np.inf]),
        )

    def _damped(
        self, before: State, load: np.ndarray, u1: np.ndarray, touch: Touch
    ) -> tuple[np.ndarray, np.ndarray, float]:
        """Return the best part of a Newton step, by what is missing after it, no cell being turned over."""
        best: Any = None
        for part in DAMPING:
            trial = u1 + part * touch.increment
            if not self.body.forces.volume_ratio(trial) > 0.0:
                continue
            missing, scale = self._missing(before, load, trial, touch)
            size = self._left(missing, touch)
            if best is None or size < best[0]:
                best = size, trial, missing, scale
            elif size > best[0]:
                break
        if best is None:
            raise self._turned_over(before)
        return best[1:]

    def _guess(self, before: State, checked: bool = True) -> np.ndarray:
        """Return where the body would be if its accelerations stayed, (N, d).

        If `checked`, with no cell turned over; the constant matrix leads out of that too.
        """
        dt = self.dt
        guess = before.displacement + dt * before.velocity + 0.5 * dt**2 * before.acceleration
        if checked and not self.body.forces.volume_ratio(guess) > 0.0:
            guess = before.displacement.copy()
        if self.body.supported:
            held = self.body.prescribed_at((before.step + 1) * dt)
            guess[self.body.prescribed] = held[self.body.prescribed]
        return guess

    def _missing(
        self, before: State, load: np.ndarray, u1: np.ndarray, touch: Touch | None
    ) -> tuple[np.ndarray, float]:
        """Return load less inertia less the step's internal force (N, d), and the size of these forces.

        `touch` is how the last iteration ended, if there was any.
        """
        dt, body = self.dt, self.body
        e = u1 - before.displacement - dt * before.velocity
        internal = self._internal(before, load, u1, touch)
        inertia = (self.M @ (2.0 / dt**2 * e.ravel())).reshape(e.shape)
        missing = np.where(body.prescribed, 0.0, load - inertia - internal)
        return missing, length(load) + length(internal)

    def _internal(self, before: State, load: np.ndarray, u1: np.ndarray, touch: Touch | None) -> np.ndarray:
        """Return the step's internal force (N, d)."""
        return self.body.forces.step_force(before.displacement, u1)

    def _turned_increment(self, last: State, u1: np.ndarray, *problem: Any) -> Touch:
        """Solve for an increment with the constant matrix, turned with the body."""
        b, gap, normal, back = problem
        return self.turned.solve(self._turn, b, gap, normal, back, last)

    def _exact_increment(self, last: State, u1: np.ndarray, *problem: Any) -> Touch:
        """Solve for an increment with the symmetric part of the exact tangent."""
        b, gap, normal, back = problem
        return self._solver_of(self._exact(last, u1), normal).solve(b, gap, normal, back, last)

    def _by_nodes(self, before: State) -> NodeByNode:
        """Return the paper's loop on the step's forces."""
        guess, load = self._guess(before), self.mean_load(before)
        solver = self._solver_of(self._exact(before, guess), self.body.gaps(guess)[1])
        missing = lambda u, touch: self._missing(before, load, u, touch)[0]  # noqa: E731
        return NodeByNode(solver, missing)

    def _exact(self, before: State, u1: np.ndarray) -> Any:
        """Return the symmetric part of the exact tangent (N d, N d), positive definite."""
        K = self.body.forces.step_tangent(before.displacement, u1)
        return shifted(bsr_array(self.M * (2.0 / self.dt**2) + K, blocksize=K.blocksize), self._at_rest)

    def _solver_of(self, A: Any, normal: np.ndarray) -> StepSolver:
        body = self.body
        problem = ContactProblem(
            A,
            np.zeros_like(body.coordinates),
            body.coordinates,
            body.contact_nodes,
            normal,
            np.zeros(len(normal)),
            body.friction,
            prolongations=body.prolongations,
        )
        tolerance = self.part_inside * self.tolerance
        return StepSolver(problem, self.correction, tolerance, 1.0 / self.dt, body.places)

    def _mean_force(self, touch: Touch) -> np.ndarray:
        """Mean contact force (n, d) of a step."""
        return touch.force

    def _contact_work(self, touch: Touch, change: np.ndarray, before: State) -> Work:
        """Work and impulse of the contact forces of a step."""
        pressure = np.einsum("ca,ca->c", self._normal, touch.force)
        work = Work(impulse=self.dt * self._mean_force(touch).sum(axis=0))
        work.normal = work.numerical = float(pressure @ (touch.gap - before.gap))
        friction = along_road(touch.force, self._normal)
        work.friction = float(np.vdot(friction, change[self.body.contact_nodes]))
        return work


class EnergyMomentum(MassRedistribution, FiniteMidpoint):
    """The energy-momentum method with mass redistribution, for finite rotation and finite strain.

    Parameters
    ----------
    body : FiniteBody
    dt : float
        Time step.
    correction : str
        As for `TimeIntegrator`.
    tolerance : float
        What may be missing of equilibrium, of the forces at work.
    halvings : int
        How often a step that does not converge may be halved.

    Attributes
    ----------
    iterations : int
        Of Newton's method in the last step.

    Raises
    ------
    ValueError
        If every node may touch, so that no mass is left, the body is one of linear strain, or the road bends.
    NotConverged
        From `step`, where halving ends.

    Examples
    --------
    >>> from forms import Hyperelasticity, NeoHookean
    >>> from geometry import Body, Plane, rectangle
    >>> from model import EnergyMomentum, FiniteBody
    >>> rubber = Hyperelasticity(Body.from_grid(rectangle(2.0, 1.0, 4, 4)), NeoHookean(E=1e4, nu=0.3))
    >>> weight = rubber.body_force((0.0, -10.0))
    >>> body = FiniteBody.from_forms(rubber, 1.0, weight, Plane(point=(0.0, -0.001)), "bottom")
    >>> scheme = EnergyMomentum(body, dt=0.002)
    >>> state = scheme.run(scheme.start(), 10)
    >>> bool(state.gap.min() == 0.0), scheme.iterations < 10
    (True, True)
    """

    name = "energy-momentum"
    finite_strain = True
    bends = False  # whether the road may

    def __new__(cls, *arguments: Any, **options: Any) -> "EnergyMomentum":
        """Keep the class on any road: Newton's iterations follow one that bends by themselves."""
        return object.__new__(cls)

    def __init__(self, body: FiniteBody, dt: float, halvings: int = HALVINGS, **options: Any):
        if not isinstance(body, FiniteBody):
            raise ValueError(
                f"The body is a {type(body).__name__}, but EnergyMomentum is for finite strain and takes a "
                "FiniteBody; for linear strain take MassRedistribution."
            )
        if not (self.bends or getattr(body.road, "flat", False)):
            raise ValueError(
                "On a road that bends the steps of EnergyMomentum would gain energy; take LosslessContact."
            )
        whole(0, halvings=halvings)
        self._given, self._options, self.halvings = body, options, halvings
        super().__init__(body, dt, **options)
        self.turned, self._rotations = TurnedSolver(self.solvers["step"]), LocalRotations(self.body)
        self._at_rest = self.effective_matrix().diagonal()
        self._diagonal = length(self._at_rest)
        self._half: EnergyMomentum | None = None
        self.iterations = 0

    def start(self, displacement: np.ndarray | None = None, velocity: np.ndarray | None = None) -> State:
        """Return the state at time 0, the massless nodes in equilibrium.

        Raises
        ------
        ValueError
            As `TimeIntegrator.start`, and for a displacement that turns a cell inside out.
        """
        u = np.asarray(0.0 if displacement is None else displacement)
        if u.shape == self.body.coordinates.shape and np.isfinite(u).all():
            self.body.forces.check_volume(u, "The start")
        return super().start(displacement, velocity)

    def _two_halves(self, before: State, began: float) -> State:
        """Take the step in two halves."""
        if self.halvings == 0:
            raise NotConverged(
                f"The step after time {before.time:g} does not converge even with dt = {self.dt:g}; "
                "take smaller steps, or a finer mesh where cells are pressed flat.",
                Record(self.tolerance, CONSTANT + EXACT, lambda: 0, progress=False, history=[np.inf]),
            )
        if self._half is None:
            self._half = type(self)(self._given, self.dt / 2, halvings=self.halvings - 1, **self._options)
        half, spent = self._half, self.iterations
        middle = half.step(replace(before, step=2 * before.step))
        spent += half.iterations
        after = half.step(middle)
        self.iterations = spent + half.iterations
        first, second = middle.work, after.work
        work = Work(*(getattr(first, name) + getattr(second, name) for name in vars(first)))
        return replace(
            after,
            step=before.step + 1,
            time=(before.step + 1) * self.dt,
            mean_force=0.5 * (middle.mean_force + after.mean_force),
            work=work,
            seconds=perf_counter() - began,
        )

    def _settle(self, state: State) -> float:
        """Bring the massless nodes of `state` into equilibrium in place; return the energy that this adds."""
        body, nodes = self.body, self.body.contact_nodes
        load = np.where(body.prescribed, 0.0, body.load_at(state.time))

        def potential(u: np.ndarray) -> float:
            return body.surface.strain_energy(u) - float(np.vdot(load[nodes], u[nodes]))

        def missing_at(u: np.ndarray) -> np.ndarray:
            return np.where(body.prescribed, 0.0, load - body.surface.internal_force(u))[nodes]

        energy, slipped, last = potential(state.displacement), 0.0, state
        flat = getattr(body.road, "flat", False)
        missing = missing_at(state.displacement)
        turn = self._rotations(state.displacement)[nodes]
        rest, solver = np.inf, TurnedSolver(self.solvers["massless"])
        for _ in range(EXACT):
            u = state.displacement
            gap, normal = self.ground(state)
            touch = solver.solve(turn, missing, gap, normal, np.zeros_like(missing), last)
            before, rest = rest, length(missing + self._free(touch.force))
            if rest > SLOW * before:
                solver = TurnedSolver(self._massless_solver(u, normal))
                turn = np.tile(np.eye(body.dim), (len(turn), 1, 1))
            floor = 1e-15 * float(np.abs(body.coordinates + u).max()) * self._diagonal
            good = max(SETTLED * self.tolerance * (length(touch.force) + length(missing)), floor)
            done = rest <= good
            friction = along_road(touch.force, normal)
            downhill = float(np.vdot(missing + friction, touch.increment))
            for part in DAMPING:
                trial = u.copy()
                trial[nodes] += part * touch.increment
                missing = missing_at(trial)
                ahead = float(np.vdot(missing + friction, touch.increment))
                if done or ahead >= -0.5 * downhill:  # not so where it is no number: a cell is turned over
                    break
            done = done or (part == 1.0 and flat and length(missing + self._free(touch.force)) <= good)
            state.displacement, last = trial, state
            slipped += float(np.vdot(friction, part * touch.increment))
            state.contact_force, state.status = touch.force, touch.status
            state.gap, state.count = touch.gap, touch.count
            if done:
                break
        else:
            raise NotConverged(
                f"The massless nodes find no equilibrium at time {state.time:g}; take smaller steps.",
                Record(self.tolerance, EXACT, lambda: 0, progress=False, history=[rest]),
            )
        state.work.friction += slipped
        return potential(state.displacement) - energy - slipped

    def _massless_solver(self, u: np.ndarray, normal: np.ndarray) -> StepSolver:
        """Set up the contact problem of the massless nodes with the tangent at displacement u (N, d)."""
        body, d = self.body, self.body.dim
        nodes = body.contact_nodes
        K = bsr_array(body.surface.tangent(u), blocksize=(d, d))
        own = bsr_array(_blocks(K, nodes), blocksize=(d, d))
        own = shifted(own, self._own.diagonal())
        n = nodes.size
        problem = ContactProblem(
            own, np.zeros((n, d)), body.coordinates[nodes], np.arange(n), normal, np.zeros(n), body.friction
        )
        return StepSolver(problem, "direct", self.tolerance, 1.0 / self.dt, body.places)


def _blocks(A: bsr_array, nodes: np.ndarray) -> Any:
    """Return the rows and columns of some nodes."""
    d = A.blocksize[0]
    unknowns = (nodes[:, None] * d + np.arange(d)).ravel()
    return A.tocsr()[unknowns][:, unknowns]
