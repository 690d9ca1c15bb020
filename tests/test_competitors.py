"""The solvers this project is compared with reach the same answer, so that the comparison is of equals."""

import numpy as np
import pytest
from competitors import ORDERINGS, penalty, snes, tao
from petsc4py import PETSc

from forms import Elasticity, Isotropic, Support
from geometry import Body, Plane, half_cylinder_nested
from model import solve
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


def test_penalty_tends_to_the_exact_answer_but_penetrates(pressed, start, ours):
    body, elasticity = pressed.elasticity.body, pressed.elasticity
    load = elasticity.total_force("top", (0.0, -1e4))
    held = np.array([2 * body.nearest_node((0.0, 10.0))])
    errors, depths = [], []
    for stiffness in (1e6, 1e7):
        u = penalty(elasticity, load, "arc", stiffness, held, start).displacement
        errors.append(np.abs(u - ours).max())
        depths.append(-(body.coordinates + u)[body.nodes("arc"), 1].min())
    assert errors[1] < errors[0]
    assert depths[0] / depths[1] == pytest.approx(10.0, rel=0.1)


def test_another_road_or_solver_is_refused(pressed):
    with pytest.raises(ValueError, match="linear is 'lu'"):
        snes(pressed.problem, "vinewtonrsls", "lu")
