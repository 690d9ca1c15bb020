"""Time: steps far too short and far too long, fast impacts, light and heavy bodies, rest, damping."""

from functools import cache

import numpy as np
from harness.verdict import deviation

from forms import Elasticity, Isotropic, Support
from geometry import Body, Plane, rectangle, ring
from model import ContactProblem, MovingBody, Newmark, solve
from model.dynamics.schemes import IMPLICIT
from model.problem.linear_limits import linear_limits
from model.recording.energy_balance import Ledger

from .collected import CASES

FAMILY = "time"
EXACT = ["Newmark", "contact-stabilised", "mass redistribution"]  # their energy has a closed form


def touching_ring(mu=None, inner=0.2, around=24, across=3, E=1000.0, density=1.0, damping=None, gravity=9.81):
    """The paper's ring, its lowest point on the road."""
    body = Body.from_grid(ring(0.5, inner, around, across))
    elasticity = Elasticity(body, Isotropic(E, 0.3))
    load = elasticity.body_force((0.0, -gravity * density))
    moving = MovingBody.from_forms(elasticity, density, load, Plane(), "outer", damping=damping, friction=mu)
    return elasticity, moving


def rod(elements=20):
    """The rod of `RodImpact`, its end a hundredth of its length from the wall."""
    body = Body.from_grid(rectangle(1.0, 1.0, elements, 1))
    support = Support(body).fix("right", x=0.0).fix("top", y=0.0).fix("bottom", y=0.0)
    elasticity = Elasticity(body, Isotropic(1.0, 0.0), "plane stress")
    wall = Plane(normal=(1.0, 0.0))
    nothing = np.zeros_like(body.coordinates)
    moving = MovingBody.from_forms(elasticity, 1.0, nothing, wall, "left", support)
    start = np.stack([0.01 * (1.0 - body.coordinates[:, 0]), 0.0 * body.coordinates[:, 0]], axis=1)
    return elasticity, moving, start


def thrown(moving, x, y):
    """A velocity, the same everywhere."""
    return np.tile([x, y], (len(moving.coordinates), 1))


def books(scheme, state, steps, elasticity=None):
    """Run, and return by how much the books are off, the largest residual, and the last state.

    Energy changes by what the scheme's closed form says, momentum by the impulses, no gap and no pressure is
    below zero, and friction stays in its cone.
    """
    ledger, worst, energy, momentum = Ledger(scheme, state), 0.0, 0.0, 0.0
    mu = 0.0 if scheme.body.friction is None else scheme.body.friction.coefficient
    mass = float(np.abs(scheme.M).sum())
    off_mass = deviation(scheme.M.sum(), scheme.body.M.sum()) if scheme.body.floats else 0.0  # however spread
    off_energy = off_momentum = off_force = 0.0
    for _ in range(steps):
        before, state = state, scheme.step(state)
        entry = ledger.close(before, state)
        worst = max(worst, state.residual)
        push = float(np.abs(state.mean_force).sum())  # of the road in this step, and how far it may move
        way = float(np.abs(state.displacement - before.displacement).max())
        energy = max(energy, entry.kinetic + entry.strain + abs(entry.potential) + entry.damping + push * way)
        momentum = max(momentum, mass * float(np.abs(state.velocity).max()) + push * scheme.dt)
        normal = scheme.solvers["step"].loop.frame[:, 0]
        p = np.einsum("ca,ca->c", normal, state.contact_force)
        tau = np.linalg.norm(state.contact_force - p[:, None] * normal, axis=1)
        off_energy = max(off_energy, np.nan_to_num(abs(entry.gain - entry.numerical)))
        if scheme.body.C is None:  # the drag of damping is no impulse of the road
            off_momentum = max(off_momentum, np.nan_to_num(entry.momentum_error))
        violation = max(-p.min(), (tau - mu * p).max())
        off_force = max(off_force, violation / (np.abs(p).max() or 1.0))
        assert state.gap.min() >= 0.0, f"A gap of {state.gap.min()}."
    if elasticity is not None:
        linear_limits(elasticity.gradient(scheme.body.expand(state.displacement)))
    error = max(off_energy / (energy or 1.0), off_momentum / (momentum or 1.0), off_force, off_mass)
    return error, worst, state


STEPS = [1e-9, 1e-6, 1e-4, 1e-2, 0.1]
LONG_STEPS = [1.0, 10.0]  # in which the ring would fall up to 490 m into the road


@CASES.add(FAMILY, "ring, {name}, dt = {dt:g} s, mu = {mu}", 1e-9, name=IMPLICIT, dt=STEPS, mu=[None, 0.3])
@CASES.add(
    FAMILY, "ring, {name}, dt = {dt:g} s, mu = {mu}", 1e-5, name=IMPLICIT, dt=LONG_STEPS, mu=[None, 0.3]
)
def ring_and_step(name, dt, mu):
    """Thrown on the road; the books of energy and momentum balance, to the residual of so long a step."""
    elasticity, moving = touching_ring(mu)
    scheme = IMPLICIT[name](moving, dt)
    return books(scheme, scheme.start(velocity=thrown(moving, 10.0, -3.0)), 40, elasticity)[:2]


@CASES.add(FAMILY, "rod, {name}, dt = {dt:g} s", 1e-9, name=IMPLICIT, dt=STEPS + LONG_STEPS)
def rod_and_step(name, dt):
    """Released against the wall."""
    elasticity, moving, start = rod()
    scheme = IMPLICIT[name](moving, dt)
    return books(scheme, scheme.start(start), 100, elasticity)[:2]


@CASES.add(FAMILY, "dt = {dt} s refused", refuses=True, dt=[0.0, -1.0, np.nan, np.inf])
def no_step(dt):
    """Steps that are none."""
    return 0.0, Newmark(touching_ring()[1], dt).start().residual


WAVE = np.sqrt(1000.0 * 0.7 / (1.3 * 0.4))  # speed of pressure waves, m/s


def flat_block(mu=0.3, layers=None, density=1.0):
    """A block that lies on the road, weightless; layers of the given densities."""
    halves = {"lower": lambda x: x[:, 1] < 0.5, "upper": lambda x: x[:, 1] > 0.5}
    body = Body.from_grid(rectangle(2.0, 1.0, 8, 4, regions=halves))
    elasticity = Elasticity(body, {half: Isotropic(1000.0, 0.3) for half in halves})
    nothing = np.zeros_like(body.coordinates)
    densities = dict.fromkeys(halves, density) | (layers or {})
    return elasticity, MovingBody.from_forms(elasticity, densities, nothing, Plane(), "bottom", friction=mu)


@cache
def slow_impact():
    """Impact at a thousandth of the wave speed."""
    scheme = Newmark(flat_block()[1], 2e-3)
    return scheme.run(scheme.start(velocity=thrown(scheme.body, 5e-4 * WAVE, -1e-3 * WAVE)), 60)


@CASES.add(FAMILY, "impact at {part:g} of the wave speed", 1e-9, part=[1e-9, 1e-6, 1e-2, 0.1, 0.5, 1.0])
def impact_speed(part):
    """A flat block: everything grows in proportion to the speed."""
    elasticity, moving = flat_block()
    scheme = Newmark(moving, 2e-3)
    start = scheme.start(velocity=thrown(moving, 0.5 * part * WAVE, -part * WAVE))
    error, residual, state = books(scheme, start, 60, elasticity)
    scale, slow = part / 1e-3, slow_impact()
    same = max(
        deviation(state.displacement, scale * slow.displacement),
        deviation(state.velocity, scale * slow.velocity),
    )
    return max(error, same), residual


@CASES.add(FAMILY, "density {rho:g}", 1e-9, rho=10.0 ** np.arange(-6, 7, 2))
def density(rho):
    """A body rho times as heavy moves alike, sqrt(rho) times as slowly."""
    slowness = np.sqrt(rho)
    _, moving = flat_block(density=rho)
    scheme = Newmark(moving, 2e-3 * slowness)
    start = scheme.start(velocity=thrown(moving, 5e-4 * WAVE / slowness, -1e-3 * WAVE / slowness))
    error, residual, state = books(scheme, start, 60)
    return max(error, deviation(state.displacement, slow_impact().displacement)), residual


@CASES.add(
    FAMILY, "{name}, upper half {ratio:g} times as dense", 1e-9, name=EXACT, ratio=[1e-6, 1e-3, 1e3, 1e6]
)
def layered_masses(name, ratio):
    """A block of two layers falls on the road."""
    elasticity, moving = flat_block(layers={"upper": ratio})
    scheme = IMPLICIT[name](moving, 1e-3)
    return books(scheme, scheme.start(velocity=thrown(moving, 0.1, -0.1)), 60, elasticity)[:2]


@CASES.add(FAMILY, "{name}, ring of {radii} of its outer radius", 1e-9, name=EXACT, radii=[0.9, 0.99])
def thin_ring(name, radii):
    """A wall a hundredth of the radius thick."""
    elasticity, moving = touching_ring(0.1, inner=0.5 * radii, around=60, across=3)
    scheme = IMPLICIT[name](moving, 1e-3)
    return books(scheme, scheme.start(velocity=thrown(moving, 1.0, -0.1)), 60, elasticity)[:2]


DAMPING = [(0.0, 0.0), (0.0, 1e-6), (0.0, 1e-2), (0.0, 1e2), (1e-3, 0.0), (1e4, 0.0), (1e3, 1e3)]


@CASES.add(FAMILY, "{name}, damping alpha, beta = {damping}", 1e-8, name=EXACT, damping=DAMPING)
def damping(name, damping):
    """From none to far beyond critical."""
    elasticity, moving = touching_ring(0.3, damping=damping)
    scheme = IMPLICIT[name](moving, 1e-2)
    return books(scheme, scheme.start(velocity=thrown(moving, 1.0, -1.0)), 60, elasticity)[:2]


def at_rest(name, mu, steps):
    """A block under its weight: it stays where it is, and stays cold."""
    body = Body.from_grid(rectangle(2.0, 1.0, 4, 2))
    elasticity = Elasticity(body, Isotropic(1e4, 0.3))
    load = elasticity.body_force((0.0, -10.0))
    support = Support(body)
    if mu is None:
        support.fix_node(body.nearest_node((1.0, 0.0)), x=0.0)
    moving = MovingBody.from_forms(elasticity, 1.0, load, Plane(), "bottom", support, friction=mu)
    scheme = IMPLICIT[name](moving, 1e-2)
    moving = scheme.body  # mass redistribution lets the weight go with the mass
    gap, normal = moving.gaps(np.zeros_like(moving.coordinates))
    problem = ContactProblem(
        moving.K, moving.load_at(0.0), moving.coordinates, moving.contact_nodes, normal, gap, mu
    )
    static = solve(problem, "direct", tolerance=1e-13)
    state, worst = scheme.start(static.displacement), 0.0
    for _ in range(steps):
        state = scheme.step(state)
        worst = max(worst, state.residual)
    heat = 0.5 * float(state.velocity.ravel() @ (scheme.M @ state.velocity.ravel()))
    drift = deviation(state.displacement, static.displacement)
    return max(drift, np.sqrt(heat / moving.strain_energy(static.displacement))), worst


@CASES.add(FAMILY, "{name} at rest for {steps} steps", 1e-9, long=True, name=EXACT, steps=[100_000])
def rests_for_long(name, steps):
    """A long rest."""
    return at_rest(name, 0.3, steps)
