"""Bad input gets one sentence that names the value and the remedy, from the function that was called."""

import numpy as np
import pytest

from forms import Elasticity, Hyperelasticity, Isotropic, NeoHookean, Support
from geometry import Body, Grid, LinearRoad, Plane, SeveralRoads, box, half_cylinder, rectangle
from model import BodyOnRoad, ContactProblem, MovingBody, follow, friction_law, solve


@pytest.fixture(scope="module")
def elasticity():
    return Elasticity(Body.from_grid(rectangle(1.0, 1.0, 2, 2)), Isotropic(1.0, 0.3))


@pytest.fixture
def problem(elasticity):
    load = elasticity.total_force("top", (0.0, -0.1))
    system = elasticity.system(load, Support(elasticity.body).fix("top", x=0.0))
    return BodyOnRoad(system, "bottom", Plane()).problem


@pytest.mark.parametrize("E", [0.0, -1.0, np.nan, np.inf])
def test_modulus(E):
    with pytest.raises(ValueError, match="E"):
        Isotropic(E, 0.3)


@pytest.mark.parametrize("nu", [0.5, -1.0, 0.7, np.nan])
def test_poisson_ratio(nu):
    with pytest.raises(ValueError, match="nu"):
        Isotropic(1.0, nu)


def test_incompressible():
    with pytest.raises(ValueError, match="nu is 0.5; .*mean_dilatation=True"):
        Isotropic(1.0, 0.5)


@pytest.mark.parametrize("material", [{"E": 1.0, "nu": 0.3}, (1.0, 0.3), {"soft": 3.0}, None])
def test_materials_that_are_none(elasticity, material):
    with pytest.raises(ValueError, match=r"give Isotropic\(E=..., nu=...\)"):
        Elasticity(elasticity.body, material)


def test_roads_of_another_dimension(elasticity):
    system = elasticity.system(np.zeros((9, 2)))
    places = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]
    with pytest.raises(ValueError, match="LinearRoad has 3 dimensions"):
        BodyOnRoad(system, "bottom", LinearRoad(places, np.zeros(3)))
    block = Elasticity(Body.from_grid(box(1.0, 1.0, 1.0, 1, 1, 1)), Isotropic(1.0, 0.3))
    system = block.system(np.zeros((8, 3)))
    with pytest.raises(ValueError, match="LinearRoad has 2 dimensions.*ExtrudedRoad"):
        BodyOnRoad(system, "bottom", LinearRoad([0.0, 1.0], [0.0, 0.0]))
    assert BodyOnRoad(system, "bottom", Plane()).problem.gap.max() < 1e-15


@pytest.mark.parametrize("road", [None, "road.csv", np.zeros((3, 2))])
def test_roads_that_are_none(elasticity, road):
    system = elasticity.system(np.zeros((9, 2)), density=1.0)
    with pytest.raises(ValueError, match="The road is of type .*Plane()"):
        BodyOnRoad(system, "bottom", road)
    with pytest.raises(ValueError, match="The road is of type .*Plane()"):
        MovingBody.from_forms(elasticity, 1.0, np.zeros((9, 2)), road, "bottom")


def test_names_in_names_and_words_for_numbers(elasticity):
    system = elasticity.system(np.zeros((9, 2)))
    with pytest.raises(ValueError, match="give indices of facets, say .*, or names of boundaries"):
        BodyOnRoad(system, [["bottom"], "left"], Plane())
    with pytest.raises(ValueError, match="mu is 'rough'; it must be numbers"):
        BodyOnRoad(system, "bottom", Plane(), friction="rough")
    with pytest.raises(ValueError, match="on 'top' is '0'; it must be a finite number"):
        Support(elasticity.body).fix("top", x="0")


@pytest.mark.parametrize("density", [0.0, -1.0, np.nan])
def test_density(elasticity, density):
    with pytest.raises(ValueError, match="density"):
        elasticity.mass(density)


@pytest.mark.parametrize("radius", [0.0, -10.0, np.nan])
def test_radius(radius):
    with pytest.raises(ValueError, match="radius"):
        half_cylinder(radius)


def test_unknown_boundary(elasticity):
    with pytest.raises(ValueError, match="bottom"):
        elasticity.traction("tread", (0.0, 1.0))
    with pytest.raises(ValueError, match="'tread'"):
        Support(elasticity.body).fix("tread", x=0.0)


def test_no_candidates(elasticity):
    system = elasticity.system(np.zeros((9, 2)))
    with pytest.raises(ValueError, match="reach"):
        BodyOnRoad(system, "bottom", Plane((0.0, -5.0)), reach=1.0)


def test_folded_cells_unused_nodes_and_nan():
    points = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]])
    folded = np.vstack([points[:3], [[-0.5, -0.5]]])
    with pytest.raises(ValueError, match="folded or flat, the first is cell 0"):
        Body.from_grid(Grid(folded, np.array([[0, 1, 2, 3]]), "quadrilateral", {}))
    with pytest.raises(ValueError, match="belong to no cell"):
        Body.from_grid(Grid(np.vstack([points, [[5.0, 5.0]]]), np.array([[0, 1, 2, 3]]), "quadrilateral", {}))
    points[0, 0] = np.nan
    with pytest.raises(ValueError, match="Node 0 of the mesh is at"):
        Body.from_grid(Grid(points, np.array([[0, 1, 2, 3]]), "quadrilateral", {}))


def test_a_body_below_the_road(elasticity):
    system = elasticity.system(np.zeros((9, 2)), Support(elasticity.body).fix("top", x=0.0))
    with pytest.raises(ValueError, match="below the road"):
        BodyOnRoad(system, "bottom", Plane((0.0, 0.2)))


def rebuilt(problem, **changes):
    names = ("A", "b", "coordinates", "contact_nodes", "normal", "gap")
    return ContactProblem(**{name: getattr(problem, name) for name in names} | changes)


@pytest.mark.parametrize(
    ("name", "value", "says"),
    [
        ("b", np.full((9, 2), np.nan), "b holds nan"),
        ("b", np.zeros(3), "b has shape"),
        ("b", np.zeros((2, 9)), "b has shape"),
        ("gap", np.array([0.0, np.nan, 0.0]), "gap holds nan"),
        ("normal", np.full((3, 2), 0.5), "unit vectors"),
        ("contact_nodes", np.array([], dtype=int), "contact_nodes is empty"),
        ("contact_nodes", np.array([1, 1, 2]), "different nodes"),
        ("contact_nodes", np.array([1, 2, 99]), "different nodes"),
        ("contact_nodes", np.array([True, True, False]), "of type bool"),
        ("coordinates", np.zeros((9, 4)), "4 columns"),
        ("A", np.eye(18), "sparse"),
        ("friction", -0.1, "mu is -0.1"),
        ("friction", np.nan, "mu is nan"),
    ],
)
def test_contact_problem(problem, name, value, says):
    with pytest.raises(ValueError, match=says):
        rebuilt(problem, **{name: value})


def test_solver_options(problem):
    with pytest.raises(ValueError, match="correction is 'magic'"):
        solve(problem, "magic")
    with pytest.raises(ValueError, match="permutation"):
        solve(problem, order=np.zeros(9, dtype=int))
    with pytest.raises(ValueError, match="start_status"):
        solve(problem, start_status=np.full(3, 9))
    for law in (lambda p, s, slipped: -p, lambda p, s, slipped: p / 0.0):
        with pytest.raises(ValueError, match="a finite number >= 0"):
            solve(rebuilt(problem, friction=friction_law(law)))
    for tolerance in (0.0, 1.0, np.nan, "small"):  # all is missing where nothing is done
        with pytest.raises(ValueError, match="tolerance is"):
            solve(problem, tolerance=tolerance)


def test_grids_and_roads_of_roads_that_are_none():
    for refinements in (-1, 1.5):
        with pytest.raises(ValueError, match="refinements is"):
            Body.from_grid(rectangle(1.0, 1.0, 2, 2), refinements)
    with pytest.raises(ValueError, match="grid is None; it must be a Grid"):
        Body.from_grid(None)
    with pytest.raises(ValueError, match="The road is of type int"):
        SeveralRoads([Plane(), 3])


def test_files_that_are_no_problems(tmp_path):
    path = tmp_path / "problem.npz"
    path.write_bytes(b"PK\x03\x04 no archive")
    with pytest.raises(ValueError, match="is not a contact problem"):
        ContactProblem.load(path)
    np.savez(path, indptr=np.array([object()], dtype=object))
    with pytest.raises(ValueError, match="is not a contact problem"):
        ContactProblem.load(path)
    with pytest.raises(FileNotFoundError):
        ContactProblem.load(tmp_path / "none.npz")


class Sloppy(Plane):
    """A road of a user's own that forgets to repeat its normal."""

    def closest(self, points):
        gap, _, foot = super().closest(points)
        return gap, self.normal, foot


def test_roads_of_ones_own_return_what_roads_return(elasticity):
    system = elasticity.system(np.zeros((9, 2)))
    with pytest.raises(ValueError, match=r"Sloppy, returns .* of shapes \(3,\), \(3, 2\) and"):
        BodyOnRoad(system, "bottom", Sloppy())


def test_finite_strain_is_not_taken_for_linear(elasticity):
    rubber = Hyperelasticity(elasticity.body, NeoHookean(1.0, 0.3))
    system = rubber.system(np.zeros((9, 2)), Support(elasticity.body).fix("top", x=0.0), density=1.0)
    contact = BodyOnRoad(system, "bottom", Plane())
    for call in (solve, lambda c: list(follow(c, [1.0]))):
        with pytest.raises(ValueError, match=r"finite strain .* take FiniteContact\(contact\)"):
            call(contact)
    with pytest.raises(ValueError, match="finite strain .* take FiniteBody"):
        MovingBody.from_contact(contact)
    with pytest.raises(ValueError, match="values of shape .*; it must return one number"):
        Hyperelasticity(elasticity.body, lambda C: C)
