"""Nearly incompressible: Poisson's ratio up to 0.499999, where plain bilinear elements lock; and below 0."""

import numpy as np
from harness.verdict import deviation

from forms import Isotropic
from geometry import half_cylinder
from model import solve
from model.closed_forms.hertz import HertzCylinder
from model.results.pressure import line_error

from .collected import CASES
from .scenes import block, pressed

FAMILY = "Poisson's ratio"
RATIOS = [0.49, 0.499, 0.4999, 0.49999, 0.499999]


def against_hertz(nu, mean_dilatation):
    """Paper's mesh and patch; error of the pressure (L2) and of its peak against Hertz with E*."""
    E, R = 210e3, 10.0
    P = 9.1e3 / abs((1 - nu**2) or 1.0)
    scene = pressed(
        half_cylinder(R), Isotropic(E, nu), force=(0.0, -P), boundary="arc", mean_dilatation=mean_dilatation
    )
    solution = solve(scene.problem, "direct", tolerance=1e-10)
    hertz, p = HertzCylinder(P, R, E, nu), scene.pressure(solution)
    peak = abs(p.max() / hertz.p0 - 1)
    return max(peak, line_error(scene.points[:, 0], p, hertz.pressure)), solution.residual


@CASES.add(FAMILY, "Hertz, nu = {nu}, one dilatation a cell", 0.06, nu=RATIOS)
def remedied(nu):
    """The remedy for locking."""
    return against_hertz(nu, True)


@CASES.add(FAMILY, "Hertz, nu = {nu}", 0.06, nu=[0.0, -0.3, -0.9, -0.999])
def auxetic(nu):
    """Materials that do not widen, or narrow, when pressed."""
    return against_hertz(nu, False)


@CASES.add(
    FAMILY,
    "patch test, nu = {nu}, one dilatation a cell: {remedy}",
    1e-9,
    nu=[*RATIOS, 0.3, 0.0, -0.5, -0.9, -0.999],
    remedy=[True, False],
)
def patch_test(nu, remedy):
    """A flat block in plane strain, free to widen: it sinks by (1 - nu^2) P / E, evenly."""
    scene = block(force=(0.0, -2e-3), nu=nu, distortion=0.2, mean_dilatation=remedy, platen=False)
    return sinks_evenly(scene, -1e-3 * (1 - nu**2))


def sinks_evenly(scene, strain):
    """Error of vertical displacement and pressure against an even strain."""
    solution = solve(scene.problem, "direct", tolerance=1e-10)
    y = scene.elasticity.body.coordinates[:, 1]
    u = scene.displacement(solution)[:, 1]
    pressure = scene.pressure(solution)
    return max(deviation(u, strain * y), deviation(pressure, np.full(pressure.size, 1e-3))), solution.residual


@CASES.add(FAMILY, "nu = {nu} refused", refuses=True, nu=[0.5, 0.6, -1.0, -1.5, np.nan])
def no_ratio(nu):
    """Ratios that no material has."""
    return against_hertz(nu, True)
