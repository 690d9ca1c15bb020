"""Static contact of finite rotation and finite strain: Newton's method with contact inside, in load steps.

Each iteration is a contact problem for an increment d, with the tangent K(u), what is missing of equilibrium,
and the gaps of the present configuration to planes that follow the nodes (`RoadPlanes`), whose springs in
hollows and corners are at rest on the road. The total energy, friction held, may not rise along d, and no
cell may be turned inside out. Where the tangent is not positive definite, nodes that touch are held where
they are by springs that change no solution; what is indefinite even so is shifted. A load step that fails is
halved, after easy ones the next is longer.

Source: Wriggers, Computational Contact Mechanics, 2nd edition, Springer 2006, chapters 9 and 10 (Newton's
method with contact); Nocedal and Wright, Numerical Optimization, 2nd edition, 2006, chapter 3 (damping).
"""

from collections.abc import Iterable, Iterator
from dataclasses import replace
from resource import RUSAGE_SELF, getrusage
from time import perf_counter
from typing import Any

import numpy as np
from scipy.sparse import bsr_array

from checks import is_contact, is_tolerance, number, positive, refused, whole
from model.curved.tangent_planes import RoadPlanes
from model.finite_strain.definite import indefinite, shifted
from model.finite_strain.system_forces import SystemForces
from model.node_loop.node_loop import along_road, length
from model.node_loop.status import Status
from model.problem.contact_problem import ContactProblem, length_scale
from model.problem.held_below_road import held_below_road
from model.problem.rigid_modes import rigid_motions
from model.solvers.contact_solver import ContactSolver, Solution
from model.solvers.convergence_record import NotConverged, Record
from model.tolerances import ON_ROAD

ITERATIONS = 30  # in a load step
EASY = 6  # iterations after which the next load step is longer
GROWTH = 1.5
SMALLEST = 2.0**-8  # part of the path
# Of the way its force would move a node: from so far below the road is looked at. On rough roads deeper looks
# see other facets: of four blocks in space 1, 0.3 and 0.1 stop one, 0.03 none, in as many iterations.
LOOK = 0.03
DAMPING = [0.5**k for k in range(8)]
SUFFICIENT = 1e-4  # part of the descent that the slope promises


class FiniteContact:
    """A body of finite strain above a rigid road, pressed step by step.

    Parameters
    ----------
    contact : BodyOnRoad
        Of a system of `forms.Hyperelasticity`. Loads and prescribed displacements that depend on time are
        followed from time 0 to 1; others are laid on in proportion.
    correction : str
        "direct", or another of `ContactSolver`.
    tolerance : float
        What may be missing of equilibrium, of the forces at work.

    Attributes
    ----------
    steps : list of (time, iterations)
        Load steps of the last solve.

    Raises
    ------
    ValueError
        If the system is one of linear strain.

    Examples
    --------
    >>> from forms import Hyperelasticity, NeoHookean, Support
    >>> from geometry import Body, Plane, rectangle
    >>> from model import BodyOnRoad
    >>> rubber = Hyperelasticity(Body.from_grid(rectangle(1.0, 0.5, 4, 4)), NeoHookean(E=1e3, nu=0.0))
    >>> support = Support(rubber.body).fix("top", x=0.0, y=-0.25)
    >>> contact = BodyOnRoad(rubber.system(rubber.body_force((0.0, 0.0)), support), "bottom", Plane())
    >>> half = FiniteContact(contact).solve()  # nu = 0: the force is E/2 (1/l - l), l = 1/2
    >>> round(float(half.pressure_force.sum()), 6)
    750.0
    """

    def __init__(self, contact: Any, correction: str = "direct", tolerance: float = 1e-10):
        is_contact(contact)
        system = contact.system
        if system.elastic is None:
            raise ValueError("FiniteContact is for forms.Hyperelasticity; linear strain takes model.solve.")
        is_tolerance(tolerance)
        self.contact, self.system, self.problem = contact, system, contact.problem
        self.correction, self.tolerance = correction, tolerance
        self._road = contact.road.at(0.0) if hasattr(contact.road, "at") else contact.road
        self.forces = SystemForces(system.elastic, system.node_of, system.fixed)
        self.steps: list[tuple[float, int]] = []
        at_rest = self.forces.tangent(np.zeros_like(system.coordinates))
        nodes = self.problem.contact_nodes
        self._softness = 1.0 / at_rest.diagonal().reshape(system.fixed.shape)[nodes].mean(axis=1)
        self._pressure = np.zeros(nodes.size)
        self._normal = self.problem.normal
        self._diagonal = np.where(system.fixed, 0.0, at_rest.diagonal().reshape(system.fixed.shape))
        self._size = float(np.ptp(system.coordinates, axis=0).max())
        self._history: list[float] = []

    def solve(self, steps: int = 1) -> Solution:
        """Follow the path to its end, time 1, in about so many load steps; as many more as it takes.

        Raises
        ------
        NotConverged
            If a load step does not converge however small; it says how far the path was followed.
        """
        whole(1, steps=steps)
        *_, last = self.follow([1.0], 1.0 / steps)
        return last

    def follow(self, times: Iterable[float], first: float | None = None) -> Iterator[Solution]:
        """Follow the path, and yield a Solution at each of the times.

        Parameters
        ----------
        times : iterable of float
            Growing, > 0.
        first : float, optional
            The first load step; default to the first of the times.
        """
        if first is not None:
            positive(first=first)
        nodes = self.problem.contact_nodes
        u, at, step = np.zeros_like(self.system.coordinates), 0.0, first
        status = np.zeros(nodes.size, dtype=np.int8)
        self.steps, self._pressure = [], np.zeros(nodes.size)
        if not isinstance(times, Iterable):
            raise refused("times", "a list of growing numbers > 0", times)
        for time in times:
            began = perf_counter()
            if not at < number(time) < np.inf:
                raise refused("times", f"finite numbers, each greater than the one before, here {at:g}", time)
            step = time - at if step is None else step
            while at < time:
                to = time if at + step > time * (1.0 - 1e-9) else at + step
                try:
                    found, touch, residual = self._step(u, at, to, status)
                except NotConverged as error:
                    step = 0.5 * (to - at)
                    if step < SMALLEST * time:
                        raise self._stopped(at, error) from None
                    continue
                iterations = len(self._history)
                self.steps.append((to, iterations))
                u, status, step, at = found, touch.status, max(step, to - at), to
                if iterations <= EASY:
                    step *= GROWTH
            yield self._solution(u, touch, residual, perf_counter() - began)

    def load_at(self, time: float) -> np.ndarray:
        """Return the external forces (R, d), 0 at prescribed unknowns."""
        system = self.system
        load = system.external_load(time) if system.varies else time * system.external_load()
        return np.where(system.fixed, 0.0, load)

    def prescribed_at(self, time: float) -> np.ndarray:
        """Return the prescribed displacements (R, d)."""
        system = self.system
        return np.asarray(system.prescribed_at(time) if system.varies else time * system.prescribed_at())

    def _step(
        self, start: np.ndarray, since: float, time: float, status: np.ndarray
    ) -> tuple[np.ndarray, Solution, float]:
        """Newton's method from u (R, d) at one time to another; return displacement, contact and residual."""
        nodes, fixed = self.problem.contact_nodes, self.system.fixed
        self.system.elastic.lay_on(time)
        self._time = time
        sticking = start[nodes]
        if hasattr(self.contact.road, "at"):
            self._road = self.contact.road.at(time)
            sticking = self.contact.road.carried(self._points(start), since, time) - self.contact.points
        load, wanted = self.load_at(time), self.prescribed_at(time)
        self._require_room(np.where(fixed, wanted, start), time)
        u, self._history = start, []
        missing = self._missing(u, load)
        planes, pressure = self._planes(u, sticking), self._pressure
        for _ in range(ITERATIONS):
            way = np.where(fixed, wanted - u, 0.0)
            planes.bend(pressure)
            touch = self._increment(u, missing, way, planes, status)
            status, d, pressure = touch.status, touch.displacement, touch.pressure_force
            rest = missing.copy()
            rest[nodes] += np.where(fixed[nodes], 0.0, touch.contact_force)
            forces = length(load) + length(touch.contact_force) + length(missing - load)
            scale = self.tolerance * forces
            floor = 1e-15 * float(np.abs(self.system.coordinates + u).max()) * length(self._diagonal)
            self._history.append(length(rest) / forces if forces else 0.0)
            if not np.isfinite(self._history[-1]):
                break
            over = not way.any() and length(rest) <= max(scale, floor)
            below = planes.gaps(self._points(u)).min() < -planes.near
            moved = bool(way.any() or below)  # by supports or the road
            to, tried = u + d, self._points(u + d)
            if not over:
                to = self._damped(u, d, touch, planes.normal, load, moved)
            turned = touch.contact_force, touch.contact_force + self._pull(planes, tried)
            steady = 10 * self.tolerance * forces if over else -1.0
            if planes.follow(self._points(to), status, pressure, steady, turned, tried):
                self._check(to, time)
                self._pressure, self._normal = pressure, planes.normal
                return to, replace(touch, gap=planes.gap), self._history[-1]
            u, missing = to, self._missing(to, load)
        raise NotConverged(
            f"Newton's method does not come to an end at time {time:.6g}",
            Record(self.tolerance, ITERATIONS, lambda: 0, progress=False, history=self._history or [1.0]),
        )

    def _require_room(self, u: np.ndarray, time: float) -> None:
        """Refuse supports that hold a node below the road, at u (R, d)."""
        nodes, near = self.problem.contact_nodes, ON_ROAD * length_scale(self.system.coordinates)
        held, when = self.system.fixed[nodes], f" at time {time:.6g}"
        gap, normal, _ = self._road.closest(self._points(u))
        trouble = held_below_road(gap, normal, nodes, held, u[nodes], near, when)
        if trouble:
            raise ValueError(trouble)

    def _damped(
        self,
        u: np.ndarray,
        d: np.ndarray,
        touch: Solution,
        normal: np.ndarray,
        load: np.ndarray,
        moving: bool,
    ) -> np.ndarray:
        """Return where to go on from along d; all the way if supports or road move."""
        nodes = self.problem.contact_nodes
        friction = along_road(touch.contact_force, normal)
        work = float(np.vdot(friction, d[nodes]))
        energy = self._energy(u, load)
        slope = -float(np.vdot(self._missing(u, load), d)) - work
        rounding = 1e-15 * float((self._diagonal * self.system.coordinates**2).sum())
        for part in DAMPING[:1] if moving else DAMPING:
            trial = u + part * d
            if not self.forces.volume_ratio(trial) > 0.0:
                continue
            change = self._energy(trial, load) - energy - part * work
            if moving or change <= SUFFICIENT * part * min(slope, 0.0) + rounding:
                return trial
        raise NotConverged(
            "every part of a Newton step raises the energy or turns a cell inside out",
            Record(self.tolerance, ITERATIONS, lambda: 0, progress=False, history=self._history),
        )

    def _increment(
        self,
        u: np.ndarray,
        missing: np.ndarray,
        way: np.ndarray,
        planes: RoadPlanes,
        status: np.ndarray,
    ) -> Solution:
        """Solve the contact problem of an increment."""
        fixed, points, normal = self.system.fixed, self._points(u), planes.normal
        K = self.forces.tangent(u, held=False)
        b = np.where(fixed, 0.0, missing - (K @ way.ravel()).reshape(way.shape) if way.any() else missing)
        A = self.forces.hold(K)
        b += np.where(fixed, A.diagonal().reshape(fixed.shape) * way, 0.0)
        nodes = self.problem.contact_nodes
        b[nodes] += np.where(fixed[nodes], 0.0, self._pull(planes, points))
        A = self._definite(self._with_springs(A, planes.springs), normal, status)
        problem = ContactProblem(
            A,
            np.zeros_like(u),
            self.system.coordinates,
            nodes,
            normal,
            np.zeros(len(normal)),
            self.problem.friction,
            prolongations=self.problem.prolongations,
        )
        slips = np.asarray(status == Status.SLIP, dtype=np.float64)
        law = self.problem.friction
        by_place = law is not None and law.by_place
        return ContactSolver(problem, self.correction, progress=False).solve(
            b=b,
            gap=planes.gaps(points),
            tangential_reference=planes.anchor - points,
            start_status=status,
            slipped=slips,
            normal=normal,
            tolerance=0.1 * self.tolerance,
            places=self._places(planes.anchor) if by_place else None,
        )

    def _definite(self, A: Any, normal: np.ndarray, status: np.ndarray) -> Any:
        """Return A, made positive definite where it is not."""
        if not indefinite(A):
            return A
        in_contact = np.flatnonzero(status != Status.FREE)
        held = np.einsum("ca,cb->cab", normal[in_contact], normal[in_contact])
        held[status[in_contact] == Status.STICK] = np.eye(normal.shape[1])
        springs = np.zeros((len(normal), *held.shape[1:]))
        springs[in_contact] = float(self._diagonal.max()) * held
        return shifted(self._with_springs(A, springs), self._diagonal.ravel())

    def _with_springs(self, A: Any, springs: np.ndarray) -> Any:
        """Return A with springs (n, d, d) at the candidates."""
        if not springs.any():
            return A
        fixed, d = self.system.fixed, A.blocksize[0]
        blocks = np.zeros((len(fixed), d, d))
        blocks[self.problem.contact_nodes] = springs
        blocks[fixed] = blocks.swapaxes(1, 2)[fixed] = 0.0
        N = len(blocks)
        added = bsr_array((blocks, np.arange(N), np.arange(N + 1)), shape=A.shape)
        return bsr_array(A + added, blocksize=(d, d))

    def _pull(self, planes: RoadPlanes, points: np.ndarray) -> np.ndarray:
        """Forces (n, d) of the springs of planes, which are at rest on the road, at points (n, d)."""
        return np.einsum("cab,cb->ca", planes.springs, planes.foot - points)

    def _planes(self, u: np.ndarray, sticking: np.ndarray) -> RoadPlanes:
        """Return the planes under a body at u (N, d) ; `sticking` (n, d) are displacements that hold."""
        held = None if self.problem.friction is None else self.contact.points + sticking
        planes = RoadPlanes(self._road, self._points(u), held, LOOK * self._softness, self._size)
        pressed = self._pressure > 0.0  # at a corner the road has many normals: this one has been found
        planes.normal[pressed] = self._normal[pressed]
        return planes

    def _missing(self, u: np.ndarray, load: np.ndarray) -> np.ndarray:
        return np.where(self.system.fixed, 0.0, load - self.forces.internal_force(u))

    def _energy(self, u: np.ndarray, load: np.ndarray) -> float:
        return self.forces.strain_energy(u) - float(np.vdot(load, u))

    def _points(self, u: np.ndarray) -> np.ndarray:
        return np.asarray(self.contact.points + u[self.problem.contact_nodes])

    def _places(self, points: np.ndarray) -> np.ndarray:
        """Points (n, d) of the road nearest to some; of one that moves, as they lie at time 0."""
        foot, road = self._road.closest(points)[2], self.contact.road
        return np.asarray(road.carried(foot, self._time, 0.0) if hasattr(road, "at") else foot)

    def _check(self, u: np.ndarray, time: float) -> None:
        if not self.forces.volume_ratio(u) > 0.0:
            raise NotConverged(
                f"at time {time:.6g} a cell is turned inside out",
                Record(self.tolerance, ITERATIONS, lambda: 0, progress=False, history=self._history),
            )

    def _stopped(self, at: float, error: NotConverged) -> NotConverged:
        size = self.system.coordinates.size
        motions = rigid_motions(self.system.coordinates).reshape(size, -1)
        held = motions[self.system.fixed.ravel()]
        free = held.size == 0 or np.linalg.matrix_rank(held) < motions.shape[1]
        soft = [e for e in self.system.elastic.energies if not e.bears_compression]
        remedy = (
            "St. Venant and Kirchhoff's material softens in compression: NeoHookean bears it"
            if soft
            else "nothing but the road holds the body as a whole: support it against rolling or sliding away"
            if free
            else "refine the mesh where cells are pressed flat or the road is sharper than they are, or load "
            "by a motion instead of a force"
        )
        return NotConverged(
            f"The load path stops at {at:.4g} of its end, however small the load step ({error}); {remedy}.",
            Record(self.tolerance, ITERATIONS, lambda: 0, progress=False, history=self._history or [1.0]),
        )

    def _solution(self, u: np.ndarray, touch: Solution, residual: float, seconds: float) -> Solution:
        return Solution(
            displacement=u,
            contact_force=touch.contact_force,
            pressure_force=self._pressure,
            gap=touch.gap,
            status=touch.status,
            residual=residual,
            history=np.array(self._history),
            correction=self.correction,
            sweeps=0,
            cycles=sum(iterations for _, iterations in self.steps),
            work_units=0.0,
            seconds=seconds,
            setup_seconds=0.0,
            peak_memory=getrusage(RUSAGE_SELF).ru_maxrss * 1024,
            time=self._time,
        )
