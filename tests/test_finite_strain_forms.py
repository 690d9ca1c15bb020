"""Forms of finite strain: tangents, rotation, patch test, energies, step stress, order, another library."""

import numpy as np
import pytest
import ufl
from scipy.sparse.linalg import spsolve
from tangents import tangent_errors

from forms import (
    Cords,
    Elasticity,
    Hyperelasticity,
    Isotropic,
    MooneyRivlin,
    NeoHookean,
    StrainEnergy,
    StVenantKirchhoff,
)
from forms.hyperelasticity import Inverted
from forms.strain_energies import strain_energy
from geometry import Body, box, half_cylinder, rectangle, ring

RUBBER = NeoHookean(E=1000.0, nu=0.3)
ENERGIES = {
    "neo-Hookean": RUBBER,
    "Mooney-Rivlin": MooneyRivlin(c1=150.0, c2=40.0, lame=700.0),
    "St. Venant-Kirchhoff": StVenantKirchhoff(E=1000.0, nu=0.3),
    "cords": Cords(RUBBER, 3000.0, [(1.0, 0.3), (1.0, -0.3)]),
}
DILATATION = [(name, mean) for name in ENERGIES for mean in (False, True)]


def random_states(body, size=0.01, seed=1):
    random = np.random.default_rng(seed)
    u0 = random.uniform(-size, size, body.coordinates.shape)
    return u0, u0 + random.uniform(-size, size, u0.shape), random.uniform(-1, 1, u0.shape)


@pytest.fixture(scope="module")
def block():
    return Body.from_grid(rectangle(1.0, 0.5, 6, 4))


def minimised(elastic, u, free, load=0.0):
    """Newton's method without contact, for tests only."""
    for _ in range(30):
        r = np.where(free, load - elastic.internal_force(u), 0.0).ravel()
        keep, K = np.flatnonzero(free.ravel()), elastic.tangent(u).tocsc()
        rounding = 1e-15 * np.linalg.norm(K.diagonal())
        if np.linalg.norm(r) < 1e-12 * np.linalg.norm(elastic.internal_force(u)) + rounding:
            return u
        K = K[keep][:, keep]
        u = u.copy()
        u.reshape(-1)[keep] += spsolve(K, r[keep])
    raise AssertionError("Newton's method does not converge")


@pytest.mark.parametrize("name, mean", DILATATION)
def test_forces_and_tangents_are_derivatives(block, name, mean):
    elastic = Hyperelasticity(block, ENERGIES[name], mean_dilatation=mean)
    u0, u1, d = random_states(block)
    h = 1e-6
    power = (elastic.strain_energy(u1 + h * d) - elastic.strain_energy(u1 - h * d)) / (2 * h)
    assert np.vdot(elastic.internal_force(u1), d) == pytest.approx(power, rel=1e-7)
    assert max(tangent_errors(elastic, u0, u1, d)) < 1e-7


@pytest.mark.parametrize("name, mean", DILATATION)
def test_step_stress_does_the_work_and_has_no_moment(block, name, mean):
    elastic = Hyperelasticity(block, ENERGIES[name], mean_dilatation=mean)
    u0, u1, _ = random_states(block, 0.02)
    f = elastic.step_force(u0, u1)
    gained = elastic.strain_energy(u1) - elastic.strain_energy(u0)
    assert np.vdot(f, u1 - u0) == pytest.approx(gained, rel=1e-8)  # SMOOTH over dC : dC
    middle = block.coordinates + 0.5 * (u0 + u1)
    moment = middle[:, 0] @ f[:, 1] - middle[:, 1] @ f[:, 0]
    assert abs(moment) < 1e-14 * np.abs(f).sum() and np.abs(f.sum(axis=0)).max() < 1e-14 * np.abs(f).sum()


@pytest.mark.parametrize("dim", [2, 3])
def test_any_rotation_strains_nothing(dim):
    body = Body.from_grid(ring(0.5, 0.2, 24, 3)) if dim == 2 else Body.from_grid(box(1.0, 0.7, 0.5, 2, 2, 2))
    elastic = Hyperelasticity(body, RUBBER)
    random, X = np.random.default_rng(2), body.coordinates
    for _ in range(4):
        turn = np.linalg.qr(random.normal(size=(dim, dim)))[0]
        turn *= np.sign(np.linalg.det(turn))
        u = X @ turn.T - X + random.uniform(-10, 10, dim)
        assert np.abs(elastic.internal_force(u)).max() < 1e-11 and abs(elastic.strain_energy(u)) < 1e-11
        # and a turned strain is that strain: forces turn along
        bent = random.uniform(-0.02, 0.02, X.shape)
        f, g = elastic.internal_force(bent), elastic.internal_force((X + bent) @ turn.T - X)
        assert np.abs(g - f @ turn.T).max() < 1e-11 * np.abs(f).max()


@pytest.mark.parametrize("mean", [False, True])
def test_patch(mean):
    body = Body.from_grid(half_cylinder(radius=1.0), 0)
    elastic = Hyperelasticity(body, RUBBER, mean_dilatation=mean)
    X = body.coordinates
    edge = np.unique(np.concatenate([body.nodes(name) for name in body.facets]))
    free = np.ones(X.shape, dtype=bool)
    free[edge] = False
    stretch = np.array([[1.2, 0.3], [-0.1, 0.8]])
    exact = X @ stretch.T - X
    found = minimised(elastic, np.where(free, 0.9 * exact, exact), free)
    assert np.abs(found - exact).max() < 1e-12


def test_order_on_a_manufactured_solution():
    """u = a (sin(pi X) Y, X^2 Y): the body force follows from the energy by UFL; L2 error falls as h^2."""
    from dolfinx import fem

    errors = []
    for cells in (4, 8, 16):
        body = Body.from_grid(rectangle(1.0, 1.0, cells, cells))
        elastic = Hyperelasticity(body, RUBBER)
        x = ufl.SpatialCoordinate(body.mesh)
        exact = ufl.as_vector([0.15 * ufl.sin(np.pi * x[0]) * x[1], 0.2 * x[0] ** 2 * x[1]])
        F = ufl.variable(ufl.Identity(2) + ufl.grad(exact))
        C = ufl.as_matrix(
            [[(F.T * F)[0, 0], (F.T * F)[0, 1], 0], [(F.T * F)[1, 0], (F.T * F)[1, 1], 0], [0, 0, 1]]
        )
        P = ufl.diff(RUBBER(C), F)
        v = ufl.TestFunction(elastic.V)
        form = ufl.inner(P, ufl.grad(v)) * ufl.dx(metadata={"quadrature_degree": 8})
        load = fem.assemble_vector(fem.form(form)).array.reshape(-1, 2)
        X = body.coordinates
        nodal = np.stack([0.15 * np.sin(np.pi * X[:, 0]) * X[:, 1], 0.2 * X[:, 0] ** 2 * X[:, 1]], axis=1)
        free = np.ones(X.shape, dtype=bool)
        free[np.unique(np.concatenate([body.nodes(name) for name in body.facets]))] = False
        u = fem.Function(elastic.V)
        u.x.array[:] = minimised(elastic, np.where(free, 0.5 * nodal, nodal), free, load).ravel()
        square = ufl.inner(u - exact, u - exact) * ufl.dx(metadata={"quadrature_degree": 8})
        errors.append(np.sqrt(fem.assemble_scalar(fem.form(square))))
    assert np.log2(np.array(errors[:-1]) / errors[1:]) == pytest.approx(2.0, abs=0.1)


def test_small_strain_is_hooke(block):
    linear = Elasticity(block, Isotropic(E=1000.0, nu=0.3))
    scale = np.abs(linear.stiffness().data).max()
    for energy in (RUBBER, StVenantKirchhoff(1000.0, 0.3)):
        elastic = Hyperelasticity(block, energy)
        assert np.abs((elastic.stiffness() - linear.stiffness()).data).max() < 1e-13 * scale
        u = 1e-7 * random_states(block)[0]
        assert np.abs(elastic.stress(u) - linear.stress(u)).max() < 1e-7 * np.abs(linear.stress(u)).max()
    # Mooney and Rivlin's moduli at rest as documented
    c1, c2, lame = 150.0, 40.0, 700.0
    mu, lam = 2 * (c1 + c2), lame + 4 * c2
    hooke = Isotropic(E=mu * (3 * lam + 2 * mu) / (lam + mu), nu=lam / (2 * (lam + mu)))
    rivlin = Hyperelasticity(block, MooneyRivlin(c1, c2, lame)).stiffness()
    assert np.abs((rivlin - Elasticity(block, hooke).stiffness()).data).max() < 1e-12 * scale


def test_mean_dilatation_does_not_lock():
    """A nearly incompressible beam bent by its own end load bends by (1 - nu) / (2 shear modulus), as any."""
    tips = {}
    for nu in (0.3, 0.4999):
        for mean in (False, True):
            body = Body.from_grid(rectangle(8.0, 1.0, 32, 4))
            shear = 100.0
            elastic = Hyperelasticity(body, NeoHookean(2 * shear * (1 + nu), nu), mean_dilatation=mean)
            free = np.ones(body.coordinates.shape, dtype=bool)
            free[body.nodes("left")] = False
            load = elastic.total_force("right", (0.0, 0.1))
            u = minimised(elastic, np.zeros(free.shape), free, load)
            tips[nu, mean] = u[body.nearest_node((8.0, 1.0)), 1]
    assert tips[0.4999, False] < 0.5 * tips[0.3, False]  # locks
    assert tips[0.4999, True] == pytest.approx(tips[0.3, True] * 0.5 / 0.7, rel=0.02)


def test_two_materials_by_region():
    """A soft half under a hard one: strains are as their moduli, at small strain."""
    halves = {"soft": lambda x: x[:, 1] < 0.5, "hard": lambda x: x[:, 1] > 0.5}
    body = Body.from_grid(rectangle(1.0, 1.0, 2, 4, regions=halves))
    energies = {"soft": NeoHookean(100.0, 0.0), "hard": MooneyRivlin(75.0, 0.0, 1e-9)}
    elastic = Hyperelasticity(body, energies)
    free = np.ones(body.coordinates.shape, dtype=bool)
    free[body.nodes("bottom")] = False
    free[:, 0] = False
    u = minimised(elastic, np.zeros(free.shape), free, elastic.total_force("top", (0.0, -1e-4)))
    half, top = (u[body.nearest_node((0.0, y)), 1] for y in (0.5, 1.0))
    assert half / (top - half) == pytest.approx(3.0, rel=1e-5)
    assert len(elastic.stress(u)) == 8


def test_felupe_compresses_a_block_alike():
    """A bonded block pressed by a fifth, without contact, against felupe's own elements and material."""
    felupe = pytest.importorskip("felupe")
    mesh = felupe.Rectangle(b=(1.0, 0.5), n=(7, 5))
    field = felupe.FieldContainer([felupe.FieldPlaneStrain(felupe.RegionQuad(mesh), dim=2)])
    solid = felupe.SolidBody(felupe.NeoHookeCompressible(*RUBBER.parameters.values()), field)
    bounds = {
        "bottom": felupe.Boundary(field[0], fy=0.0),
        "side": felupe.Boundary(field[0], fy=0.5, skip=(0, 1)),
        "top": felupe.Boundary(field[0], fy=0.5, skip=(1, 0), value=-0.1),
    }
    dof0, dof1 = felupe.dof.partition(field, bounds)
    ext0 = felupe.dof.apply(field, bounds, dof0)
    felupe.newtonraphson(items=[solid], dof0=dof0, dof1=dof1, ext0=ext0, verbose=False, tol=1e-13)
    theirs = field[0].values
    body = Body.from_grid(rectangle(1.0, 0.5, 6, 4))
    X = body.coordinates
    free = np.ones(X.shape, dtype=bool)
    free[body.nodes("bottom")] = free[body.nodes("top")] = False
    u = np.where(free, 0.0, np.stack([0.0 * X[:, 1], -0.2 * X[:, 1]], axis=1))
    u = minimised(Hyperelasticity(body, RUBBER), u, free)
    order = [int(np.argmin(np.sum((X - point) ** 2, axis=1))) for point in mesh.points]
    assert np.abs(u[order] - theirs).max() < 1e-8 * np.abs(theirs).max()


def test_own_energies():
    mu, lame = RUBBER.parameters["mu"], RUBBER.parameters["lame"]
    body = Body.from_grid(rectangle(1.0, 0.5, 2, 2))
    u, _, _ = random_states(body, 0.05)
    wanted = Hyperelasticity(body, RUBBER).internal_force(u)

    def by_strain(C):
        return mu / 2 * (ufl.tr(C) - 3) - mu / 2 * ufl.ln(ufl.det(C)) + lame / 8 * ufl.ln(ufl.det(C)) ** 2

    def by_stretch(F):
        J = ufl.det(F)
        return mu / 2 * (ufl.inner(F, F) - 3) - mu * ufl.ln(J) + lame / 2 * ufl.ln(J) ** 2

    for psi in (by_strain, by_stretch):
        assert (
            np.abs(Hyperelasticity(body, psi).internal_force(u) - wanted).max() < 1e-12 * np.abs(wanted).max()
        )
    with pytest.raises(ValueError, match="when the body only turns"):
        strain_energy(lambda F: ufl.inner(F - ufl.Identity(3), F - ufl.Identity(3)))
    with pytest.raises(ValueError, match="modulus of -"):
        strain_energy(lambda C: -ufl.inner(C - ufl.Identity(3), C - ufl.Identity(3)))
    with pytest.raises(ValueError, match="leaves a stress"):
        strain_energy(lambda C: ufl.tr(C * C))
    with pytest.raises(ValueError, match="3 x 3 matrix, in the plane too"):
        strain_energy(lambda C: ufl.inner(C - ufl.Identity(2), C - ufl.Identity(2)))
    with pytest.raises(ValueError, match="not float"):
        strain_energy(3.0)

    class Blatz(StrainEnergy):  # a class of the user's own is looked at as a function is
        def density(self, C, p):
            return p["mu"] / 2 * (ufl.tr(ufl.inv(C)) - 3 + 2 * (ufl.sqrt(ufl.det(C)) - 1))

    assert np.abs(Hyperelasticity(body, Blatz(mu=1.0)).internal_force(u)).max() > 0.0
    with pytest.raises(ValueError, match="modulus of -"):
        Hyperelasticity(body, Blatz(mu=-1.0))
    with pytest.raises(ValueError, match="modulus of -"):
        Cords(Blatz(mu=-1.0), 1.0, [(1, 0)])


@pytest.mark.parametrize(
    "make, sentence",
    [
        (lambda: NeoHookean(-1.0, 0.3), "E is -1"),
        (lambda: NeoHookean(1.0, 0.5), "Poisson's ratio nu is 0.5"),
        (lambda: StVenantKirchhoff(0.0, 0.3), "E is 0"),
        (lambda: MooneyRivlin(-1.0, 2.0, 3.0), "c1 is -1"),
        (lambda: Cords(RUBBER, -1.0, [(1, 0)]), "stiffness is -1"),
        (lambda: Cords(RUBBER, 1.0, [(0, 0)]), "no direction"),
    ],
)
def test_bad_moduli(make, sentence):
    with pytest.raises(ValueError, match=sentence):
        make()


def test_inverted_cells_are_told_with_the_remedy(block):
    X = block.coordinates
    flat = -1.5 * X * np.array([0.0, 1.0])
    elastic = Hyperelasticity(block, StVenantKirchhoff(1000.0, 0.3))
    assert elastic.volume_ratio(flat) == pytest.approx(-0.5)
    with pytest.raises(Inverted, match="NeoHookean, with the same E and nu"):
        elastic.check_volume(flat, "The start")
    with pytest.raises(Inverted, match="in steps"):
        Hyperelasticity(block, RUBBER).check_volume(flat, "The start")
    elastic.check_volume(0.5 * flat, "The start")
