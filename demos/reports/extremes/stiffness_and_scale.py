"""Stiffness and scale: moduli and lengths of any size, units, hard and soft parts in one body."""

from functools import cache

import numpy as np
from harness.verdict import deviation

from forms import Isotropic
from geometry import rectangle
from model import solve

from .collected import CASES
from .scenes import by_least_squares, certificate, cylinder, pressed, same

FAMILY = "stiffness and scale"


@cache
def of_unit_size(friction, load=5e-3, nu=0.3):
    """Answer for E = R = 1."""
    return solve(cylinder(friction=friction, load=load, nu=nu).problem, "direct", tolerance=1e-12)


@CASES.add(FAMILY, "E = {E:g} Pa, mu = {mu}", E=10.0 ** np.arange(-3, 16, 2), mu=[None, 0.3])
def modulus(E, mu):
    """Displacements do not change if loads grow as E, forces grow as E."""
    solution = solve(cylinder(E=E, friction=mu).problem, "direct", tolerance=1e-12)
    return same(solution, of_unit_size(mu), 1.0, E), solution.residual


@CASES.add(FAMILY, "R = {R:g} m, mu = {mu}", R=[1e-9, 1e-7, 1e-5, 1e-3, 1e-1, 1e1, 1e3, 1e5], mu=[None, 0.3])
def length(R, mu):
    """Displacements and forces per thickness grow as R."""
    solution = solve(cylinder(R=R, friction=mu).problem, "direct", tolerance=1e-12)
    return same(solution, of_unit_size(mu), R, R), solution.residual


@CASES.add(FAMILY, "R = {R:g} m and E = {E:g} Pa at once", R=[1e-9, 1e3], E=[1e-3, 1e15])
def length_and_modulus(R, E):
    """Both at once."""
    solution = solve(cylinder(R=R, E=E, friction=0.3).problem, "direct", tolerance=1e-12)
    return same(solution, of_unit_size(0.3), R, E * R), solution.residual


MATERIALS = {"steel": (210e9, 0.3, 1e-3), "rubber": (2e6, 0.45, 2e-2)}


@CASES.add(FAMILY, "{name} in SI and in N, mm, MPa, mu = {mu}", name=MATERIALS, mu=[None, 0.5])
def units(name, mu):
    """10 mm of radius in either system: the same pressure over E and the same displacement over R."""
    E, nu, load = MATERIALS[name]
    si = solve(cylinder(0.01, E, nu, load, mu).problem, "direct", tolerance=1e-12)
    mm = solve(cylinder(10.0, E * 1e-6, nu, load, mu).problem, "direct", tolerance=1e-12)
    return same(mm, si, 1e3, 1e-3), max(si.residual, mm.residual)


CONTRASTS = [1e-8, 1e-4, 1e-2, 1e2, 1e4, 1e8]


def layered(contrast, split, **options):
    """A block of nu = 0 with a part of another stiffness where split(centres) says so."""
    grid = rectangle(2.0, 1.0, 8, 4, regions={"one": lambda x: ~split(x), "other": split})
    materials = {"one": Isotropic(1.0, 0.0), "other": Isotropic(contrast, 0.0)}
    return pressed(grid, materials, **options)


@CASES.add(FAMILY, "lower layer {contrast:g} times as stiff", 1e-7, contrast=CONTRASTS)
def layer_on_the_road(contrast):
    """Springs in series: uniform pressure, and the platen sinks by P sum h/E."""
    scene = layered(contrast, lambda x: x[:, 1] < 0.5, force=(0.0, -2e-3))
    solution = solve(scene.problem, "direct", tolerance=1e-12)
    sinks = scene.displacement(solution)[scene.elasticity.body.nodes("top"), 1]
    off = deviation(sinks, -1e-3 * (0.5 + 0.5 / contrast) * np.ones_like(sinks))
    return max(off, deviation(scene.pressure(solution), 1e-3 * np.ones(9))), solution.residual


@CASES.add(FAMILY, "across the contact: left half {contrast:g} times as stiff", contrast=CONTRASTS)
def across_the_contact(contrast):
    """Springs side by side: each half presses as hard as it is stiff."""
    scene = layered(contrast, lambda x: x[:, 0] < 1.0, displacement=(0.0, -1e-3))
    solution = solve(scene.problem, "direct", tolerance=1e-12)
    x = scene.points[:, 0]
    pressure = 1e-3 * np.where(x < 1.0, contrast, np.where(x > 1.0, 1.0, (1.0 + contrast) / 2))
    return np.max(np.abs(scene.pressure(solution) / pressure - 1)), solution.residual


@CASES.add(
    FAMILY, "inclusion {contrast:g} times as stiff, mu = {mu}", 1e-7, contrast=CONTRASTS, mu=[None, 0.3]
)
def inclusion(contrast, mu):
    """A hard or soft square inside: against least squares, with friction by the conditions themselves."""
    inside = lambda x: np.abs(x - [1.0, 0.5]).max(axis=1) < 0.3  # noqa: E731
    scene = layered(contrast, inside, displacement=(0.0, -1e-3), friction=mu)
    solution = solve(scene.problem, "direct", tolerance=1e-12)
    error = certificate(scene.problem, solution)
    if mu is None:
        error = max(error, deviation(solution.pressure_force, by_least_squares(scene.problem)[0]))
    return error, solution.residual


@CASES.add(FAMILY, "E = {E:g}, R = {R:g} refused", refuses=True, E=[0.0, -1.0, np.inf, np.nan], R=[1.0])
@CASES.add(FAMILY, "E = {E:g}, R = {R:g} refused", refuses=True, E=[1.0], R=[0.0, -1.0, np.inf, np.nan])
def no_size(E, R):
    """Sizes that are none."""
    solution = solve(cylinder(R=R, E=E).problem)
    return 0.0, solution.residual
