"""Friction: hardly any, more than anything, at its limit, back and forth, and in a thousand steps."""

from functools import cache

import numpy as np
from harness.verdict import deviation
from scipy.sparse.linalg import spsolve

from forms import Isotropic
from geometry import rectangle
from model import ContactSolver, follow, solve

from .collected import CASES
from .scenes import block, certificate, cylinder, pressed

FAMILY = "friction"
SHEARED = {"displacement": (0.02, -0.03)}


@cache
def without_friction():
    """The sheared block on ice."""
    return solve(block(**SHEARED).problem, "direct", tolerance=1e-12)


@CASES.add(FAMILY, "mu = {mu:g}: nearly ice", 1e-8, mu=[1e-300, 1e-12, 1e-9, 1e-6, 1e-3])
def hardly_any(mu):
    """The answer without friction, but for a change in proportion to mu; sliding forces are mu p."""
    solution = solve(block(friction=mu, **SHEARED).problem, "direct", tolerance=1e-12)
    apart = deviation(solution.displacement, without_friction().displacement)
    slides = np.abs(np.abs(solution.contact_force[:, 0]) - mu * solution.pressure_force).max()
    return max(apart - 10 * mu, slides / solution.pressure_force.max()), solution.residual


@CASES.add(FAMILY, "mu = {mu:g}: glued", 1e-9, mu=[10.0, 1e3, 1e6, 1e12])
def more_than_anything(mu):
    """Everything sticks: the linear problem with the bottom held."""
    scene = block(friction=mu, **SHEARED)
    solution = solve(scene.problem, "direct", tolerance=1e-12)
    A, b = scene.problem.A.tocsc(), scene.problem.b.ravel()
    held = (2 * scene.problem.contact_nodes[:, None] + [0, 1]).ravel()
    free = np.setdiff1d(np.arange(b.size), held)
    u = np.zeros_like(b)
    u[free] = spsolve(A[free][:, free], b[free])
    return deviation(solution.displacement.ravel(), u), solution.residual


@CASES.add(
    FAMILY,
    "mu = {mu:g}, sheared by {ratio:g} of the pressing",
    1e-9,
    mu=[1e-2, 0.1, 0.3, 1.0],
    ratio=[0.1, 1.0, 10.0],
)
def slip_and_stick(mu, ratio):
    """The conditions themselves: equilibrium, g and p, the cone, slip only at its edge and against it."""
    scene = block(friction=mu, displacement=(0.01 * ratio, -0.01))
    solution = solve(scene.problem, "direct", tolerance=1e-12)
    return certificate(scene.problem, solution), solution.residual


@CASES.add(FAMILY, "friction without pressure, mu = {mu:g}", mu=[1e-12, 0.3, 1e6])
def without_pressure(mu):
    """A block that touches and is drawn along without being pressed: no force at all."""
    scene = block(friction=mu, displacement=(0.01, 0.0), nu=0.0, columns=4, rows=2)
    solution = solve(scene.problem, "direct", tolerance=1e-12)
    return certificate(scene.problem, solution), solution.residual


@CASES.add(
    FAMILY, "Q = {part} mu P, mu = {mu:g}", 1e-8, part=[0.5, 0.999, 1.0], mu=[1e-6, 0.1, 0.3, 1.0, 3.0]
)
def up_to_the_limit(part, mu):
    """A flat block under a platen, held by friction alone: the road carries Q and P, within the cone."""
    scene = pressed(
        rectangle(4.0, 0.5, 8, 2), Isotropic(1.0, 0.0), force=(0.0, -1e-3), friction=mu, held=False
    )
    push, pull = scene.problem.b, scene.system.reduce(scene.elasticity.total_force("top", (1e-3, 0.0)))
    solver = ContactSolver(scene.problem, "direct")
    last = list(follow(solver, [push, push + part * mu * pull], tolerance=1e-12))[-1]
    carried = deviation(last.contact_force.sum(axis=0), [-part * mu * 1e-3, 1e-3], 1e-3)
    cone = np.max(np.abs(last.contact_force[:, 0]) - mu * last.pressure_force) / 1e-3
    return max(carried, cone), last.residual


@CASES.add(FAMILY, "Q = {part} mu P refused", refuses=True, part=[1.001, 2.0, 1e6])
def beyond_the_limit(part):
    """More than friction can carry."""
    return up_to_the_limit(part, 0.3)


@CASES.add(FAMILY, "mu = {mu} refused", refuses=True, mu=[-1.0, np.nan, np.inf, -1e-300])
def no_coefficient(mu):
    """Coefficients that are none."""
    return 0.0, solve(block(friction=mu, **SHEARED).problem).residual


@CASES.add(
    FAMILY, "hysteresis closes, {steps} steps a reversal, mu = {mu}", 1e-8, steps=[4, 10, 20], mu=[0.1, 0.5]
)
def hysteresis(steps, mu):
    """Forth and back until shaken down: a loop later everything is as before, and none of it without work."""
    scene = cylinder(friction=mu, held=False)
    pull = scene.system.reduce(scene.elasticity.total_force("top", (1.0, 0.0)))
    forth = np.linspace(-1.0, 1.0, steps + 1)[1:]
    cycle = [*forth, *-forth]
    Q = 0.5 * mu * 5e-3
    loads = [
        scene.problem.b + q * Q * pull for q in [0.0, *np.linspace(0, -1, steps // 2 + 1)[1:], *(3 * cycle)]
    ]
    path = list(follow(ContactSolver(scene.problem, "direct"), loads, tolerance=1e-12))
    at = scene.system.node_of[scene.elasticity.body.nodes("top")[0]]
    last, before = path[-1], path[-1 - 2 * steps]
    loop = np.array([step.displacement[at, 0] for step in path[-1 - 2 * steps :]])
    force = Q * np.array([-1.0, *cycle])
    work = np.sum((force[1:] + force[:-1]) / 2 * np.diff(loop))
    assert work > 0.0, f"The loop returns work: {work}."
    closes = max(
        deviation(last.displacement, before.displacement), deviation(last.contact_force, before.contact_force)
    )
    return closes, max(step.residual for step in path)


@CASES.add(FAMILY, "{steps} load steps, mu = {mu}", 1e-8, steps=[10, 100, 1000], mu=[0.1, 0.5])
def many_steps(steps, mu):
    """A flat block: the answer grows in proportion to the load, however many steps it takes."""
    scene = block(friction=mu, force=(0.0, -1e-2), columns=6, rows=3)
    once = solve(scene.problem, "direct", tolerance=1e-12)
    loads = (scene.problem.b * k / steps for k in range(1, steps + 1))
    worst = 0.0
    for last in follow(ContactSolver(scene.problem, "direct"), loads, tolerance=1e-12):
        worst = max(worst, last.residual)
    return deviation(last.contact_force, once.contact_force), worst
