"""Solve a contact problem: one loop, with the correction of your choice."""

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from resource import RUSAGE_SELF, getrusage
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np

from checks import is_tolerance, positive
from model.node_loop.blocks import block_matrix
from model.node_loop.node_loop import NodeLoop
from model.node_loop.status import Status
from model.one_rank import ONE_RANK
from model.problem.contact_problem import ContactProblem, length_scale, shaped
from model.problem.held_below_road import held_below_road
from model.problem.rigid_modes import BALANCE, RigidModes
from model.solvers.compiling import announce_compilation
from model.solvers.convergence_record import Record
from model.solvers.diagnosis import likely_causes
from model.solvers.iterative_refinement import gap_at, missing_at, rounding_floor
from model.solvers.smoothed_aggregation import algebraic
from model.solvers.static_condensation import Condensation
from model.solvers.truncated_multigrid import bsr, geometric
from model.tolerances import ON_ROAD

# Unknowns beyond which another correction is quicker, set-up included. Processor time to a natural residual
# of 1e-8, direct / multigrid / algebraic in ms: Hertz's half cylinder of 498 unknowns 5 / 5 / 7, of 1,890
# 12 / 9 / 16, of 7,362 57 / 16 / 49; a sheared cube of 2,187 unknowns 91 / - / 38. A few ms are left to
# `direct`, which keeps its factorisation and finds any body that only the contact holds.
MULTIGRID_PAYS = 2_000
DIRECT_PAYS = {2: 7_000, 3: 2_000}
FINE = 1e-8  # of what is carried apart: half of the digits, and a motion by less leaves u the other half
CORRECTIONS = ("auto", "none", "direct", "multigrid", "algebraic")


class FrictionLeftOut(UserWarning):
    """Nodes slide along the road without the friction that they should have."""


@dataclass
class Solution:
    """What a solve returns; N nodes, n candidates, d dimensions.

    Attributes
    ----------
    displacement : (N, d)
    contact_force : (n, d)
        Force of the road on the body at each candidate; zero where there is no contact.
    pressure_force : (n,)
        Its normal part, >= 0.
    gap : (n,)
        Distance to the road, >= 0, exactly 0 in contact.
    status : (n,)
        A `Status` each: FREE, SLIP (and every frictionless contact), STICK.
    residual : float
        Natural residual, dimensionless.
    history : (tests,)
        Natural residuals on the way.
    correction : str
    sweeps, cycles : int
        Sweeps of the loop over the whole mesh; corrections made (multigrid: V-cycles).
    steps : int
        Steps of Newton and changes along paths in small dense problems; 0 where there was none.
    most_steps : int
        Of them, the most in one small problem.
    work_units : float
        Measured time, set-up included in the first solve, in sweeps of the finest mesh.
    seconds, setup_seconds : float
    peak_memory : int
        Largest resident size of the process so far, bytes.
    time : float or None
        Time (or load parameter) of load, supports and road, where `solve` or `follow` was given one.
    state : (n,)
        1 where a node slips, for the next step.
    unique : bool
        False where the body could move as a rigid one and leave all that presses on the road in place: the
        displacement is then one of many.

    Examples
    --------
    >>> from forms import Elasticity, Isotropic, Support
    >>> from geometry import Body, Plane, rectangle
    >>> from model import BodyOnRoad, solve
    >>> elasticity = Elasticity(Body.from_grid(rectangle(2.0, 1.0, 4, 2)), Isotropic(E=1e3, nu=0.0))
    >>> support = Support(elasticity.body).fix("top", x=0.0, y=-0.01)
    >>> system = elasticity.system(elasticity.body_force((0.0, 0.0)), support)
    >>> contact = BodyOnRoad(system, "bottom", Plane())
    >>> solution = solve(contact)
    >>> float(solution.pressure_force.sum().round(9)), float(solution.gap.max()), solution.unique
    (20.0, 0.0, True)
    """

    displacement: np.ndarray
    contact_force: np.ndarray
    pressure_force: np.ndarray
    gap: np.ndarray
    status: np.ndarray
    residual: float
    history: np.ndarray
    correction: str
    sweeps: int
    cycles: int
    work_units: float
    seconds: float
    setup_seconds: float
    peak_memory: int
    time: float | None = None
    state: np.ndarray | None = None
    unique: bool = True
    steps: int = 0
    most_steps: int = 0

    def next_start(self) -> dict[str, Any]:
        """Return what the next step of a path takes over: first guess, statuses, and who slipped."""
        return {"start": self.displacement, "start_status": self.status, "slipped": self.state}

    def cost(self) -> dict[str, float]:
        """Return what the solve cost, set-up included, for `Scene.cost`."""
        return {
            "dofs": self.displacement.size,
            "contact_candidates": self.status.size,
            "sweeps": self.sweeps,
            "cycles": self.cycles,
            "work_units": self.work_units,
            "solve_seconds": self.setup_seconds + self.seconds,
            "residual": self.residual,
        }


class Posed(NamedTuple):
    """What one solve is about.

    Load (N, d), gap (n,), where nodes stick (n, d), what the friction law is told of them (n, 1 + m), where
    springs hold them (n, d), and whether planes can balance the load, but for as much as the solve may leave.
    """

    load: np.ndarray
    gap: np.ndarray
    reference: np.ndarray
    state: np.ndarray
    held: np.ndarray
    balanced: bool = True


class Relaxation:
    """The correction `none`: the paper's loop as printed."""

    name = "none"

    def __init__(self, loop: NodeLoop):
        self.loop, self.steps = loop, np.zeros(2, dtype=np.int64)

    def solve(self, u: np.ndarray, status: np.ndarray, record: Record) -> None:
        """Sweep until the natural residual, tested at most every hundred sweeps, is below the tolerance."""
        count = 1
        while not record.finished(self.loop.residual(u, status)):
            self.loop.sweep(u, status, count)
            count = min(2 * count, 100)

    def update_normals(self) -> None:
        """Follow the loop's new normals: there is nothing to follow."""


class ContactSolver:
    """Solves one contact problem for any loads, gaps and stick positions, keeping what can be kept.

    Parameters
    ----------
    problem : ContactProblem
        Its matrix, candidates, normals and friction law are fixed; the rest are first values.
    correction : str
        "none", "direct", "multigrid", "algebraic", or "auto" (the rule is in the README).
    order : (N,) optional
        The order in which the loop visits nodes; default 0, 1, 2, ...
    progress : bool
        Show a bar on a terminal when a solve takes over two seconds.

    Raises
    ------
    ValueError
        If the correction is unknown or cannot be had, the order is not a permutation, or nothing can hold the
        body against the load.

    Examples
    --------
    >>> import numpy as np
    >>> from scipy.sparse import eye_array
    >>> from model import ContactProblem, ContactSolver
    >>> problem = ContactProblem(  # two nodes on springs of 100 N/mm, 0.1 and 0.3 mm above a road
    ...     A=100.0 * eye_array(4),
    ...     b=np.array([[0.0, -20.0], [3.0, -40.0]]),
    ...     coordinates=np.array([[0.0, 0.1], [1.0, 0.3]]),
    ...     contact_nodes=np.array([0, 1]),
    ...     normal=np.array([[0.0, 1.0], [0.0, 1.0]]),
    ...     gap=np.array([0.1, 0.3]),
    ...     friction=0.5,
    ... )
    >>> solver = ContactSolver(problem, "none")
    >>> solver.solve().status.tolist()  # the second is drawn along by 3 N, less than 0.5 x 10 N
    [2, 2]
    >>> solver.solve(b=np.array([[0.0, -20.0], [7.0, -40.0]])).status.tolist()  # and now by 7 N
    [2, 1]
    """

    ranks: Any = ONE_RANK

    def __init__(
        self, problem: ContactProblem, correction: str = "auto", order: Any = None, progress: bool = True
    ):
        if correction not in CORRECTIONS:
            raise ValueError(f"correction is {correction!r}, but it must be one of {', '.join(CORRECTIONS)}.")
        N = problem.coordinates.shape[0]
        if order is not None and not np.array_equal(np.sort(order), np.arange(N)):
            raise ValueError(f"order must be a permutation of 0, ..., {N - 1}.")
        announce_compilation()
        began = perf_counter()
        self.problem: Any = problem
        self.progress = progress
        A = block_matrix(problem.A)
        self.loop = NodeLoop(A, problem.contact_nodes, problem.normal, problem.friction, order)
        self.correction = self._make(correction)
        self.setup_seconds = perf_counter() - began
        self._unpaid = self.setup_seconds

    @cached_property
    def rigid(self) -> Any:
        """Rigid modes of the problem."""
        problem = self.problem
        return RigidModes(problem.A, problem.coordinates, problem.contact_nodes, problem.turning)

    def _make(self, correction: str) -> Any:
        problem, loop = self.problem, self.loop
        if correction == "auto":
            correction = choose(problem)
        if correction == "none":
            return Relaxation(loop)
        if correction == "multigrid":
            if not problem.prolongations:
                raise ValueError(
                    "correction is 'multigrid', but the problem has no prolongations; "
                    "use a body of nested meshes, or 'algebraic'."
                )
            return geometric(loop, problem.prolongations, self.rigid)
        if correction == "algebraic":
            return algebraic(problem.A, loop, self.rigid)
        return Condensation(problem.A, loop, self.rigid)

    def solve(
        self,
        b: np.ndarray | None = None,
        gap: np.ndarray | None = None,
        tangential_reference: np.ndarray | None = None,
        start: np.ndarray | None = None,
        start_status: np.ndarray | None = None,
        slipped: np.ndarray | None = None,
        normal: np.ndarray | None = None,
        tolerance: float = 1e-10,
        limit: int = 100_000,
        slip_rate: float = 1.0,
        places: np.ndarray | None = None,
        springs: np.ndarray | None = None,
        part: float = 0.0,
    ) -> Solution:
        """Solve for one load.

        Parameters
        ----------
        b : (N, d), optional
            Load; default the problem's. Likewise `gap` (n,) and `tangential_reference` (n, d).
        start : (N, d), optional
            First guess; default zero.
        start_status : (n,), optional
            Statuses to start from; nodes in contact are placed on the road first.
        slipped : (n,), optional
            1 where a node slipped at the end of the last step, for friction laws that ask: the `state` of the
            last Solution. Default 0.
        normal : (n, d), optional
            Unit normals of other planes than the problem's; gaps may then have any sign.
        tolerance : float
            Natural residual to reach.
        limit : int
            Residual tests before giving up.
        slip_rate : float
            What the friction law's slip is multiplied by: 1 for increments, 1/dt for speeds.
        places : (n, d), optional
            Points of the road at which nodes stick, for friction that depends on them; default those of the
            planes.
        springs : (n, d, d), optional
            Stiffness of springs that hold the candidates where they are at the start, for this solve.
        part : float
            Of the first residual, at which the solve may end as well: for one of several, to be made good by
            the next.

        Returns
        -------
        Solution

        Raises
        ------
        NotConverged
            With residual, history and counts, if the tolerance is not reached.
        ValueError
            If an argument is not finite or does not fit, a node starts below the road or is prescribed a
            place there, or nothing can hold the body against the load.

        Warns
        -----
        FrictionLeftOut
            Where nodes with friction in space are prescribed along one axis, obliquely to the road.
        """
        began = perf_counter()
        is_tolerance(tolerance)
        positive(limit=limit, slip_rate=slip_rate)
        loop, first, steps = self.loop, self.loop.sweeps, int(self.correction.steps[0])
        self.correction.steps[1] = 0
        loop.slip_rate = slip_rate
        u, start_status, posed = self._checked(
            start, start_status, b, gap, tangential_reference, slipped, normal is None
        )
        posed = self._laid(posed, normal, places, part)
        if springs is None and not posed.balanced:
            record = Record(tolerance, limit, lambda: 0, progress=False, history=[1.0], ranks=self.ranks)
            record.give_up("the load drives the body into a motion that none of the planes can stop")
        loop.put_springs(springs)
        loop.prescribe(posed.load, u)
        self._require_room(u, posed.gap)
        self.posed = posed

        def opened(status: np.ndarray, history: Sequence[float] = ()) -> Record:
            return Record(
                tolerance,
                limit + len(history),
                lambda: loop.sweeps - first,
                self.progress,
                lambda tests: self._causes(u, status, tests, tolerance),
                lambda: self._floor(u),
                part=part,
                history=list(history),
                ranks=self.ranks,
            )

        base, status, record = self._solve_in_parts(posed, u, start_status, opened)
        seconds = perf_counter() - began
        spent, setup, self._unpaid = seconds + self._unpaid, self._unpaid, 0.0
        return Solution(
            **self._outcome(posed, base, u, status),
            residual=record.history[-1],
            history=np.array(record.history),
            correction=self.correction.name,
            sweeps=loop.sweeps - first,
            cycles=record.cycles,
            steps=int(self.correction.steps[0]) - steps,
            most_steps=int(self.correction.steps[1]),
            work_units=spent / (loop.seconds_of_passes / loop.passes),
            seconds=seconds,
            setup_seconds=setup,
            peak_memory=getrusage(RUSAGE_SELF).ru_maxrss * 1024,
        )

    def _checked(
        self, start: Any, start_status: Any, b: Any, gap: Any, reference: Any, slipped: Any, flat: bool
    ) -> tuple[Any, ...]:
        """Check what is given for a solve on every rank, and take the rest from the problem.

        Return first guess and status, and what is posed, its state being who slipped (n,).
        """
        problem, loop, trouble = self.problem, self.loop, ""
        shape, n = loop.field_shape, loop.nodes.size
        try:
            u = np.zeros(shape) if start is None else shaped("start", start, shape).copy()
            if start_status is not None:
                start_status = shaped("start_status", start_status, (n,))
                if not np.isin(start_status, list(Status)).all():
                    raise ValueError("start_status holds other values than those of Status, 0, 1 and 2.")
            load = self.ranks.own(problem.b if b is None else shaped("b", b, shape))
            gap = problem.gap if gap is None else gap
            # the distance to a plane that the road touches elsewhere may be negative
            gap = problem.checked_gap(gap) if flat else shaped("gap", gap, (n,))
            reference = problem.tangential_reference if reference is None else reference
            reference = shaped("tangential_reference", reference, loop.force.shape)
            slipped = np.zeros(n) if slipped is None else shaped("slipped", slipped, (n,))
        except ValueError as error:
            trouble = str(error)
        self.ranks.agree(trouble)
        return u, start_status, Posed(load, gap, reference, slipped, u[loop.nodes])

    def _laid(self, posed: Posed, normal: Any, places: Any, part: float) -> Posed:
        """Lay the planes, tell the friction law of the nodes, and see whether the road can hold the body."""
        problem, loop = self.problem, self.loop
        self.take_planes(problem.normal if normal is None else normal)
        if places is None and loop.friction is not None and loop.friction.by_place:
            height = posed.gap + np.einsum("ca,ca->c", loop.normal, posed.reference)
            places = problem.coordinates[loop.nodes] + posed.reference - height[:, None] * loop.normal
        state = loop.told(posed.state, places)
        mu = np.zeros(loop.nodes.size) if loop.friction is None else state[:, 1]
        planes, balanced = (posed.load, loop.normal, mu), True
        if normal is None:
            self.rigid.require_balance(*planes, BALANCE)
        elif not self.rigid.bears(*planes, BALANCE):  # on a curved road others may hold the body in the end
            balanced = part > 0.0 and self.rigid.bears(*planes, part)
        return posed._replace(state=state, balanced=balanced)

    def _solve_in_parts(
        self, posed: Posed, u: np.ndarray, status: np.ndarray | None, opened: Callable[..., Record]
    ) -> tuple[np.ndarray, np.ndarray, Record]:
        """Solve from u (N, d), which becomes the last part of the displacement; return the rest of it.

        Rigid motion is carried apart, since A does not resist it but would round it; so is what was found
        before, where its rounding leaves more than is asked for.
        """
        loop, rigid = self.loop, self.rigid
        self._away, bent, base = "", np.zeros_like(u), rigid.part_of(u)
        u -= base
        self._put_load(posed, base, bent)
        status = loop.start(u, status)
        if rigid.count and (loop.springs is not None or not status.any()):
            normal, gap = loop.frame[:, 0], loop.gaps(u, status)
            if loop.springs is None:
                landed, self._away = rigid.landing(posed.load, normal, loop.coefficient, gap)
            else:
                landed = rigid.landing_on_springs(posed.load, normal, gap, loop.springs)
            base += landed
            self._put_load(posed, base, bent)
            status = loop.start(u, status)
        load_size, least = loop.load_size, np.inf

        def count_from(there: np.ndarray) -> None:
            nonlocal base
            base = bent + rigid.part_of(there - bent)  # far motions that cancel leave their rounding
            self._put_load(posed, base, bent)
            loop.load_size = load_size

        def carry(motion: np.ndarray, u: np.ndarray) -> Any:
            if np.abs(motion).max() <= max(np.abs(u).max(), FINE * np.abs(base).max()):
                return motion  # u has digits enough, or the base has not
            count_from(base + motion)
            return 0.0

        kept, loop.carry = loop.carry, carry
        try:
            record = opened(status)
            self.correction.solve(u, status, record)
            while record.rounded:
                if record.best > 0.5 * least:
                    record.give_up("the displacement in two parts is no truer than in one")
                least, bent = record.best, bent + (u - rigid.part_of(u))
                count_from(base + u)
                u[:] = 0.0
                status[:] = loop.start(u, status)
                record = opened(status, record.history)
                self.correction.solve(u, status, record)
        finally:
            loop.carry = kept  # the other holds the solver
        return base, status, record

    def _put_load(self, posed: Posed, base: np.ndarray, bent: np.ndarray) -> None:
        """Pose the problem for what is added to a displacement `base`, of which `bent` strains the body."""
        loop, rest, at = self.loop, posed.load, base[self.loop.nodes]
        if bent.any():
            rest = missing_at(self.problem.A if loop.springs is None else bsr(loop.A), rest, bent)
        loop.set_load(rest, gap_at(posed.gap, loop.normal, at), posed.reference - at, posed.state)
        if loop.springs is not None:
            loop.pull(posed.held - (base - bent)[loop.nodes])

    def _outcome(self, posed: Posed, base: np.ndarray, u: np.ndarray, status: np.ndarray) -> dict[str, Any]:
        """Return the displacement base + u (N, d), on the road in contact, and what the road does to it."""
        loop = self.loop
        loop.confirm(status)
        lies, u = status != Status.FREE, base + u
        distance = gap_at(posed.gap, loop.normal, u[loop.nodes])  # where they lie by rounding only: it goes
        u[loop.nodes[lies]] -= (distance / loop.part)[lies, None] * loop.frame[lies, 0]
        loop.prescribe(posed.load, u)  # rounding of the rigid part moves no support
        self.ranks.update(u)
        force, pressure = loop.reaction(u[loop.nodes] - posed.reference)
        return {
            "displacement": u,
            "contact_force": force,
            "pressure_force": pressure,
            "gap": np.where(lies, 0.0, np.maximum(distance, 0.0)),
            "status": status,
            "state": np.asarray(status == Status.SLIP, dtype=np.float64),
            "unique": not self.rigid.loose(loop.frame, status, pressure).shape[1],
        }

    def take_planes(self, normal: np.ndarray) -> None:
        """Give every candidate a plane by its unit normal (n, d), unless it has it."""
        if self.ranks.any(not np.array_equal(normal, self.loop.normal)):
            self.loop.update_normals(normal)
            self.correction.update_normals()
        loop = self.loop
        oblique = loop.nodes[loop.oblique & ~loop.guided] if loop.friction is not None else loop.nodes[:0]
        if len(oblique):
            warnings.warn(
                f"Friction is left out at {len(oblique)} nodes that may touch, the first is node "
                f"{oblique[0]}: they are prescribed in part, and what is free of them is oblique to the "
                "road; prescribe them wholly, free them, or leave them out of the contact boundary.",
                FrictionLeftOut,
                stacklevel=3,
            )

    def _floor(self, u: np.ndarray) -> float:
        """Natural residual that the rounding of u (N, d) may leave."""
        return rounding_floor(self.loop.A, u, self.loop.scale)

    def _causes(self, u: np.ndarray, status: np.ndarray, tests: list[float], tolerance: float) -> list[str]:
        """Say why a solve may not have converged.

        First, if so, that the load would strain the body beyond all measure, that it would never come to
        rest, or that friction alone holds it.
        """
        loop, said = self.loop, []
        strained = float(np.abs(loop.diagonal).max()) * length_scale(self.problem.coordinates)  # wholly
        free = self._away or loop.friction is None
        motion = "" if free else self.rigid.held_by_friction(loop.b, loop.normal)
        if self._away:
            said = [
                f"the load, which carries the body off in {self._away} without end, for only friction could "
                "hold it: load it towards the road or fix it"
            ]
        elif motion:
            said = [
                f"friction, which alone could hold the body against {motion} and may give less than that "
                "takes: fix the body, or take smaller load steps"
            ]
        if loop.load_size > strained > 0.0:
            strain = loop.load_size / strained
            said.insert(0, f"the load, which strains a cell by {strain:.1g} or more: check its units and E's")
        held = not (self._away or motion)
        return said + likely_causes(loop, u, status, tests, tolerance, self.correction.name, held)

    def _require_room(self, u: np.ndarray, gap: np.ndarray) -> None:
        """Refuse a node that is prescribed a place below the road."""
        loop, nodes, there = self.loop, self.loop.nodes, u[self.loop.nodes]
        held = loop.uncoupled[nodes] & (not loop.uncoupled.all())  # a diagonal matrix prescribes nothing
        gap = gap + np.einsum("ca,ca->c", loop.normal, there)
        near = ON_ROAD * length_scale(self.problem.coordinates)
        self.ranks.agree(held_below_road(gap, loop.normal, nodes, held, there, near))


def choose(problem: ContactProblem) -> str:
    """Pick the correction for `auto`.

    Multigrid on large nested meshes, direct where a factorisation is cheap, else algebraic.
    """
    N, d = problem.coordinates.shape
    if problem.prolongations and N * d > MULTIGRID_PAYS:
        return "multigrid"
    return "direct" if N * d <= DIRECT_PAYS[d] else "algebraic"
