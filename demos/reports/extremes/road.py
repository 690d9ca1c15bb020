"""Road: tilted by any angle, far away, and a start that hardly is one."""

from dataclasses import replace
from functools import cache

import numpy as np
from harness.verdict import deviation

from geometry import Plane
from model import BodyOnRoad, solve

from .collected import CASES
from .scenes import block, cylinder, same

FAMILY = "road"
ANGLES = [0.1, 0.5, 1.0, np.pi / 2, 2.0, 3.0, np.pi, 4.0, 5.0, 6.0]


def sheared(mu, **options):
    """The cylinder pressed and sheared by a platen with a given displacement."""
    scene = cylinder(displacement=(0.004, -0.01), friction=mu, **options)
    return solve(scene.problem, "direct", tolerance=1e-13)


@cache
def upright(mu):
    """The answer on a level road at the origin."""
    return sheared(mu)


@CASES.add(FAMILY, "tilted by {turn:.3g} rad, mu = {mu}", turn=ANGLES, mu=[None, 0.3])
def tilted(turn, mu):
    """The answer turns with the road."""
    solution = sheared(mu, turn=turn)
    return same(solution, upright(mu), turn=turn), solution.residual


@CASES.add(FAMILY, "{away:g} lengths away, mu = {mu}", 1e-10, away=[1.0, 1e2, 1e3], mu=[None, 0.3])
def away(away, mu):
    """The answer does not depend on where the road is."""
    solution = sheared(mu, shift=(away, -0.7 * away))
    return same(solution, upright(mu)), solution.residual


@CASES.add(
    FAMILY,
    "{away:g} lengths away, on a grid of 2^-20, mu = {mu}",
    1e-9,
    away=[2.0**17, 2.0**20],
    mu=[None, 0.3],
)
def far_away(away, mu):
    """So far away that positions have 10 digits; nodes that these can tell exactly give the same answer."""
    scenes = [block(friction=mu, displacement=(0.02, -0.03), shift=(x, -x)) for x in (0.0, away)]
    here, there = (solve(scene.problem, "direct", tolerance=1e-13) for scene in scenes)
    return same(there, here), there.residual


@CASES.add(FAMILY, "{away:g} lengths away, any nodes, mu = {mu}", 1e-6, away=[1e6], mu=[None, 0.3])
def far_away_rounded(away, mu):
    """Positions are rounded to 1e-10 lengths, and so are the gaps: a hundredth of a millionth of the approach."""
    solution = sheared(mu, shift=(away, -0.7 * away))
    return same(solution, upright(mu)), solution.residual


@CASES.add(
    FAMILY, "starting gap {gap:g}, mu = {mu}", 1e-12, gap=[0.0, 5e-324, 1e-300, 1e-100, 1e-20], mu=[None, 0.3]
)
def hardly_a_gap(gap, mu):
    """As without."""
    scene = cylinder(displacement=(0.004, -0.01), friction=mu)
    problem = replace(scene.problem, gap=scene.problem.gap + gap)
    solution = solve(problem, "direct", tolerance=1e-13)
    return same(solution, upright(mu)), solution.residual


@CASES.add(FAMILY, "starting gap {gap:g}", gap=[1e-9, 1e-3, 1.0, 1e6])
def a_gap(gap):
    """The platen comes down by so much more, and everything is as without."""
    solution = solve(cylinder(displacement=(0.0, -0.01 - gap), gap=gap).problem, "direct", tolerance=1e-13)
    reference = solve(cylinder(displacement=(0.0, -0.01)).problem, "direct", tolerance=1e-13)
    lost = np.finfo(float).eps * gap / 0.01  # of the digits that doubles have of the approach
    return deviation(solution.pressure_force, reference.pressure_force) - 100 * lost, solution.residual


@CASES.add(FAMILY, "normal {normal} refused", refuses=True, normal=[(0.0, 0.0), (np.nan, 1.0), (np.inf, 0.0)])
def no_normal(normal):
    """Roads without a direction."""
    scene = cylinder()
    near = BodyOnRoad(scene.system, "arc", Plane((0.0, 0.0), normal))
    return 0.0, solve(near.problem).residual


@CASES.add(FAMILY, "road {above:g} above the lowest point refused", refuses=True, above=[1e-9, 0.1, 1e6])
def below_the_road(above):
    """A body that starts below its road."""
    return 0.0, solve(cylinder(gap=-above).problem).residual
