"""Rigid motion: what is symmetric stays so, and answers turn and shift with their scenes."""

import numpy as np
from harness.verdict import deviation

from model import solve
from model.dynamics.schemes import IMPLICIT

from .collected import CASES
from .scenes import block, cylinder, same
from .time import thrown, touching_ring

FAMILY = "rigid motion"


def mirrored(points, middle=0.0):
    """Number of each node's mirror image about x = middle."""
    image = points * [-1.0, 1.0] + [2 * middle, 0.0]
    order, other = np.lexsort(np.round(points, 9).T), np.lexsort(np.round(image, 9).T)
    found = np.empty(len(points), dtype=int)
    found[other] = order
    return found


@CASES.add(
    FAMILY, "symmetric cylinder, mu = {mu}, load {load:g}", mu=[None, 0.1, 0.5, 2.0], load=[1e-4, 5e-3, 0.1]
)
def symmetric_cylinder(mu, load):
    """Displacements and forces are their own mirror images."""
    scene = cylinder(friction=mu, load=load)
    solution = solve(scene.problem, "direct", tolerance=1e-13)
    number = mirrored(scene.points)
    flip = [-1.0, 1.0]
    u = scene.displacement(solution)
    image = u[mirrored(scene.elasticity.body.coordinates)] * flip
    force = solution.contact_force
    return max(deviation(image, u), deviation(force[number] * flip, force)), solution.residual


@CASES.add(FAMILY, "symmetric ring, {name}, mu = {mu}", 1e-10, name=IMPLICIT, mu=[None, 0.3])
def symmetric_ring(name, mu):
    """Dropped straight down it stays symmetric, bounce after bounce."""
    _, moving = touching_ring(mu)
    scheme = IMPLICIT[name](moving, 1e-2)
    state, worst, off = scheme.start(velocity=thrown(moving, 0.0, -3.0)), 0.0, 0.0
    number = mirrored(moving.coordinates)
    for _ in range(60):
        state = scheme.step(state)
        worst = max(worst, state.residual)
        u = state.displacement
        off = max(off, deviation(u[number] * [-1.0, 1.0], u))
    return off, worst


@CASES.add(
    FAMILY,
    "block turned by {turn:g} and shifted by {shift}, mu = {mu}",
    1e-10,
    turn=[0.3, 1.0, np.pi / 2, 2.5],
    shift=[(0.0, 0.0), (3.0, -2.0), (100.0, 50.0)],
    mu=[None, 0.3],
)
def turned_and_shifted(turn, shift, mu):
    """The turned and shifted scene gives the turned answer."""
    options = {"friction": mu, "displacement": (0.02, -0.03), "distortion": 0.2}
    solution = solve(block(turn=turn, shift=shift, **options).problem, "direct", tolerance=1e-13)
    reference = solve(block(**options).problem, "direct", tolerance=1e-13)
    return same(solution, reference, turn=turn), solution.residual


@CASES.add(
    FAMILY,
    "nodes visited {way}, correction {correction}, mu = {mu}",
    1e-9,
    way=["backwards", "shuffled"],
    correction=["none", "direct"],
    mu=[None, 0.3],
)
def any_order(way, correction, mu):
    """The order in which the loop visits the nodes does not matter."""
    problem = block(friction=mu, displacement=(0.02, -0.03), columns=6, rows=3).problem
    N = len(problem.coordinates)
    order = np.arange(N)[::-1] if way == "backwards" else np.random.default_rng(1).permutation(N)
    solution = solve(problem, correction, tolerance=1e-13, order=order)
    reference = solve(problem, correction, tolerance=1e-13)
    return same(solution, reference), solution.residual


@CASES.add(
    FAMILY,
    "correction {correction}, mu = {mu}",
    1e-8,
    correction=["none", "direct", "algebraic"],
    mu=[None, 0.3],
)
def any_correction(correction, mu):
    """The loop as printed gives the answer that the corrections give."""
    problem = block(friction=mu, displacement=(0.02, -0.03), columns=6, rows=3).problem
    solution = solve(problem, correction, tolerance=1e-12)
    return same(solution, solve(problem, "direct", tolerance=1e-13)), solution.residual
