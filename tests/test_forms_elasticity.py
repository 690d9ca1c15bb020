"""Assembled arrays against what they must do to simple fields, on every kind of cell."""

import numpy as np
import pytest
import scipy.sparse as sparse
from scipy.sparse.linalg import spsolve

from forms import Anisotropic, Elasticity, Isotropic, Support
from geometry import Body, box, half_cylinder_nested, rectangle

BODIES = {
    "quadrilateral": rectangle(2.0, 1.0, 5, 4, distortion=0.3),
    "triangle": rectangle(2.0, 1.0, 5, 4, "triangle", distortion=0.3),
    "hexahedron": box(2.0, 1.0, 1.0, 3, 3, 3, distortion=0.2),
    "tetrahedron": box(2.0, 1.0, 1.0, 3, 3, 3, "tetrahedron", distortion=0.2),
}
STEEL = Isotropic(210.0, 0.3)


@pytest.fixture(params=BODIES)
def body(request):
    return Body.from_grid(BODIES[request.param])


def outside(body):
    return np.unique(np.concatenate([body.nodes(name) for name in body.names]))


def test_stiffness_is_symmetric_and_blind_to_rigid_motion(body):
    K = Elasticity(body, STEEL).stiffness()
    assert K.blocksize == (body.dim, body.dim) and K.data.flags.writeable
    assert abs(K - K.T).max() < 1e-13 * abs(K.data).max()
    x = body.coordinates
    motions = [np.tile(axis, (len(x), 1)) for axis in np.eye(body.dim)]
    for a, b in [(0, 1)] if body.dim == 2 else [(0, 1), (0, 2), (1, 2)]:
        spin = np.zeros_like(x)
        spin[:, a], spin[:, b] = -x[:, b], x[:, a]
        motions.append(spin)
    for motion in motions:
        assert abs(K @ motion.ravel()).max() < 1e-12 * abs(K.data).max()


@pytest.mark.parametrize("mean_dilatation", [False, True])
def test_uniform_strain_leaves_inner_nodes_in_balance(body, mean_dilatation):
    if mean_dilatation and body.cell not in ("quadrilateral", "hexahedron"):
        pytest.skip("a mean dilatation is for quadrilaterals and hexahedra")
    elasticity = Elasticity(body, STEEL, mean_dilatation=mean_dilatation)
    u = body.coordinates @ np.random.default_rng(2).normal(size=(body.dim, body.dim))
    force = (elasticity.stiffness() @ u.ravel()).reshape(u.shape)
    largest = abs(force).max()
    force[outside(body)] = 0
    assert abs(force).max() < 1e-12 * largest


def test_work_of_uniform_strain_is_energy_density_times_volume(body):
    elasticity = Elasticity(body, STEEL)
    gradient = np.random.default_rng(3).normal(size=(body.dim, body.dim))
    u = body.coordinates @ gradient.T
    strain = (gradient + gradient.T) / 2
    stress = elasticity.stress(u)
    np.testing.assert_allclose(stress, np.broadcast_to(stress[0], stress.shape), atol=1e-11)
    density = np.sum(stress[0, : body.dim, : body.dim] * strain)
    assert u.ravel() @ (elasticity.stiffness() @ u.ravel()) == pytest.approx(2.0 * density)


def test_mass_and_loads_sum_to_what_they_distribute(body):
    elasticity = Elasticity(body, STEEL)
    dim = body.dim
    M = elasticity.mass(3.0)
    motion = np.tile(np.arange(1.0, dim + 1), (len(body.coordinates), 1))
    assert motion.ravel() @ (M @ motion.ravel()) == pytest.approx(6.0 * np.sum(np.arange(1.0, dim + 1) ** 2))
    vector = np.arange(1.0, dim + 1)
    np.testing.assert_allclose(elasticity.body_force(vector).sum(axis=0), 2.0 * vector)
    np.testing.assert_allclose(elasticity.total_force("top", vector).sum(axis=0), vector)
    np.testing.assert_allclose(elasticity.traction("top", vector).sum(axis=0), 2.0 * vector)
    inner = np.setdiff1d(np.arange(len(body.coordinates)), body.nodes("top"))
    assert not elasticity.traction("top", vector)[inner].any()
    weight = elasticity.boundary_mass("top")
    assert weight.sum() == pytest.approx(2.0)
    assert set(np.unique(weight.nonzero()[0])) == set(body.nodes("top"))


def test_moment_of_the_mass_is_exact_on_any_straight_sided_cells(body):
    M = Elasticity(body, STEEL).mass(1.0)
    x = body.coordinates[:, 0]
    field = np.zeros_like(body.coordinates)
    field[:, 0] = x
    assert field.ravel() @ (M @ field.ravel()) == pytest.approx(8 / 3, rel=1e-12)


def test_damping_is_rayleighs():
    elasticity = Elasticity(Body.from_grid(BODIES["triangle"]), STEEL)
    C = elasticity.damping(0.2, 0.01, 5.0)
    assert abs(C - (0.2 * elasticity.mass(5.0) + 0.01 * elasticity.stiffness())).max() < 1e-13


def test_galerkin_product_is_the_coarse_stiffness():
    for make in (
        lambda: rectangle(1.0, 1.0, 2, 2),
        lambda: rectangle(1.0, 1.0, 2, 2, "triangle"),
        lambda: box(1.0, 1.0, 1.0, 1, 2, 1),
        lambda: box(1.0, 1.0, 1.0, 1, 1, 1, "tetrahedron"),
    ):
        fine, coarse = Body.from_grid(make(), 1), Body.from_grid(make())
        P = fine.prolongations[0]
        copies = np.flatnonzero(np.diff(P.indptr) == 1)
        place = np.empty((P.shape[1], fine.dim))
        place[P.indices[P.indptr[copies]]] = fine.coordinates[copies]
        order = np.argsort(np.lexsort(coarse.coordinates.round(9).T))
        P = P[:, np.lexsort(place.round(9).T)[order]]
        P = sparse.kron(P, sparse.eye_array(fine.dim))
        product = P.T @ Elasticity(fine, STEEL).stiffness() @ P
        assert abs(product - Elasticity(coarse, STEEL).stiffness()).max() < 1e-12 * abs(product).max()


def test_materials_by_region_equal_one_material_where_they_agree():
    grid = rectangle(1.0, 1.0, 4, 4, regions={"a": lambda c: c[:, 0] < 0.5, "b": lambda c: c[:, 0] > 0.5})
    body = Body.from_grid(grid)
    one, two = Elasticity(body, STEEL), Elasticity(body, {"a": STEEL, "b": Anisotropic(STEEL.matrix("3d"))})
    assert abs(one.stiffness() - two.stiffness()).max() < 1e-10
    assert abs(one.mass(2.0) - two.mass({"a": 2.0, "b": 2.0})).max() < 1e-15
    assert two.mass({"b": 1.0, "a": 3.0}).sum() == pytest.approx(2 * 2.0)
    u = np.random.default_rng(0).normal(size=body.coordinates.shape)
    np.testing.assert_allclose(one.stress(u), two.stress(u), atol=1e-10)
    np.testing.assert_allclose(one.von_mises(u), two.von_mises(u))


def test_layers_in_series_stretch_by_their_own_moduli():
    layers = {"soft": lambda c: c[:, 1] < 0.5, "hard": lambda c: c[:, 1] > 0.5}
    body = Body.from_grid(rectangle(1.0, 1.0, 2, 4, regions=layers))
    elasticity = Elasticity(body, {"hard": Isotropic(1e8, 0.0), "soft": Isotropic(1.0, 0.0)})
    load = elasticity.total_force("top", (0.0, -0.1))
    system = Support(body).fix("bottom", y=0.0).fix("left", x=0.0).apply(elasticity.stiffness(), load)
    u = spsolve(system.A.tocsc(), system.load.ravel()).reshape(-1, 2)
    np.testing.assert_allclose(u[body.nodes("top"), 1], -0.05 * (1 + 1e-8), rtol=1e-6)
    np.testing.assert_allclose(elasticity.von_mises(u), 0.1, rtol=1e-6)


def test_von_mises_of_pure_shear_and_of_pressure():
    body = Body.from_grid(BODIES["hexahedron"])
    elasticity = Elasticity(body, STEEL)
    x = body.coordinates
    shear = np.zeros_like(x)
    shear[:, 0] = 1e-3 * x[:, 1]
    np.testing.assert_allclose(elasticity.von_mises(shear), np.sqrt(3) * 210 / 2.6 * 1e-3)
    np.testing.assert_allclose(elasticity.von_mises(1e-3 * x), 0, atol=1e-14)


def test_mean_dilatation_does_not_lock():
    def sag(nu, mean_dilatation):
        body = Body.from_grid(rectangle(10.0, 1.0, 40, 4))
        elasticity = Elasticity(body, Isotropic(1.0, nu), mean_dilatation=mean_dilatation)
        load = elasticity.total_force("right", (0.0, -1e-3))
        system = Support(body).fix("left", x=0.0, y=0.0).apply(elasticity.stiffness(), load)
        u = spsolve(system.A.tocsc(), system.load.ravel()).reshape(-1, 2)
        return u[body.nodes("right"), 1].mean()

    slender = -1e-3 * 10**3 / (3 / 0.75 / 12)  # beam of plane-strain modulus E/(1 - nu^2), nu = 1/2
    assert sag(0.49999, True) == pytest.approx(slender, rel=0.05)
    assert abs(sag(0.49999, False)) < 0.5 * abs(slender)


def test_total_force_is_a_uniform_traction():
    body = Body.from_grid(half_cylinder_nested(10.0, 1))
    elasticity = Elasticity(body, STEEL)
    given = elasticity.total_force("top", (3.0, -5.0))
    np.testing.assert_allclose(given, elasticity.traction("top", (3.0 / 20, -5.0 / 20)), atol=1e-14)


def test_wrong_input_is_refused():
    plane, space = Body.from_grid(BODIES["triangle"]), Body.from_grid(BODIES["tetrahedron"])
    elasticity = Elasticity(plane, STEEL)
    regions = Body.from_grid(rectangle(1, 1, 2, 2, regions={"a": lambda c: c[:, 0] < 0.5}))
    cases = {
        "does not fit a body in 3": lambda: Elasticity(space, STEEL, "plane strain"),
        "does not fit a body in 2": lambda: Elasticity(plane, STEEL, "3d"),
        "'bend'": lambda: Elasticity(plane, STEEL, "bend"),
        "not triangles": lambda: Elasticity(plane, STEEL, mean_dilatation=True),
        "no region 'b'": lambda: Elasticity(regions, {"b": STEEL}),
        "2 cells have no material": lambda: Elasticity(regions, {"a": STEEL}),
        "density is 0": lambda: elasticity.mass(0.0),
        "density is nan": lambda: elasticity.mass(np.nan),
        "alpha is -1": lambda: elasticity.damping(-1.0, 0.0, 1.0),
        "beta is inf": lambda: elasticity.damping(0.0, np.inf, 1.0),
        "no boundary 'roof'": lambda: elasticity.traction("roof", (0, 1)),
        "the total force, is .*2 finite": lambda: elasticity.total_force("top", (0, 1, 2)),
        "the body force, is .*finite": lambda: elasticity.body_force((0, np.nan)),
        "There are densities": lambda: elasticity.mass({"a": 1.0}),
    }
    for words, call in cases.items():
        with pytest.raises(ValueError, match=words):
            call()
