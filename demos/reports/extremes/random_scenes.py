"""Random scenes that must be right, and random values that must be refused.

A space says from what each argument is drawn; the demo draws with numpy, the tests with hypothesis.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial

import numpy as np
from harness.verdict import RESIDUAL, deviation, is_sentence

from forms import Elasticity, Isotropic, Support
from geometry import Body, Plane, half_cylinder, rectangle, ring
from model import (
    HHT,
    BodyOnRoad,
    ContactProblem,
    ContactSolver,
    GeneralisedAlpha,
    MovingBody,
    Newmark,
    coulomb,
    solve,
)
from model.closed_forms.hertz import HertzCylinder
from model.dynamics.schemes import IMPLICIT

from .scenes import certificate, pressed
from .time import books, thrown


@dataclass(frozen=True)
class Range:
    """From one number to another."""

    low: float
    high: float


class Between(Range):
    """A number between two."""


class Powers(Range):
    """10^x with x between two numbers."""


class Whole(Range):
    """A whole number from one to another."""


@dataclass(frozen=True)
class OneOf:
    """One of several values."""

    values: tuple


def draw(space, random):
    """Draw a dictionary of arguments with a numpy generator."""
    drawn = {}
    for name, what in space.items():
        if isinstance(what, OneOf):
            drawn[name] = what.values[random.integers(len(what.values))]
        elif isinstance(what, Whole):
            drawn[name] = int(random.integers(what.low, what.high + 1))
        else:
            x = float(random.uniform(what.low, what.high))
            drawn[name] = 10.0**x if isinstance(what, Powers) else x
    return drawn


MU = OneOf((None, 1e-6, 0.05, 0.3, 0.7, 1.0))
STATIC = {
    "cell": OneOf(("quadrilateral", "triangle")),
    "columns": Whole(1, 8),
    "rows": Whole(1, 4),
    "width": Powers(-1, 1),
    "size": Powers(-9, 5),
    "distortion": Between(0.0, 0.24),
    "seed": Whole(0, 999),
    "E": Powers(-3, 15),
    "nu": Between(-0.5, 0.48),
    "strain": Powers(-10, -1.5),
    "shear": Between(-2.0, 2.0),
    "by_force": OneOf((False, True)),
    "mu": MU,
    "turn": OneOf((0.0, 0.0, np.pi / 2, 1.0, -2.5)),
    "rounded": Between(0.0, 0.3),
}


def static_error(
    *, cell, columns, rows, width, size, distortion, seed, E, nu, strain, shear, by_force, mu, turn, rounded
):
    """Error of a random block that is pressed, by the conditions of contact themselves.

    Once more with the nodes visited backwards.
    """
    grid = rectangle(width, 1.0, columns, rows, cell, distortion=distortion, seed=seed)
    x = grid.points[:, 0] / width - 0.5
    grid.points[:, 1] += rounded * strain * (2 * x) ** 2 * (1.0 - grid.points[:, 1])
    grid.points *= size
    if by_force:
        way, turn = {"force": (0.0, -E * strain * width * size)}, 0.0
    else:
        way = {"displacement": (shear * strain * size, -strain * size)}
    problem = pressed(grid, Isotropic(E, nu), friction=mu, turn=turn, **way).problem
    solution = solve(problem, "direct", tolerance=1e-12)
    backwards = np.arange(len(problem.coordinates))[::-1]
    other = solve(problem, "direct", tolerance=1e-12, order=backwards)
    return max(
        certificate(problem, solution), deviation(other.contact_force, solution.contact_force)
    ), solution.residual


MOVING = {
    "name": OneOf(tuple(IMPLICIT)),
    "dt": Powers(-4, -0.5),
    "E": Powers(-3, 9),
    "nu": Between(-0.5, 0.45),
    "density": Powers(-3, 3),
    "speed": Between(-3.0, 3.0),
    "falls": Between(-3.0, 1.0),
    "around": OneOf((12, 16, 24)),
    "inner": Between(0.1, 0.4),
    "mu": MU,
    "damping": OneOf((None, (0.0, 0.1), (0.1, 0.0))),
}


def motion_error(*, name, dt, E, nu, density, speed, falls, around, inner, mu, damping):
    """Error of a ring thrown on the road, by the books of energy and momentum.

    dt is in units of the time that a wave takes through the ring, speeds in hundredths of the wave's.
    """
    wave = np.sqrt(E / density)
    body = Body.from_grid(ring(0.5, inner, around, 3))
    elasticity = Elasticity(body, Isotropic(E, nu))
    load = elasticity.body_force((0.0, -1e-3 * E))
    if damping is not None:
        damping = (damping[0] * wave, damping[1] / wave)
    moving = MovingBody.from_forms(elasticity, density, load, Plane(), "outer", damping=damping, friction=mu)
    scheme = IMPLICIT[name](moving, dt / wave)
    return books(scheme, scheme.start(velocity=thrown(moving, 0.01 * speed * wave, 0.01 * falls * wave)), 6)[
        :2
    ]


NO_NUMBER = (np.nan, np.inf, -np.inf)


@dataclass(frozen=True)
class Refusal:
    """A call that must be refused.

    Attributes
    ----------
    call : callable of the value
    names : str
        What the sentence must speak of.
    bad : tuple of spaces, from one of which the value is drawn
    """

    call: Callable
    names: str
    bad: tuple


@cache
def body():
    """A small block, its elasticity, its contact problem, and the block as a moving body."""
    mesh = Body.from_grid(rectangle(1.0, 1.0, 2, 2))
    elasticity = Elasticity(mesh, Isotropic(1.0, 0.3))
    load = elasticity.total_force("top", (0.0, -0.1))
    system = elasticity.system(load, Support(mesh).fix("top", x=0.0))
    problem = BodyOnRoad(system, "bottom", Plane(), friction=0.3).problem
    return elasticity, problem, MovingBody.from_forms(elasticity, 1.0, load, Plane(), "bottom")


def changed(name, value):
    """Give the contact problem another value of one array at one place."""
    problem = body()[1]
    names = ("A", "b", "coordinates", "contact_nodes", "normal", "gap")
    arrays = {each: getattr(problem, each) for each in names}
    arrays[name] = arrays[name].copy()
    if name == "A":
        arrays[name].data[0] = value
    else:
        arrays[name][0] = value
    return ContactProblem(**arrays)


def solved(name, value):
    """Solve with one array that has a wrong value at one place."""
    problem = body()[1]
    at = {
        "b": problem.b,
        "start": problem.b,
        "gap": problem.gap,
        "tangential_reference": problem.tangential_reference,
    }
    array = np.zeros_like(at[name])
    array.ravel()[-1] = value
    return ContactSolver(problem, "direct").solve(**{name: array})


def thrown_at(name, value):
    """Start with a wrong value at one node."""
    moving = body()[2]
    field = np.zeros_like(moving.coordinates)
    field[-1, -1] = value
    return Newmark(moving, 0.1).start(**{name: field})


NUMBERS = OneOf(NO_NUMBER)
NEGATIVE = OneOf(tuple(-(10.0**x) for x in (-300, -9, 0, 9, 300)))
ZERO = OneOf((0.0,))
NOT_POSITIVE = (NUMBERS, NEGATIVE, ZERO)
NOT_NEGATIVE = (NUMBERS, NEGATIVE)
REFUSALS = [
    Refusal(lambda v: Isotropic(v, 0.3), "E ", NOT_POSITIVE),
    Refusal(lambda v: Isotropic(1.0, v), "nu", (NUMBERS, Between(0.5, 9.0), Between(-9.0, -1.0))),
    Refusal(lambda v: rectangle(v, 1.0, 2, 2), "width", NOT_POSITIVE),
    Refusal(lambda v: rectangle(1.0, v, 2, 2), "height", NOT_POSITIVE),
    Refusal(lambda v: rectangle(1.0, 1.0, v, 2), "columns", (Whole(-9, 0), NUMBERS, Between(0.1, 0.9))),
    Refusal(
        lambda v: rectangle(1.0, 1.0, 2, 2, distortion=v), "distortion", (*NOT_NEGATIVE, Between(0.5, 9.0))
    ),
    Refusal(lambda v: rectangle(1.0, 1.0, 2, 2, corner=(v, 0.0)), "corner", (NUMBERS,)),
    Refusal(lambda v: ring(v, 0.1), "outer", NOT_POSITIVE),
    Refusal(lambda v: ring(1.0, v), "inner", (*NOT_POSITIVE, Between(1.0, 9.0))),
    Refusal(lambda v: ring(1.0, 0.5, v), "around", (Whole(-9, 5), OneOf((7, 9, 61)))),
    Refusal(lambda v: half_cylinder(v), "radius", NOT_POSITIVE),
    Refusal(lambda v: half_cylinder(1.0, v), "columns", (Whole(-9, 3), OneOf((5, 41)))),
    Refusal(lambda v: half_cylinder(1.0, spacing=v), "spacing", NOT_POSITIVE),
    Refusal(lambda v: Plane((v, 0.0)), "point", (NUMBERS,)),
    Refusal(lambda v: Plane(normal=(v, 1.0)), "normal", (NUMBERS,)),
    Refusal(lambda v: body()[0].mass(v), "density", NOT_POSITIVE),
    Refusal(lambda v: body()[0].damping(v, 0.0, 1.0), "alpha", NOT_NEGATIVE),
    Refusal(lambda v: body()[0].damping(0.0, v, 1.0), "beta", NOT_NEGATIVE),
    Refusal(lambda v: body()[0].body_force((0.0, v)), "body force", (NUMBERS,)),
    Refusal(lambda v: body()[0].traction("top", (v, 0.0)), "traction", (NUMBERS,)),
    Refusal(lambda v: body()[0].total_force("top", (v, 0.0)), "total force", (NUMBERS,)),
    Refusal(lambda v: Support(body()[0].body).fix("top", x=v), "displacement", (NUMBERS,)),
    Refusal(lambda v: Support(body()[0].body).fix_node(v, x=0.0), "node", (Whole(9, 99), Whole(-9, -1))),
    Refusal(coulomb, "mu", NOT_NEGATIVE),
    Refusal(partial(changed, "A"), "A ", (NUMBERS,)),
    Refusal(partial(changed, "b"), "b ", (NUMBERS,)),
    Refusal(partial(changed, "coordinates"), "coordinates", (NUMBERS,)),
    Refusal(partial(changed, "contact_nodes"), "contact_nodes", (Whole(9, 99), Whole(-9, -1))),
    Refusal(partial(changed, "normal"), "normal", (NUMBERS, NEGATIVE, Between(0.1, 0.9))),
    Refusal(partial(changed, "gap"), "gap", (NUMBERS, OneOf((-1e-9, -1.0, -1e300)))),
    Refusal(partial(solved, "b"), "b ", (NUMBERS,)),
    Refusal(partial(solved, "start"), "start", (NUMBERS,)),
    Refusal(partial(solved, "gap"), "gap", (NUMBERS, OneOf((-1e-9, -1.0, -1e300)))),
    Refusal(partial(solved, "tangential_reference"), "tangential_reference", (NUMBERS,)),
    Refusal(lambda v: solve(body()[1], "direct", tolerance=v), "tolerance", NOT_POSITIVE),
    Refusal(lambda v: solve(body()[1], "direct", limit=v), "limit", (Whole(-9, 0),)),
    Refusal(lambda v: solve(body()[1], "direct", slip_rate=v), "slip_rate", NOT_POSITIVE),
    Refusal(lambda v: Newmark(body()[2], v), "dt", NOT_POSITIVE),
    Refusal(
        lambda v: Newmark(body()[2], 0.1, gamma=v),
        "gamma",
        (NUMBERS, Between(-9.0, 0.49), Between(0.51, 9.0)),
    ),
    Refusal(
        lambda v: HHT(body()[2], 0.1, alpha=v), "alpha", (NUMBERS, Between(-9.0, -0.01), Between(0.34, 9.0))
    ),
    Refusal(
        lambda v: GeneralisedAlpha(body()[2], 0.1, rho=v), "rho", (NUMBERS, NEGATIVE, Between(1.01, 9.0))
    ),
    Refusal(partial(thrown_at, "velocity"), "velocity", (NUMBERS,)),
    Refusal(partial(thrown_at, "displacement"), "displacement", (NUMBERS,)),
    Refusal(lambda v: HertzCylinder(v, 1.0, 1.0, 0.3), "P ", NOT_POSITIVE),
    Refusal(lambda v: HertzCylinder(1.0, v, 1.0, 0.3), "R ", NOT_POSITIVE),
    Refusal(lambda v: HertzCylinder(1.0, 1.0, v, 0.3), "E ", NOT_POSITIVE),
    Refusal(
        lambda v: HertzCylinder(1.0, 1.0, 1.0, v), "nu", (NUMBERS, Between(0.51, 9.0), Between(-9.0, -1.0))
    ),
]


def complaint(refusal, value):
    """Say what is wrong with how a value is refused; nothing if nothing is."""
    try:
        with np.errstate(all="ignore"):
            refusal.call(value)
    except ValueError as error:
        words = str(error)
        if not is_sentence(words):
            return f"no sentence: {type(error).__name__}: {words}"
        return (
            ""
            if refusal.names.lower() in f"{words} ".lower()
            else f"does not speak of {refusal.names!r}: {words}"
        )
    except Exception as error:
        return f"{type(error).__name__}: {error}"
    return f"takes {value} for {refusal.names!r}"


def random_faults(scenes, inputs, progress=lambda them, description: them):
    """Go through so many random scenes and inputs; return a line for each that goes wrong."""
    random, faults = np.random.default_rng(2025), []
    for number in progress(range(scenes), "random scenes"):
        judged, space = (motion_error, MOVING) if number % 5 == 4 else (static_error, STATIC)
        values = draw(space, random)
        try:
            error, residual = judged(**values)
            if not (error < 1e-6 and residual <= RESIDUAL):
                faults.append(f"{judged.__name__}, {values}: error {error:.1e}, residual {residual:.1e}")
        except Exception as fault:
            faults.append(f"{judged.__name__}, {values}: {type(fault).__name__}: {fault}")
    for number in progress(range(inputs), "random inputs"):
        refusal = REFUSALS[number % len(REFUSALS)]
        space = refusal.bad[random.integers(len(refusal.bad))]
        words = complaint(refusal, draw({"value": space}, random)["value"])
        if words:
            faults.append(words)
    return faults
