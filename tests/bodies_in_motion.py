"""Small scenes that the tests of dynamics share."""

import numpy as np

from forms import Elasticity, Isotropic, Support
from geometry import Body, Plane, box, rectangle, ring
from model import ContactStabilised, MassRedistribution, MovingBody
from model.dynamics.schemes import IMPLICIT

SCHEMES = list(IMPLICIT.values())
NEVER_GAIN = [ContactStabilised, MassRedistribution]


def bouncing_ring(friction=None, around=40, across=3, damping=None, nested=0):
    """The paper's ring on a coarse mesh, and its initial velocity."""
    body = Body.from_grid(ring(0.5, 0.2, around, across, lowest=(0.0, 0.5)), nested)
    elasticity = Elasticity(body, Isotropic(1000.0, 0.3), "plane strain")
    load = elasticity.body_force((0.0, -9.81))
    moving = MovingBody.from_forms(
        elasticity, 1.0, load, Plane(), "outer", damping=damping, friction=friction
    )
    velocity = np.zeros_like(body.coordinates)
    velocity[:, 0] = 10.0
    return moving, velocity


def rod(elements=200):
    """the rod of `RodImpact` with the wall at its left end, and its initial displacement."""
    body = Body.from_grid(rectangle(1.0, 1.0, elements, 1))
    support = Support(body).fix("right", x=0.0).fix("top", y=0.0).fix("bottom", y=0.0)
    elasticity = Elasticity(body, Isotropic(1.0, 0.0), "plane stress")
    nothing = np.zeros_like(body.coordinates)
    moving = MovingBody.from_forms(elasticity, 1.0, nothing, Plane(normal=(1.0, 0.0)), "left", support)
    start = nothing.copy()
    start[:, 0] = (1.0 - body.coordinates[:, 0]) / 2
    return moving, start


def block(friction=None, columns=4, rows=2, E=1e4, gravity=(0.0, -10.0), load=None, **options):
    """A block of 2 x 1 on the road, its mass 2."""
    body = Body.from_grid(rectangle(2.0, 1.0, columns, rows))
    elasticity = Elasticity(body, Isotropic(E, 0.3), "plane strain")
    weight = elasticity.body_force(gravity)
    weight = weight if load is None else load(elasticity, weight)
    return MovingBody.from_forms(elasticity, 1.0, weight, Plane(), "bottom", friction=friction, **options)


def cube(friction=None):
    """A cube in 3-D, tilted a little, above the road."""
    grid = box(1.0, 1.0, 1.0, 2, 2, 2)
    turn = 0.3
    grid.points = grid.points @ np.array(
        [[np.cos(turn), 0.0, np.sin(turn)], [0.0, 1.0, 0.0], [-np.sin(turn), 0.0, np.cos(turn)]]
    )
    grid.points[:, 2] += 0.02 - grid.points[:, 2].min()
    body = Body.from_grid(grid)
    elasticity = Elasticity(body, Isotropic(1000.0, 0.3))
    load = elasticity.body_force((0.0, 0.0, -10.0))
    road = Plane((0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    return MovingBody.from_forms(elasticity, 1.0, load, road, "bottom", friction=friction)


def energy(scheme, state):
    """Kinetic, strain and load energy."""
    v = state.velocity.ravel()
    load = scheme.body.load_at(state.time)
    return (
        0.5 * v @ (scheme.M @ v)
        + scheme.body.strain_energy(state.displacement)
        - np.vdot(load, state.displacement)
    )


def momentum(scheme, state):
    """Total momentum (d,)."""
    return (scheme.M @ state.velocity.ravel()).reshape(state.velocity.shape).sum(axis=0)


def steps(scheme, state, count):
    """Pairs of states before and after each step."""
    for _ in range(count):
        before, state = state, scheme.step(state)
        yield before, state


def pressures(scheme, state):
    """Normal and tangential contact forces (n,), (n,)."""
    normal = scheme.solvers["step"].loop.frame[:, 0]
    p = np.einsum("ca,ca->c", normal, state.contact_force)
    return p, np.linalg.norm(state.contact_force - p[:, None] * normal, axis=1)
