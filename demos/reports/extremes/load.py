"""Load: from nothing to far too much, pulled off, one node, every node, up to the edge."""

import numpy as np
from harness.verdict import deviation

from forms import Isotropic
from geometry import rectangle
from model import BodyOnRoad, solve

from .collected import CASES
from .scenes import block, by_least_squares, certificate, cylinder, pressed

FAMILY = "load"
PAPER = 1e4 / (210e3 * 10.0)  # P / (E R)


@CASES.add(
    FAMILY, "{times:g} times the paper's load, mu = {mu}", times=10.0 ** np.arange(-12, 4), mu=[None, 0.3]
)
def times_the_paper(times, mu):
    """Against least squares; with friction by the conditions themselves."""
    scene = cylinder(load=times * PAPER, friction=mu)
    solution = solve(scene.problem, "direct", tolerance=1e-12)
    error = abs(solution.pressure_force.sum() / (times * PAPER) - 1)
    error = max(error, certificate(scene.problem, solution))
    if mu is not None or times < 1e-6:  # where one node touches, it carries all
        return error, solution.residual
    sinks = scene.displacement(solution)[scene.elasticity.body.nodes("top")[0], 1]
    p = by_least_squares(cylinder(displacement=(0.0, sinks)).problem)[0]
    return max(error, deviation(solution.pressure_force, p)), solution.residual


@CASES.add(FAMILY, "no load, mu = {mu}", 0.0, mu=[None, 0.3])
def no_load(mu):
    """Nothing moves."""
    solution = solve(cylinder(load=0.0, friction=mu).problem, "direct")
    return np.abs(solution.displacement).max() + np.abs(solution.contact_force).max(), solution.residual


@CASES.add(FAMILY, "pulled off with a force, mu = {mu}", refuses=True, mu=[None, 0.3])
def pulled_off(mu):
    """Nothing holds the body."""
    return 0.0, solve(cylinder(load=-PAPER, friction=mu).problem, "direct").residual


@CASES.add(
    FAMILY, "lifted by {lift:g}, mu = {mu}", 1e-12, lift=[1e-300, 1e-12, 1e-3, 1.0, 1e6], mu=[None, 0.3]
)
def lifted(lift, mu):
    """The body follows its platen as one and unloaded."""
    scene = cylinder(displacement=(0.0, lift), friction=mu)
    solution = solve(scene.problem, "direct", tolerance=1e-12)
    off = deviation(solution.displacement, np.tile([0.0, lift], (len(solution.displacement), 1)))
    return max(off, np.abs(solution.contact_force).max() / lift), solution.residual


@CASES.add(FAMILY, "one candidate, load {P:g}, mu = {mu}", P=[1e-12, 1e-3, 1.0], mu=[None, 0.3])
def one_candidate(P, mu):
    """It carries everything."""
    grid = rectangle(1.0, 1.0, 4, 4)
    lowest = grid.points[:, 1] == 0
    grid.points[lowest, 1] += 0.1 * np.abs(grid.points[lowest, 0] - 0.5)
    scene = pressed(grid, Isotropic(1.0, 0.3), force=(0.0, -P), friction=mu)
    near = BodyOnRoad(scene.system, "bottom", scene.road, friction=mu, reach=1e-3)
    solution = solve(near.problem, "direct", tolerance=1e-12)
    return max(
        deviation(solution.pressure_force, [P], P), certificate(near.problem, solution)
    ), solution.residual


@CASES.add(FAMILY, "every node in contact, load {P:g}", P=[1e-12, 1e-6, 1e-2, 1.0])
def every_node(P):
    """The patch test: the pressure is the load's."""
    scene = block(force=(0.0, -P), nu=0.0, distortion=0.3)
    solution = solve(scene.problem, "direct", tolerance=1e-12)
    return deviation(scene.pressure(solution), np.full(9, P / 2)), solution.residual


@CASES.add(
    FAMILY,
    "patch up to the edge, pressed by {depth:g}, mu = {mu}",
    1e-9,
    depth=[1e-3, 1e-2, 3e-2, 0.1],
    mu=[None, 0.3],
)
def up_to_the_edge(depth, mu):
    """A block with a rounded bottom, the contact spreading to its edges."""
    grid = rectangle(2.0, 1.0, 16, 6, corner=(-1.0, 0.0))
    grid.points[:, 1] += 0.02 * grid.points[:, 0] ** 2 * (1 - grid.points[:, 1])
    scene = pressed(grid, Isotropic(1.0, 0.3), displacement=(0.0, -depth), friction=mu)
    solution = solve(scene.problem, "direct", tolerance=1e-12)
    error = certificate(scene.problem, solution)
    if mu is None:
        error = max(error, deviation(solution.pressure_force, by_least_squares(scene.problem)[0]))
    return error, solution.residual


@CASES.add(FAMILY, "load of {value} refused", refuses=True, value=[np.nan, np.inf, -np.inf])
def no_number(value):
    """Loads that are none."""
    return 0.0, solve(cylinder(load=value).problem).residual
