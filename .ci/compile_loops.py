"""Compiles the contact loop and its corrections ahead, into the caches of numba and of the forms."""

import numpy as np

from forms import Elasticity, Isotropic, Support
from geometry import Body, Plane, box, rectangle
from model import BodyOnRoad, ContactSolver, MassRedistribution, MovingBody, follow, solve


def scene(grid, friction):
    """A small body of nested meshes that is pressed on a plane and pushed along it, some of it in slip."""
    body = Body.from_grid(grid, 1)
    along, down = np.eye(body.dim)[0], np.eye(body.dim)[-1]
    elasticity = Elasticity(body, Isotropic(E=1e3, nu=0.3))
    load = elasticity.total_force("top", tuple(0.2 * along - down))
    support = Support(body).fix("left", x=0.0)
    return BodyOnRoad(elasticity.system(load, support, density=1.0), "bottom", Plane(), friction=friction)


for grid in (rectangle(4.0, 1.0, 4, 2), box(4.0, 1.0, 1.0, 4, 1, 2)):
    for friction in (None, 0.3):
        contact = scene(grid, friction)
        for correction in ("none", "direct", "multigrid", "algebraic"):
            solver = ContactSolver(contact.problem, correction)
            list(follow(solver, [0.5 * contact.problem.b, contact.problem.b], tolerance=1e-6))
        contact.check_strain(solve(contact))
        scheme = MassRedistribution(MovingBody.from_contact(contact), dt=1e-3)
        scheme.run(scheme.start(contact.displacement(solve(contact))), 2)
