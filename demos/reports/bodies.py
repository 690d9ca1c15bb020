"""The bodies of the lessons, on nested meshes, for the studies."""

from typing import Any

import numpy as np

from forms import Elasticity, Isotropic, Support
from geometry import Body, Plane, half_ball, half_cylinder_nested, rectangle, ring
from model import BodyOnRoad, MovingBody

R, E, NU, P = 10.0, 210e3, 0.3, 1e4  # the cylinder of the paper: mm, MPa, 1, N/mm
FALL, GRAVITY, SPEED = 0.5, 9.81, 10.0  # the ring of the paper: m, m/s^2, m/s
KINETIC = 0.5 * np.pi * (0.5**2 - 0.2**2) * SPEED**2  # J/m


def cylinder(
    refinements: int = 0,
    loading: str = "uniform",
    friction: float | None = None,
    force: float = P,
    grid: Any = None,
    nu: float = NU,
    held: bool = True,
    reach: float = 0.3 * R,
) -> BodyOnRoad:
    """Half cylinder of 56 x 4^refinements quadrilaterals under a uniform traction or a platen.

    `held` keeps the platen from moving in x. Cells have one dilatation each where nu > 0.4.
    """
    body = Body.from_grid(half_cylinder_nested(R) if grid is None else grid, refinements)
    elasticity = Elasticity(body, Isotropic(E, nu), mean_dilatation=nu > 0.4)
    support = Support(body)
    if loading == "uniform":
        support.fix_node(body.nearest_node((0.0, R)), x=0.0)
    else:
        support.platen("top")
        if held:
            support.fix("top", x=0.0)
    system = elasticity.system(elasticity.total_force("top", (0.0, -force)), support)
    return BodyOnRoad(system, "arc", Plane(), friction=friction, reach=reach)


def launched_ring(
    friction: float | None = None, refinements: int = 0, around: int = 96, across: int = 6, road: Any = None
) -> tuple[Body, Elasticity, MovingBody, np.ndarray]:
    """Ring of the paper above a road: body, forms, moving body, initial velocity."""
    body = Body.from_grid(ring(0.5, 0.2, around, across, lowest=(0.0, FALL)), refinements)
    elasticity = Elasticity(body, Isotropic(E=1000.0, nu=0.3), "plane strain")
    weight = elasticity.body_force((0.0, -GRAVITY))
    moving = MovingBody.from_forms(elasticity, 1.0, weight, road or Plane(), "outer", friction=friction)
    velocity = np.zeros_like(body.coordinates)
    velocity[:, 0] = SPEED
    return body, elasticity, moving, velocity


def rod(elements: int) -> MovingBody:
    """Rod of length, density and modulus 1, a strip one element high; the wall is at its left end."""
    body = Body.from_grid(rectangle(1.0, 1.0, elements, 1))
    support = Support(body).fix("right", x=0.0).fix("top", y=0.0).fix("bottom", y=0.0)
    elasticity = Elasticity(body, Isotropic(E=1.0, nu=0.0), "plane stress")
    nothing, wall = np.zeros_like(body.coordinates), Plane(normal=(1.0, 0.0))
    return MovingBody.from_forms(elasticity, 1.0, nothing, wall, "left", support)


def ball(part: str, refinements: int, force: float, friction: float | None = None) -> BodyOnRoad:
    """Quarter or half of the lower half ball under a platen; `force` is that of the whole ball."""
    share = {"quarter": 1 / 4, "half": 1 / 2}[part]
    elasticity = Elasticity(Body.from_grid(half_ball(R, part), refinements), Isotropic(E, NU))
    support = Support(elasticity.body).platen("top").fix("y0", y=0.0)
    if part == "quarter":
        support.fix("x0", x=0.0)
    elif friction is None:
        support.fix("top", x=0.0)
    load = elasticity.total_force("top", (0.0, 0.0, -share * force))
    road = Plane((0, 0, 0), (0, 0, 1))
    system = elasticity.system(load, support)
    return BodyOnRoad(system, "sphere", road, friction=friction, reach=0.15 * R)


def order_of(sizes: Any, errors: Any) -> float:
    """Slope of the line through all points on logarithmic axes."""
    return float(np.polyfit(np.log(sizes), np.log(errors), 1)[0])
