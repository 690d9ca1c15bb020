"""From nodal contact forces to pressures, and from pressures to the patch and its error.

A nodal force is the integral of pressure times shape function. Two ways back, measured on the half cylinder:

`lumped` divides by the area that belongs to the node. It never changes a sign and is the more accurate:
relative L2 error against Hertz 0.04, 0.017, 0.0065 on 945, 3,681 and 14,529 nodes.

`consistent` solves with the boundary mass matrix. The pressure jumps in slope at the edge of the patch, which
the solution answers with an overshoot of some percents of p0 inwards (L2 error 0.04, 0.020, 0.012). With the
rows of all candidates it also oscillates outwards, into tension; with the nodes in contact alone it loses 0.1
% of the force. So the matrix is restricted to the nodes in contact, and what they share with others is lumped
onto them: pressure is zero outside and the resultant exact.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import scipy.sparse as sparse
from scipy.sparse.linalg import spsolve

from checks import numbers, whole

REAL = 1e-9  # of the patch's length: roots of the fit with a smaller imaginary part are real but for rounding


def lumped(boundary_mass: sparse.csr_array, nodes: np.ndarray, force: np.ndarray) -> np.ndarray:
    """Nodal forces over the length or area of each node.

    Parameters
    ----------
    boundary_mass : scipy.sparse.csr_array, shape (N, N)
        Integrals of products of shape functions over the boundary (mm, or mm^2).
    nodes : ndarray of int, shape (n,)
        The nodes with forces.
    force : ndarray, shape (n,) or (n, dim)
        Nodal forces (N/mm, or N).

    Returns
    -------
    ndarray
        Pressures or tractions (MPa), shaped like `force`.

    Raises
    ------
    ValueError
        If shapes do not fit or a node is not on the boundary.

    Examples
    --------
    >>> from forms import Elasticity, Isotropic, Support
    >>> from geometry import Body, Plane, rectangle
    >>> from model import BodyOnRoad, lumped, solve
    >>> elasticity = Elasticity(Body.from_grid(rectangle(2.0, 1.0, 4, 2)), Isotropic(E=1e3, nu=0.0))
    >>> support = Support(elasticity.body).fix("top", x=0.0, y=-0.01)
    >>> system = elasticity.system(elasticity.body_force((0.0, 0.0)), support)
    >>> contact = BodyOnRoad(system, "bottom", Plane())
    >>> M = elasticity.boundary_mass("bottom")
    >>> lumped(M, contact.nodes, solve(contact).pressure_force).round(9)
    array([10., 10., 10., 10., 10.])
    """
    force = _checked(boundary_mass, nodes, force)
    area = (boundary_mass @ np.ones(boundary_mass.shape[1]))[nodes]
    return (force.T / area).T


def consistent(
    boundary_mass: sparse.csr_array, nodes: np.ndarray, force: np.ndarray, in_contact: np.ndarray
) -> np.ndarray:
    """Pressures whose integrals against the shape functions are the nodal forces.

    Parameters
    ----------
    boundary_mass, nodes, force
        As for `lumped`.
    in_contact : ndarray of bool, shape (n,)
        Nodes that touch; the pressure of the others is 0.

    Returns
    -------
    ndarray
        Pressures or tractions (MPa), shaped like `force`.

    Raises
    ------
    ValueError
        If shapes do not fit or a node is not on the boundary.

    Examples
    --------
    >>> from forms import Elasticity, Isotropic, Support
    >>> from geometry import Body, Plane, rectangle
    >>> from model import BodyOnRoad, consistent, solve
    >>> elasticity = Elasticity(Body.from_grid(rectangle(2.0, 1.0, 4, 2)), Isotropic(E=1e3, nu=0.0))
    >>> support = Support(elasticity.body).fix("top", x=0.0, y=-0.01)
    >>> system = elasticity.system(elasticity.body_force((0.0, 0.0)), support)
    >>> contact = BodyOnRoad(system, "bottom", Plane())
    >>> M, solution = elasticity.boundary_mass("bottom"), solve(contact)
    >>> consistent(M, contact.nodes, solution.pressure_force, solution.gap == 0.0).round(9)
    array([10., 10., 10., 10., 10.])
    """
    force = _checked(boundary_mass, nodes, force)
    touching = np.asarray(nodes)[in_contact]
    pressure = np.zeros_like(force)
    if touching.size:
        rows = boundary_mass[touching]
        M = rows[:, touching]
        shared = sparse.diags_array(rows.sum(axis=1) - M.sum(axis=1))
        pressure[in_contact] = spsolve(sparse.csc_array(M + shared), force[in_contact])
    return pressure


class HalfWidth(NamedTuple):
    """Half width of a patch on a line: to the last nodes that touch, to the first that do not, between.

    Examples
    --------
    >>> from model import HalfWidth
    >>> HalfWidth(lower=0.9, upper=1.1, interpolated=1.0, centre=0.0).interpolated
    1.0
    """

    lower: float
    upper: float
    interpolated: float
    centre: float


def contact_half_width(
    x: np.ndarray, pressure: np.ndarray, in_contact: np.ndarray, degree: int = 1
) -> HalfWidth:
    """Half width of a contact patch, and where its middle is.

    Between the nodes it is interpolated: p^2 of an ellipse is a parabola in x, so a polynomial of degree 2
    `degree` is fitted to the pressures of all touching nodes but the two outermost (which stand for partly
    covered lengths) and followed to its zeros. Degree 1 is exact for Hertz; 2 suits the more peaked pressure
    under friction. A patch of too few nodes for the fit gets the mean of `lower` and `upper`.

    Parameters
    ----------
    x : ndarray, shape (n,)
        Positions of the candidate nodes along the road (mm), in any order.
    pressure : ndarray, shape (n,)
        Their pressures (MPa), best lumped.
    in_contact : ndarray of bool, shape (n,)
        Which of them touch.
    degree : int
        1 without friction, 2 with.

    Returns
    -------
    HalfWidth
        `upper` is infinite if the patch reaches the last candidate.

    Raises
    ------
    ValueError
        If no node touches.

    Examples
    --------
    >>> import numpy as np
    >>> from model import contact_half_width
    >>> x = np.linspace(-2.0, 2.0, 41)
    >>> p = np.sqrt(np.maximum(1.0 - x**2 / 1.05**2, 0.0))  # Hertz, half width 1.05 mm
    >>> patch = contact_half_width(x, p, p > 0.0)
    >>> [round(float(a), 9) for a in (patch.lower, patch.upper, patch.interpolated)]
    [1.0, 1.1, 1.05]
    """
    whole(1, degree=degree)
    x, pressure = numbers("x", x), numbers("pressure", pressure)
    if not x.shape == pressure.shape == np.shape(in_contact) == (x.size,):
        raise ValueError(
            f"x, pressure and in_contact have the shapes {x.shape}, {pressure.shape} and "
            f"{np.shape(in_contact)}; give one value a node."
        )
    order = np.argsort(x)
    x, pressure = x[order], pressure[order]
    touching = np.flatnonzero(np.asarray(in_contact)[order])
    if touching.size == 0:
        raise ValueError("No node is in contact, so there is no patch to measure.")
    first, last = touching[0], touching[-1]
    left, right = x[first], x[last]
    reaches_end = first == 0 or last == x.size - 1
    upper = np.inf if reaches_end else (x[last + 1] - x[first - 1]) / 2
    edges = _edges_of_fit(x[touching[1:-1]], pressure[touching[1:-1]], degree)
    if edges is None:
        left, right = (left, right) if reaches_end else ((left + x[first - 1]) / 2, (right + x[last + 1]) / 2)
    else:
        left, right = edges
    return HalfWidth(
        float(x[last] - x[first]) / 2, float(upper), float(right - left) / 2, float(right + left) / 2
    )


def _edges_of_fit(x: np.ndarray, pressure: np.ndarray, degree: int) -> tuple[float, float] | None:
    """Find the zeros next to the data of the polynomial fitted to p^2; None if it has none on either side."""
    if x.size <= 2 * degree:
        return None
    roots = np.polynomial.Polynomial.fit(x, pressure**2, 2 * degree).roots()
    roots = roots[np.abs(roots.imag) < REAL * np.ptp(x)].real
    left, right = roots[roots < x[0]], roots[roots > x[-1]]
    return (left.max(), right.min()) if left.size and right.size else None


def line_error(x: np.ndarray, pressure: np.ndarray, exact: Callable[[np.ndarray], np.ndarray]) -> float:
    """L2 error of a pressure along a line, relative to the exact one, with what happens between the nodes.

    Parameters
    ----------
    x : ndarray, shape (n,)
        Positions of the nodes (mm), in any order; pressure is linear between them.
    pressure : ndarray, shape (n,)
        Their pressures (MPa).
    exact : callable
        Exact pressure at given positions.

    Examples
    --------
    >>> import numpy as np
    >>> from model import line_error
    >>> x = np.linspace(0.0, 1.0, 11)
    >>> round(line_error(x, 1.01 * x, lambda s: s), 9)
    0.01
    """
    order = np.argsort(x)
    x, pressure = np.asarray(x, dtype=float)[order], np.asarray(pressure, dtype=float)[order]
    point, weight = np.polynomial.legendre.leggauss(40)  # many, for the square-root edge inside one interval
    half = np.diff(x)[:, None] / 2
    s = (x[1:, None] + x[:-1, None]) / 2 + half * point
    difference = np.interp(s, x, pressure) - exact(s)
    return float(np.sqrt(np.sum(half * weight * difference**2) / np.sum(half * weight * exact(s) ** 2)))


def surface_error(
    boundary_mass: sparse.csr_array, nodes: np.ndarray, pressure: np.ndarray, exact: np.ndarray
) -> float:
    """L2 error of a pressure on a surface, relative to the exact one, both linear between nodal values.

    Parameters
    ----------
    boundary_mass : scipy.sparse.csr_array, shape (N, N)
        As for `lumped`.
    nodes : ndarray of int, shape (n,)
        The candidates.
    pressure, exact : ndarray, shape (n,)
        Computed and exact pressure at them (MPa).

    Examples
    --------
    >>> from forms import Elasticity, Isotropic, Support
    >>> from geometry import Body, Plane, rectangle
    >>> from model import BodyOnRoad, surface_error, solve
    >>> elasticity = Elasticity(Body.from_grid(rectangle(2.0, 1.0, 4, 2)), Isotropic(E=1e3, nu=0.0))
    >>> support = Support(elasticity.body).fix("top", x=0.0, y=-0.01)
    >>> system = elasticity.system(elasticity.body_force((0.0, 0.0)), support)
    >>> contact = BodyOnRoad(system, "bottom", Plane())
    >>> p = contact.pressure(solve(contact))
    >>> round(surface_error(elasticity.boundary_mass("bottom"), contact.nodes, 1.01 * p, p), 9)
    0.01
    """
    M = boundary_mass[nodes][:, nodes]
    difference = np.asarray(pressure) - exact
    return float(np.sqrt((difference @ (M @ difference)) / (exact @ (M @ exact))))


def _checked(boundary_mass: sparse.csr_array, nodes: np.ndarray, force: np.ndarray) -> np.ndarray:
    """Return the forces as floats, once nodes and matrix fit them."""
    force, nodes = np.asarray(force, dtype=float), np.asarray(nodes)
    if force.shape[:1] != nodes.shape:
        raise ValueError(
            f"force has {force.shape[0]} rows, but {nodes.size} nodes are given; give one row a node."
        )
    if not np.isfinite(force).all():
        bad = ~np.isfinite(force).reshape(nodes.size, -1).all(axis=1)
        raise ValueError(f"The force at node {nodes[bad][0]} is {force[bad][0]}; it must be finite.")
    bare = nodes[boundary_mass.diagonal()[nodes] <= 0]
    if bare.size:
        raise ValueError(
            f"Node {bare[0]} is not on the boundary of this mass matrix; give only nodes that are."
        )
    return force
