"""Nodal forces to pressures, and pressures to the patch and its error, on meshes without finite elements."""

import numpy as np
import pytest
import scipy.sparse as sparse

from model.closed_forms.hertz import HertzCylinder
from model.closed_forms.spence import Spence
from model.results.pressure import consistent, contact_half_width, line_error, lumped, surface_error

HERTZ = HertzCylinder(P=1e4, R=10, E=210e3, nu=0.3)


def line_mass(x):
    """Boundary mass of a polyline with nodes x."""
    h = np.diff(x)
    diagonal = (np.append(h, 0) + np.append(0, h)) / 3
    return sparse.csr_array(sparse.diags_array([h / 6, diagonal, h / 6], offsets=[-1, 0, 1]))


def nodal_forces(x, pressure):
    """Integrals of a pressure against the shape functions."""
    point, weight = np.polynomial.legendre.leggauss(200)
    half = np.diff(x)[:, None] / 2
    s = (x[1:, None] + x[:-1, None]) / 2 + half * point
    p = half * weight * pressure(s)
    right = (p * (1 + point) / 2).sum(axis=1)
    return np.append(p.sum(axis=1) - right, 0) + np.append(0, right)


@pytest.mark.parametrize("columns", [(), (2,)])
def test_uniform_pressure_is_found_exactly(columns):
    x = np.cumsum(1 + np.random.default_rng(1).random(12))
    M, nodes = line_mass(x), np.arange(12)[::-1]
    traction = np.ones((12, *columns)) * 3.5
    force = (M @ traction)[nodes]
    assert lumped(M, nodes, force) == pytest.approx(traction)
    assert consistent(M, nodes, force, np.ones(12, bool)) == pytest.approx(traction)


def test_both_pressures_are_zero_outside_and_carry_the_load():
    x = np.linspace(-1.5, 1.5, 60)
    M, force = line_mass(x), nodal_forces(x, HERTZ.pressure)
    touching = force > 0
    for pressure in (lumped(M, np.arange(60), force), consistent(M, np.arange(60), force, touching)):
        assert np.all(pressure[~touching] == 0)
        assert np.sum(M @ pressure) == pytest.approx(force.sum(), rel=1e-13)
    assert force.sum() == pytest.approx(HERTZ.P, rel=1e-5)


def test_error_of_the_lumped_pressure_has_order_one():
    """The square root at the edge sets the order: an error of sqrt(h) on a length of h."""
    errors = []
    for n in (50, 100, 200, 400):
        x = np.linspace(-2, 2, n + 1)
        p = lumped(line_mass(x), np.arange(n + 1), nodal_forces(x, HERTZ.pressure))
        errors.append(line_error(x, p, HERTZ.pressure))
    order = np.log2(errors[0] / errors[-1]) / 3
    assert 0.8 < order < 1.3
    assert errors[-1] < 0.01


def test_errors_vanish_for_the_exact_pressure():
    x = np.linspace(-1, 1, 31)
    assert line_error(x[::-1], (2 - x)[::-1], lambda s: 2 - s) < 1e-14
    assert surface_error(line_mass(x), np.arange(31), 2 - x, 2 - x) == 0
    assert surface_error(line_mass(x), np.arange(31), 1.1 * (2 - x), 2 - x) == pytest.approx(0.1)


@pytest.mark.parametrize("centre", [0.0, 0.31])
def test_half_width_of_an_ellipse_is_exact(centre):
    x = np.random.default_rng(2).permutation(np.linspace(-1.5, 1.5, 43))
    p = HERTZ.pressure(x - centre)
    width = contact_half_width(x, p, p > 0)
    assert width.lower < HERTZ.a < width.upper
    assert width.upper - width.lower == pytest.approx(3 / 42)
    assert (width.interpolated, width.centre) == pytest.approx((HERTZ.a, centre))


def test_half_width_from_forces_converges():
    errors = []
    for n in (30, 60, 120, 240):
        x = np.linspace(-1.5, 1.5, n + 1)
        p = lumped(line_mass(x), np.arange(n + 1), nodal_forces(x, HERTZ.pressure))
        errors.append(abs(contact_half_width(x, p, p > 0).interpolated / HERTZ.a - 1))
    assert errors[0] < 0.01 and errors[-1] < 5e-4


def test_half_width_with_friction_needs_the_second_degree():
    spence = Spence(HERTZ, 0.5)
    x = np.linspace(-1.0, 1.0, 57)
    p = spence.pressure(x)
    widths = [contact_half_width(x, p, p > 0, degree).interpolated for degree in (1, 2)]
    assert widths[0] < 0.985 * spence.a
    assert widths[1] == pytest.approx(spence.a, rel=5e-3)


def test_half_width_of_few_nodes():
    x = np.arange(5.0)
    width = contact_half_width(x, np.array([0, 0, 7.0, 0, 0]), x == 2)
    assert tuple(width) == (0, 1, 0.5, 2)
    everywhere = contact_half_width(x, np.ones(5), x >= 0)
    assert everywhere.lower == 2 and everywhere.upper == np.inf
    with pytest.raises(ValueError, match="No node is in contact"):
        contact_half_width(x, np.zeros(5), x < 0)


def test_wrong_arguments_get_a_sentence():
    x = np.arange(5.0)
    M = sparse.csr_array(sparse.block_diag([line_mass(x), sparse.csr_array((2, 2))], format="csr"))
    with pytest.raises(ValueError, match="3 rows, but 5 nodes"):
        lumped(M, np.arange(5), np.ones(3))
    with pytest.raises(ValueError, match="node 1 is nan"):
        lumped(M, np.array([0, 1]), np.array([1, np.nan]))
    with pytest.raises(ValueError, match="Node 6 is not on the boundary"):
        consistent(M, np.array([0, 6]), np.ones((2, 2)), np.array([True, True]))
