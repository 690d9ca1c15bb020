"""The solvers this project is compared with reach the same answer, so that the comparison is of equals."""

from dataclasses import replace

import numpy as np
import pytest
from competitors import ORDERINGS, snes, tao
from petsc4py import PETSc
from weak_contact import Pressed, latent_variable, nitsche, penalty

from forms import Elasticity, Isotropic, Support
from geometry import Body, Plane, box, half_cylinder_nested
from model import ContactSolver, Status, follow, solve
from model.results.body_on_road import BodyOnRoad


@pytest.fixture(scope="module")
def pressed():
    body = Body.from_grid(half_cylinder_nested(10.0), 1)
    elasticity = Elasticity(body, Isotropic(210e3, 0.3))
    support = Support(body).fix_node(body.nearest_node((0.0, 10.0)), x=0.0)
    system = elasticity.system(elasticity.total_force("top", (0.0, -1e4)), support)
    return BodyOnRoad(system, "arc", Plane())


@pytest.fixture(scope="module")
def start(pressed):
    u = np.zeros(pressed.problem.b.shape)
    u[:, 1] = -0.05
    return u


@pytest.fixture(scope="module")
def ours(pressed):
    return solve(pressed.problem, "direct", tolerance=1e-11).displacement


@pytest.mark.parametrize(
    ("method", "kind", "linear"),
    [
        (snes, "vinewtonrsls", "mumps"),
        (snes, "vinewtonrsls", "gamg"),
        (tao, "gpcg", "mumps"),
        (tao, "gpcg", "gamg"),
        (tao, "bnls", "mumps"),
    ],
)
def test_petsc_finds_the_same_displacement(pressed, start, ours, method, kind, linear):
    theirs = method(pressed.problem, kind, linear, start, tolerance=1e-10).displacement
    assert np.abs(theirs - ours).max() < 1e-8 * np.abs(ours).max()


@pytest.mark.parametrize("ordering", ORDERINGS)
def test_no_ordering_changes_the_answer_or_stays_behind(pressed, start, ours, ordering):
    options = PETSc.Options().getAll()
    theirs = snes(pressed.problem, "vinewtonrsls", "mumps", start, 1e-10, ordering).displacement
    assert np.abs(theirs - ours).max() < 1e-8 * np.abs(ours).max()
    assert PETSc.Options().getAll() == options


def test_what_does_not_converge_says_so(pressed, start):
    with pytest.raises(RuntimeError, match="TAO bqpip mumps stopped with reason"):
        tao(pressed.problem, "bqpip", "mumps", start)


@pytest.fixture(scope="module")
def weakly(pressed):
    body, elasticity = pressed.elasticity.body, pressed.elasticity
    load = elasticity.total_force("top", (0.0, -1e4))
    return Pressed(elasticity, load, "arc", np.array([2 * body.nearest_node((0.0, 10.0))]))


def depth(weakly, u):
    body = weakly.elasticity.body
    return -(body.coordinates + u)[body.nodes(weakly.boundary), -1].min()


def test_penalty_tends_to_the_exact_answer_but_penetrates(weakly, start, ours):
    errors, depths = [], []
    for stiffness in (1e6, 1e7):
        u = penalty(weakly, stiffness, start).displacement
        errors.append(np.abs(u - ours).max())
        depths.append(depth(weakly, u))
    assert errors[1] < errors[0]
    assert depths[0] / depths[1] == pytest.approx(10.0, rel=0.1)


def test_weak_forms_of_contact_find_nearly_the_same_displacement(weakly, start, ours):
    for answer in (nitsche(weakly, 1e8, start), latent_variable(weakly, 1e-4)[0]):
        assert np.abs(answer.displacement - ours).max() < 5e-3 * np.abs(ours).max()


@pytest.mark.parametrize(("method", "stiffness"), [(penalty, 1e8), (nitsche, 1e8)])
def test_weak_forms_of_friction_find_nearly_the_same_displacement(pressed, method, stiffness):
    """A top that is lowered, then moved along: part of the patch slips."""
    elasticity, mu, loads, values = pressed.elasticity, 0.5, [], []
    body = elasticity.body
    for moved in (0.0, 0.02):
        support = Support(body).fix("top", x=moved, y=-0.05)
        system = elasticity.system(np.zeros_like(body.coordinates), support)
        contact = BodyOnRoad(system, "arc", Plane(), friction=mu)
        loads.append(contact.problem.b)
        values.append(np.tile([moved, -0.05], len(body.nodes("top"))))
    path = list(follow(ContactSolver(contact.problem, "direct"), loads, tolerance=1e-10))
    assert {Status.SLIP, Status.STICK} <= set(path[-1].status)
    fixed = (2 * body.nodes("top")[:, None] + np.arange(2)).ravel()
    weakly = Pressed(elasticity, np.zeros_like(body.coordinates), "arc", fixed, friction=mu)
    guess = np.zeros_like(body.coordinates)
    guess[:, 1] = -0.05
    exact, found = path[-1].displacement, method(weakly, stiffness, guess, values).displacement
    assert np.abs(found - exact).max() < 5e-3 * np.abs(exact).max()
    without = solve(replace(contact.problem, friction=None, b=loads[-1]), "direct").displacement
    assert np.abs(found - exact).max() < 0.2 * np.abs(without - exact).max()


def test_the_latent_variable_method_takes_the_steps_that_were_published():
    """A unit cube pressed by 0.25 on a plane, 16 x 7 x 5 hexahedra: 2 proximal and 6 Newton steps."""
    elasticity = Elasticity(Body.from_grid(box(1.0, 1.0, 1.0, 16, 7, 5)), Isotropic(2e4, 0.3))
    body = elasticity.body
    top, nothing = body.nodes("top"), np.zeros_like(body.coordinates)
    fixed, values = (3 * top[:, None] + np.arange(3)).ravel(), np.tile([0.0, 0.0, -0.25], len(top))
    weakly = Pressed(elasticity, nothing, "bottom", fixed, values)
    answer, rounds = latent_variable(weakly, 0.005)
    assert (rounds, answer.steps) == (2, 6)
    system = elasticity.system(nothing, Support(body).fix("top", x=0.0, y=0.0, z=-0.25))
    exact = solve(BodyOnRoad(system, "bottom", Plane((0, 0, 0), (0, 0, 1))).problem, tolerance=1e-10)
    assert np.abs(answer.displacement - exact.displacement).max() < 1e-6


def test_another_road_or_solver_is_refused(pressed):
    with pytest.raises(ValueError, match="linear is 'lu'"):
        snes(pressed.problem, "vinewtonrsls", "lu")
