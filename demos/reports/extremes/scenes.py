"""Small scenes that the families share, and what their answers are held against."""

from dataclasses import replace

import numpy as np
from harness.verdict import deviation
from scipy.linalg import cholesky, solve_triangular
from scipy.optimize import nnls

from forms import Elasticity, Isotropic, Support
from geometry import Body, Plane, half_cylinder, rectangle
from model import BodyOnRoad


def rotation(turn):
    """Rotation matrix of the plane, exact for right angles."""
    quarter = turn / (np.pi / 2)
    if quarter == round(quarter):
        c, s = [(1, 0), (0, 1), (-1, 0), (0, -1)][round(quarter) % 4]
    else:
        c, s = np.cos(turn), np.sin(turn)
    return np.array([[c, -s], [s, c]], dtype=float)


def pressed(
    grid,
    material,
    force=None,
    displacement=None,
    friction=None,
    boundary="bottom",
    turn=0.0,
    shift=(0.0, 0.0),
    held=True,
    platen=True,
    gap=0.0,
    kinematics=None,
    mean_dilatation=False,
):
    """A body between a platen on its top and the road, all of it turned and shifted as one.

    The platen has a force (and then, if `held`, does not move along x) or a displacement.
    """
    Q = rotation(turn)
    body = Body.from_grid(replace(grid, points=grid.points @ Q.T + shift, snap={}))
    elasticity = Elasticity(body, material, kinematics, mean_dilatation)
    support, load = Support(body), np.zeros_like(body.coordinates)
    if platen:
        support.platen("top")
    elif held:
        support.fix_node(body.nodes(boundary)[0], x=0.0)
    if displacement is not None:
        support.fix("top", **dict(zip("xy", Q @ displacement)))
    else:
        load = elasticity.total_force("top", Q @ force if turn else force)
        if held and platen:
            support.fix("top", x=0.0)
    system = elasticity.system(load, support)
    road = Plane(np.asarray(shift) - gap * Q[:, 1], Q[:, 1])
    return BodyOnRoad(system, boundary, road, friction=friction)


def cylinder(R=1.0, E=1.0, nu=0.3, load=5e-3, friction=None, columns=16, layers=8, **options):
    """The half cylinder under a platen with the force load E R."""
    grid = half_cylinder(R, columns, layers, 0.02 * R)
    options = {"force": (0.0, -load * E * R), "boundary": "arc"} | options
    return pressed(grid, Isotropic(E, nu), friction=friction, **options)


def block(
    width=2.0, height=1.0, columns=8, rows=4, E=1.0, nu=0.3, cell="quadrilateral", distortion=0.0, **options
):
    """A rectangle with its bottom on the road."""
    grid = rectangle(width, height, columns, rows, cell, distortion=distortion)
    return pressed(grid, Isotropic(E, nu), **options)


def certificate(problem, solution):
    """Largest violation of equilibrium, g >= 0, p >= 0, p g = 0, the cone, and of slip against friction.

    By plain numpy from displacements and forces alone; forces relative to the largest, lengths to the largest
    displacement.
    """
    u, f, n = solution.displacement, solution.contact_force, problem.normal
    nodes = problem.contact_nodes
    force_size = max(np.abs(f).max(), np.abs(problem.b).max()) or 1.0
    length = np.abs(u).max() or 1.0
    missing = (problem.A @ u.ravel()).reshape(u.shape) - problem.b
    missing[nodes] -= f
    p = np.einsum("ca,ca->c", f, n)
    gap = problem.gap + np.einsum("ca,ca->c", u[nodes], n)
    slip = u[nodes] - problem.tangential_reference
    slip -= np.einsum("ca,ca->c", slip, n)[:, None] * n
    tau = f - p[:, None] * n
    mu = problem.friction_coefficient
    size, way = np.linalg.norm(tau, axis=1), np.linalg.norm(slip, axis=1)
    return max(
        np.abs(missing).max() / force_size,
        -gap.min() / length,
        -p.min() / force_size,
        np.max(np.minimum(p / force_size, np.abs(gap) / length)),
        np.max(size - mu * p) / force_size,
        np.max(
            np.minimum(np.maximum(mu * p - size, 0.0) / force_size, way / length)
        ),  # slips below the bound
        np.max(np.einsum("ca,ca->c", tau, slip) / (force_size * length)),  # pushed on
    )


def by_least_squares(problem):
    """Forces and displacements of a frictionless problem that is held, by another algorithm.

    With the compliance W = L L' of the candidates, min 1/2 p W p + p g over p >= 0 is a non-negative least
    squares problem, solved by Lawson and Hanson's active sets.
    """
    A, n = problem.A.toarray(), problem.normal
    N = np.zeros((n.shape[0], A.shape[0]))
    for c, node in enumerate(problem.contact_nodes):
        N[c, node * problem.dim : (node + 1) * problem.dim] = n[c]
    free = np.linalg.solve(A, np.column_stack([problem.b.ravel(), N.T]))
    gap, W = problem.gap + N @ free[:, 0], N @ free[:, 1:]
    L = cholesky((W + W.T) / 2, lower=True)
    p = nnls(L.T, -solve_triangular(L, gap, lower=True), maxiter=100 * gap.size)[0]
    return p, (free[:, 0] + free[:, 1:] @ p).reshape(-1, problem.dim)


def same(one, other, length=1.0, force=1.0, turn=0.0):
    """Difference of an answer from another one, scaled and turned."""
    Q = rotation(turn)
    return max(
        deviation(one.displacement, length * other.displacement @ Q.T),
        deviation(one.contact_force, force * other.contact_force @ Q.T),
    )
