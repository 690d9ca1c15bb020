"""Solve a scene and have it judged: what became of it, in one line."""

import time
import warnings
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from geometry import MovingRoad
from model import ContactSolver, MovingBody, NotConverged, follow, solve
from model.dynamics.schemes import IMPLICIT
from model.quasistatics.curved_contact import CurvedContact

from .existence import has_equilibrium
from .judge import (
    DRIVEN,
    EPS,
    Answer,
    Posed,
    complaints,
    driven_power,
    free_motions,
    gives_way,
    leaves,
    never_rests,
    prescribed_below,
)
from .rest import slides_on
from .scenes import SMALL_ENOUGH, Scene, elastic

OUTCOMES = (
    "solved",
    "wrong",
    "refused, confirmed",
    "refused wrongly",
    "none exists, proved",
    "endless, seen twice",
    "not converged",
)
STEPS = 4  # of a load path
EDGE = 1e-3  # of DRIVEN: between the two, either answer will do


@dataclass
class Outcome:
    """What became of a scene.

    Attributes
    ----------
    number : int
    outcome : str
        One of `OUTCOMES`.
    said : str
        The solver's sentence, or the judge's.
    scene : str
    friction : float
        Coefficient, 0 without friction.
    curved : bool
    kind, correction : str
    cycles, steps, most_steps : int
        Corrections of the last solve, its steps in small problems, and the most in one of them.
    unknowns, contacts : int
    seconds : float
        Of the solver.
    """

    number: int
    outcome: str
    said: str
    scene: str
    friction: float
    curved: bool
    kind: str
    correction: str
    cycles: int = 0
    steps: int = 0
    most_steps: int = 0
    unknowns: int = 0
    contacts: int = 0
    seconds: float = 0.0


def tried(scene: Scene) -> dict[str, Any]:
    """Solve a scene, judge it, and return the outcome as a dictionary."""
    words = scene.words
    outcome = Outcome(
        scene.number,
        "solved",
        "",
        str(scene),
        words["friction"] or 0.0,
        scene.curved,
        words["kind"],
        words["correction"],
        unknowns=scene.pressed.problem.b.size,
    )
    began, pairs = time.perf_counter(), []
    try:
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            warnings.simplefilter("error", RuntimeWarning)
            way = {"static": _static, "load steps": _in_steps, "time step": _in_time}[words["kind"]]
            last = way(scene, pairs)
        outcome.seconds = time.perf_counter() - began
        outcome.cycles, outcome.steps = int(last.cycles), int(getattr(last, "steps", 0))
        outcome.most_steps = int(getattr(last, "most_steps", 0))
        outcome.contacts = int(np.count_nonzero(last.status))
        for number, (posed, answer) in enumerate(pairs, start=1):
            wrong = posed.off_road + complaints(posed, answer)
            if wrong:
                outcome.outcome, outcome.said = "wrong", f"step {number}: " + "; ".join(wrong)
                break
    except NotConverged as error:
        outcome.outcome, said = _without_answer(scene, pairs)
        outcome.said = str(error) + said
    except ValueError as error:
        confirmed = _power(scene) > EDGE * DRIVEN or (scene.curved and _never_rests(scene))
        confirmed = confirmed or prescribed_below(_posed(scene), scene.road, scene.pressed.points)
        outcome.outcome = "refused, confirmed" if confirmed else "refused wrongly"
        outcome.said = str(error)
    except Exception as error:  # whatever it is, the scene has no answer
        outcome.outcome, outcome.said = "wrong", f"{type(error).__name__}: {error}"
    outcome.seconds = outcome.seconds or time.perf_counter() - began
    return asdict(outcome)


def _without_answer(scene: Scene, pairs: list) -> tuple[str, str]:
    """Say what the judge thinks of a scene that was solved up to some steps, and what else it found."""
    if _power(scene) > DRIVEN or _never_rests(scene):
        return "refused, confirmed", ""
    if not scene.curved and scene.words["kind"] != "time step":  # in which inertia balances any load
        exists = has_equilibrium(_next(scene, pairs))
        if exists:
            return "not converged", " The judge finds an equilibrium."
        if exists is False:
            return "none exists, proved", ""
        if slides_on(_posed(scene)):
            return "endless, seen twice", ""
    return "not converged", ""


def _next(scene: Scene, pairs: list) -> Posed:
    """The problem of the step after some that were solved."""
    if scene.words["kind"] == "static":
        return _posed(scene)
    nodes, b = scene.pressed.problem.contact_nodes, scene.pressed.problem.b
    return _posed(scene, (len(pairs) + 1) / STEPS * b, pairs[-1][1].displacement[nodes] if pairs else None)


def _power(scene: Scene) -> float:
    """Power of the load in a rigid motion that nothing stops."""
    posed = _posed(scene)
    if not scene.curved:
        return driven_power(posed)
    reach = scene.words["size"] * np.linspace(-12.0, 12.0, 97)
    points, dim = scene.pressed.points, scene.pressed.problem.dim
    normals = [posed.normal]
    for axis in (0, dim - 1):
        for way in reach:
            normals.append(scene.road.closest(points + way * np.eye(dim)[axis])[1])
    unique = np.unique(np.round(np.concatenate(normals), 2), axis=0)
    unique /= np.linalg.norm(unique, axis=1, keepdims=True)
    return driven_power(posed, unique)


def _never_rests(scene: Scene) -> bool:
    """Whether the load carries the body off without end, or at least far along a curved road."""
    posed = _posed(scene)
    road, points = scene.road, scene.pressed.points
    return (
        leaves(posed, road, points) or gives_way(posed, road, points) if scene.curved else never_rests(posed)
    )


def _posed(scene: Scene, b: np.ndarray | None = None, reference: np.ndarray | None = None) -> Posed:
    problem = scene.pressed.problem
    return Posed(
        problem.A.tocsr(),
        problem.b if b is None else b,
        problem.coordinates,
        problem.contact_nodes,
        problem.normal,
        problem.gap,
        problem.friction_coefficient,
        np.zeros_like(problem.normal) if reference is None else reference,
        rounding=16 * EPS * np.abs(scene.pressed.points).max(),
    )


def _correction(scene: Scene) -> str:
    """The correction that the scene asks for; the plain loop only where it comes to an end."""
    name = scene.words["correction"]
    held = not free_motions(_posed(scene)).shape[1] and scene.words["support"] != "springs"
    small = len(scene.pressed.problem.coordinates) <= SMALL_ENOUGH
    return "direct" if name == "none" and not (small and held) else name


def _answer(solution: Any) -> Answer:
    return Answer(solution.displacement, solution.contact_force, solution.gap)


def _static(scene: Scene, pairs: list) -> Any:
    if not scene.curved:
        solution = solve(scene.pressed, _correction(scene), progress=False)
        pairs.append((_posed(scene), _answer(solution)))
        return solution
    solver = ContactSolver(scene.pressed.problem, _correction(scene), progress=False)
    contact = CurvedContact(solver, scene.pressed.points)
    solution = contact.solve(scene.road)
    anchor = scene.road.closest(scene.pressed.points)[2] - scene.pressed.points
    pairs.append((_on_planes(scene, contact, solution, reference=anchor), _answer(solution)))
    return solution


def _on_planes(scene: Scene, contact: Any, solution: Any, **options: Any) -> Posed:
    """Pose the problem on the planes that touch the road where the nodes have come to be.

    Their normals and feet are taken from the road itself at nodes that touch; where the road has a corner
    there, the solver's normal must lie between those of its two sides.
    """
    posed = _posed(scene, **options)
    u = solution.displacement[posed.nodes]
    gap, normal, _ = scene.road.closest(scene.pressed.points + u)
    touching = solution.gap == 0.0
    posed.normal = np.where(touching[:, None], contact.normal, normal)
    posed.gap = np.where(touching, 0.0, gap) - np.einsum("ca,ca->c", u, posed.normal)
    posed.rounding = 16 * EPS * (np.abs(u).max() + np.abs(scene.pressed.points).max())
    posed.off_road = _normal_is_the_roads(scene, contact, solution)
    return posed


def _normal_is_the_roads(scene: Scene, contact: Any, solution: Any) -> list[str]:
    """Whether nodes that touch are on the road, the others above it, and forces along its normals.

    At a peak, and in a hollow, the road has a wedge of normals: those seen from a little above, or below.
    """
    size, nodes = scene.words["size"], scene.pressed.problem.contact_nodes
    at = scene.pressed.points + solution.displacement[nodes]
    far = max(float(np.abs(at).max()), size)
    gap, _, _ = scene.road.closest(at)
    touching = solution.gap == 0.0
    said = []
    if touching.any() and np.abs(gap[touching]).max() > 1e-11 * far:
        said.append(f"nodes that touch are {np.abs(gap[touching]).max() / size:.1e} sizes off the road")
    if (~touching).any() and gap[~touching].min() < -1e-11 * far:
        said.append(f"a node is {-gap[~touching].min() / size:.1e} sizes below the road")
    loaded = touching & (solution.pressure_force > 1e-6 * solution.pressure_force.max(initial=0.0))
    if loaded.any():
        little = 1e-4 * size
        normal, foot = contact.normal[loaded], at[loaded]
        off = [
            np.linalg.norm(scene.road.closest(foot + side * little * normal)[2] - foot, axis=1) / little
            for side in (1.0, -1.0)
        ]
        worst = np.minimum(*off).max()
        if worst > 1e-4:
            said.append(f"a normal is {worst:.1e} off the road's")
    return said


def _in_steps(scene: Scene, pairs: list) -> Any:
    """A load path, each step judged with the sticking points that the last one left."""
    problem, correction = scene.pressed.problem, _correction(scene)
    loads = [k / STEPS * problem.b for k in range(1, STEPS + 1)]
    reference = np.zeros_like(problem.normal)
    if not scene.curved:
        for b, solution in zip(loads, follow(scene.pressed, loads, correction, progress=False)):
            pairs.append((_posed(scene, b, reference), _answer(solution)))
            reference = solution.displacement[problem.contact_nodes]
        return solution
    contact = CurvedContact(ContactSolver(problem, correction, progress=False), scene.pressed.points)
    still = MovingRoad(scene.road, np.zeros(problem.dim))
    for b, solution in zip(loads, contact.follow(still, enumerate(loads, start=1))):
        anchor = scene.road.closest(scene.pressed.points + reference)[2] - scene.pressed.points
        pairs.append((_on_planes(scene, contact, solution, b=b, reference=anchor), _answer(solution)))
        reference = solution.displacement[problem.contact_nodes]
    return solution


def _in_time(scene: Scene, pairs: list) -> Any:
    """Two steps of a body thrown at the road; the judge gets the problem that each step poses."""
    words, pressed = scene.words, scene.pressed
    random = np.random.default_rng(scene.number)
    M = elastic(words["shape"], words["E"], words["nu"], words["size"])[2]
    M = scene.support.apply(M, np.zeros_like(scene.load)).A
    problem = pressed.problem
    body = MovingBody(
        M,
        problem.A,
        problem.b,
        problem.coordinates,
        problem.contact_nodes,
        scene.road,
        None,
        words["friction"],
    )
    wave = np.sqrt(words["E"])
    dt = words["size"] / wave * 10.0 ** random.uniform(-3.0, 1.0)
    scheme = IMPLICIT[list(IMPLICIT)[random.integers(len(IMPLICIT))]](body, dt)
    velocity = np.zeros_like(problem.b)
    velocity[:] = 0.01 * wave * random.uniform(-1.0, 1.0, problem.dim)
    velocity[body.prescribed] = 0.0
    state = scheme.start(velocity=velocity)
    for _ in range(2):
        before, state = state, scheme.step(state)
        moved, b, touch = scheme.posed
        gap, normal = body.gaps(before.displacement)
        gap = np.where(before.gap == 0.0, 0.0, gap) + np.einsum("ca,ca->c", normal, moved[body.contact_nodes])
        posed = Posed(
            scheme.effective_matrix().tocsr(),
            b,
            problem.coordinates,
            problem.contact_nodes,
            normal,
            gap,
            problem.friction_coefficient,
            -moved[body.contact_nodes],
            rounding=16 * EPS * (np.abs(before.displacement).max() + np.abs(moved).max() + body.size),
        )
        pairs.append((posed, Answer(touch.increment, touch.force, touch.gap)))
    return state
