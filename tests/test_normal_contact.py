"""Frictionless contact: patch test, manufactured Signorini problem, Hertz, equilibrium, node order."""

from dataclasses import replace

import numpy as np
import pytest

from forms import Elasticity, Isotropic, Support
from geometry import Body, Plane, half_cylinder, rectangle
from model import BodyOnRoad, ContactProblem, ContactSolver, Status, solve
from model.closed_forms.hertz import HertzCylinder
from model.results.pressure import contact_half_width

import ufl  # isort: skip
from dolfinx import fem  # isort: skip


@pytest.mark.parametrize("distortion", [0.0, 0.25])
@pytest.mark.parametrize("cell", ["quadrilateral", "triangle"])
def test_patch(cell, distortion):
    body = Body.from_grid(rectangle(2.0, 1.0, 6, 4, cell=cell, distortion=distortion, seed=3))
    elasticity = Elasticity(body, Isotropic(1000.0, 0.3))
    load = elasticity.traction("top", (0.0, -7.0))
    system = elasticity.system(load, Support(body).fix_node(body.nearest_node((0.0, 0.0)), x=0.0))
    pressed = BodyOnRoad(system, "bottom", Plane())
    pressure = pressed.pressure(solve(pressed.problem, "direct", tolerance=1e-13))
    assert np.abs(pressure / 7.0 - 1).max() < 1e-12


def manufactured(n):
    """Errors in H1 and L2 for u = (0, g(x) + y h(x, y)) with contact on the left half of the bottom."""
    body = Body.from_grid(rectangle(1.0, 1.0, n, n))
    E, nu = 1.0, 0.3
    elasticity = Elasticity(body, Isotropic(E, nu))
    x = ufl.SpatialCoordinate(body.mesh)
    s = x[0] - 0.5
    above = ufl.conditional(ufl.gt(s, 0.0), s**4, 0.0)  # gap opens smoothly on the right half
    pressed = ufl.conditional(ufl.lt(s, 0.0), s**4, 0.0)  # and the pressure on the left half
    u = ufl.as_vector((x[1] ** 2 * ufl.sin(x[0]), above - x[1] * pressed / 1.0 + x[1] ** 2 * x[0]))

    def stress(w):
        e = ufl.sym(ufl.grad(w))
        lame, shear = E * nu / ((1 + nu) * (1 - 2 * nu)), E / (2 * (1 + nu))
        return lame * ufl.tr(e) * ufl.Identity(2) + 2 * shear * e

    v = ufl.TestFunction(elasticity.V)
    n_out = ufl.FacetNormal(body.mesh)
    ds = ufl.Measure("ds", body.mesh, subdomain_data=body.facet_tags, metadata={"quadrature_degree": 8})
    dx = ufl.dx(metadata={"quadrature_degree": 8})
    work = -ufl.inner(ufl.div(stress(u)), v) * dx
    traction = ufl.dot(stress(u), n_out)
    for name in ("left", "right"):
        work += ufl.inner(traction, v) * ds(body.names[name])
    work += traction[0] * v[0] * ds(body.names["bottom"])
    load = fem.assemble_vector(fem.form(work)).array.reshape(-1, 2)
    K = elasticity.stiffness()
    exact = fem.Function(elasticity.V)
    points = elasticity.V.element.interpolation_points
    exact.interpolate(fem.Expression(u, points() if callable(points) else points))
    values = exact.x.array.reshape(-1, 2)
    support = Support(body)
    for node in body.nodes("top"):
        support.fix_node(int(node), x=float(values[node, 0]), y=float(values[node, 1]))
    problem = BodyOnRoad(support.apply(K, load), "bottom", Plane()).problem
    found = fem.Function(elasticity.V)
    found.x.array[:] = solve(problem, "direct", tolerance=1e-12).displacement.ravel()
    e = found - u
    l2 = fem.assemble_scalar(fem.form(ufl.inner(e, e) * dx)) ** 0.5
    h1 = fem.assemble_scalar(fem.form(ufl.inner(ufl.grad(e), ufl.grad(e)) * dx)) ** 0.5
    return h1, l2


def test_manufactured_signorini_converges():
    coarse, fine = manufactured(16), manufactured(32)
    assert np.log2(coarse[0] / fine[0]) == pytest.approx(1.0, abs=0.1)
    assert np.log2(coarse[1] / fine[1]) == pytest.approx(2.0, abs=0.3)


@pytest.fixture(scope="module")
def cylinder():
    body = Body.from_grid(half_cylinder(10.0))
    elasticity = Elasticity(body, Isotropic(210e3, 0.3))
    support = Support(body).fix_node(body.nearest_node((0.0, 10.0)), x=0.0)
    system = elasticity.system(elasticity.total_force("top", (0.0, -1e4)), support)
    return BodyOnRoad(system, "arc", Plane())


def test_hertz_at_760_quadrilaterals(cylinder):
    solution = solve(cylinder.problem, "direct", tolerance=1e-12)
    hertz = HertzCylinder(1e4, 10.0, 210e3, 0.3)
    x, p = cylinder.points[:, 0], cylinder.pressure(solution)
    patch = contact_half_width(x, p, solution.status != Status.FREE)
    assert abs(p.max() / hertz.p0 - 1) < 0.002
    assert patch.lower < hertz.a < patch.upper
    assert abs(patch.interpolated / hertz.a - 1) < 0.01
    assert solution.gap.min() == 0.0
    assert p.min() == 0.0
    assert abs(solution.contact_force[:, 1].sum() / 1e4 - 1) < 1e-10
    assert solution.residual < 1e-10
    assert np.all(solution.gap[p > 0] == 0.0)


def bed(order=None, correction="none"):
    """A block pressed on a bumpy plane, small enough for the loop alone."""
    body = Body.from_grid(rectangle(1.0, 0.5, 8, 4))
    elasticity = Elasticity(body, Isotropic(1.0, 0.3))
    system = elasticity.system(np.zeros((45, 2)), Support(body).fix("top", x=0.0, y=-0.03))
    problem = BodyOnRoad(system, "bottom", Plane()).problem
    gap = 0.02 * np.cos(9 * problem.coordinates[problem.contact_nodes, 0]) ** 2
    return solve(replace(problem, gap=gap), correction, tolerance=1e-13, order=order)


def test_answer_does_not_depend_on_node_order():
    forward = bed()
    shuffled = np.random.default_rng(4).permutation(45)
    for order in (np.arange(45)[::-1], shuffled):
        other = bed(order)
        assert (
            np.abs(other.displacement - forward.displacement).max()
            < 1e-8 * np.abs(forward.displacement).max()
        )
    direct = bed(correction="direct")
    assert (
        np.abs(direct.displacement - forward.displacement).max() < 1e-8 * np.abs(forward.displacement).max()
    )
    assert np.any(direct.status == Status.FREE)
    assert np.any(direct.status != Status.FREE)


def test_problem_is_saved_and_loaded(cylinder, tmp_path):
    solution = solve(cylinder.problem, "direct")
    cylinder.problem.save(tmp_path / "problem.npz", solution)
    loaded = ContactProblem.load(tmp_path / "problem.npz")
    again = solve(loaded, "direct")
    assert np.abs(again.displacement - solution.displacement).max() < 1e-12
    with np.load(tmp_path / "problem.npz") as file:
        gap = file["gap"] + np.einsum("ca,ca->c", file["normal"], file["displacement"][file["contact_nodes"]])
    assert gap.min() >= 0.0


def test_a_body_pulled_away_or_left_loose_is_refused(cylinder):
    problem = cylinder.problem
    with pytest.raises(ValueError, match="neither supports nor the road can stop"):
        ContactSolver(
            ContactProblem(
                problem.A, -problem.b, problem.coordinates, problem.contact_nodes, problem.normal, problem.gap
            )
        ).solve()
    body = cylinder.elasticity.body
    K, load = cylinder.elasticity.stiffness(), cylinder.elasticity.total_force("top", (0.1, -1.0))
    system = Support(body).apply(K, load)
    with pytest.raises(
        ValueError, match=r"translation along \(1, 0\) that neither supports nor the road can stop"
    ):
        solve(BodyOnRoad(system, "arc", Plane()).problem)
