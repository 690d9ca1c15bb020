"""The user's own mesh, tags, space, forms and boundary conditions through `forms.assemble`."""

import subprocess
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest

import forms
from forms import Elasticity, Isotropic, Support
from geometry import Body, Plane, SmoothRoad, rectangle
from model import (
    BeyondLinear,
    BodyOnRoad,
    CentralDifferences,
    ContactProblem,
    MassRedistribution,
    MovingBody,
    Newmark,
    follow,
    solve,
)
from model.dynamics.schemes import IMPLICIT
from model.results.xdmf import Series

import basix.ufl  # isort: skip
import ufl  # isort: skip
from dolfinx import fem, mesh  # isort: skip
from dolfinx import io as dolfinx_io  # isort: skip
from mpi4py import MPI  # isort: skip

E, NU = 1000.0, 0.3
MU, LAMBDA = E / (2 * (1 + NU)), E * NU / ((1 + NU) * (1 - 2 * NU))
BOTTOM, LEFT, TOP = 2, 3, 5


def strain(u):
    return ufl.sym(ufl.grad(u))


def stress(u):
    return 2 * MU * strain(u) + LAMBDA * ufl.tr(strain(u)) * ufl.Identity(len(u))


def elastic(V):
    """a(u, v), trial and test function."""
    u, v = ufl.TrialFunction(V), ufl.TestFunction(V)
    return ufl.inner(stress(u), strain(v)) * ufl.dx, u, v


def rectangle_mesh(cell="quadrilateral", columns=8, rows=4):
    """A mesh of create_rectangle, 2 x 1, with tags on bottom, left and top, as a user makes them."""
    kind = mesh.CellType.quadrilateral if cell == "quadrilateral" else mesh.CellType.triangle
    domain = mesh.create_rectangle(MPI.COMM_WORLD, [(0.0, 0.0), (2.0, 1.0)], [columns, rows], kind)
    places = {
        BOTTOM: lambda x: np.isclose(x[1], 0.0),
        LEFT: lambda x: np.isclose(x[0], 0.0),
        TOP: lambda x: np.isclose(x[1], 1.0),
    }
    found = {tag: mesh.locate_entities_boundary(domain, 1, where) for tag, where in places.items()}
    facets = np.concatenate(list(found.values()))
    values = np.repeat(list(found), [len(f) for f in found.values()]).astype(np.int32)
    order = np.argsort(facets)
    return domain, mesh.meshtags(domain, 1, facets[order], values[order])


def gmsh_mesh():
    """A rectangle 2 x 1 of gmsh's triangles with a finer corner, by dolfinx.io.gmsh."""
    gmsh = pytest.importorskip("gmsh")
    gmsh.initialize(interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.model.add("rectangle")
    gmsh.model.occ.addRectangle(0.0, 0.0, 0.0, 2.0, 1.0)
    gmsh.model.occ.synchronize()
    tag_of = {(1.0, 0.0): BOTTOM, (0.0, 0.5): LEFT, (1.0, 1.0): TOP, (2.0, 0.5): 9}
    for _, line in gmsh.model.getEntities(1):
        x, y, _ = gmsh.model.occ.getCenterOfMass(1, line)
        gmsh.model.addPhysicalGroup(1, [line], tag_of[round(x, 9), round(y, 9)])
    gmsh.model.addPhysicalGroup(2, [1], 1)
    gmsh.option.setNumber("Mesh.MeshSizeMax", 0.3)
    gmsh.model.mesh.setSize(gmsh.model.getEntities(0)[:1], 0.1)
    gmsh.model.mesh.generate(2)
    try:
        reader = getattr(dolfinx_io, "gmshio", None) or dolfinx_io.gmsh
        data = reader.model_to_mesh(gmsh.model, MPI.COMM_WORLD, 0, gdim=2)
    finally:
        gmsh.finalize()
    facet_tags = data.facet_tags if hasattr(data, "facet_tags") else data[2]
    return (data.mesh if hasattr(data, "mesh") else data[0]), facet_tags


MESHES = {"create_rectangle": rectangle_mesh, "gmsh": gmsh_mesh}


class Twin:
    """One scene twice: through the user's names, and through Body, Elasticity and Support."""

    def __init__(self, made):
        self.domain, self.tags = MESHES[made]()
        self.V = fem.functionspace(self.domain, ("Lagrange", 1, (2,)))
        self.a, self.u, self.v = elastic(self.V)
        self.weight = fem.Constant(self.domain, (0.4, -2.0))
        self.L = ufl.inner(self.weight, self.v) * ufl.dx
        self.lowered = fem.Constant(self.domain, -0.01)
        top = fem.locate_dofs_topological(self.V.sub(1), 1, self.tags.find(TOP))
        left = fem.locate_dofs_topological(self.V.sub(0), 1, self.tags.find(LEFT))
        self.bcs = [
            fem.dirichletbc(self.lowered, top, self.V.sub(1)),
            fem.dirichletbc(0.0, left, self.V.sub(0)),
        ]
        node_of_vertex = mesh.entities_to_geometry(
            self.domain, 1, np.arange(self.domain.topology.index_map(1).size_local, dtype=np.int32)
        )
        facets = {
            name: node_of_vertex[self.tags.find(tag)]
            for name, tag in {"bottom": BOTTOM, "left": LEFT, "top": TOP}.items()
        }
        self.body = Body(self.domain, facets)
        self.elasticity = Elasticity(self.body, Isotropic(E, NU))
        self.here = {tuple(np.round(x, 9)): k for k, x in enumerate(self.body.coordinates)}

    def support(self, y=-0.01):
        return Support(self.body).fix("top", y=y).fix("left", x=0.0)

    def in_space(self, contact, solution):
        """Displacement of the ready-made scene in the order of the user's space."""
        points = self.V.tabulate_dof_coordinates()[:, :2]
        order = [self.here[tuple(np.round(x, 9))] for x in points]
        return contact.displacement(solution)[order]

    def agree(self, contact, solution, reference, expected):
        """Displacement, contact forces by place, pressure."""
        scale = np.abs(expected.displacement).max()
        ours = contact.displacement(solution)
        np.testing.assert_allclose(ours, self.in_space(reference, expected), rtol=0, atol=1e-12 * scale)
        for values in ("contact_force", "status", "gap"):
            sides = []
            for scene, answer in ((contact, solution), (reference, expected)):
                sides.append(getattr(answer, values)[np.argsort(scene.points[:, 0])])
            size = np.abs(sides[1]).max() or 1.0
            np.testing.assert_allclose(sides[0], sides[1], rtol=0, atol=1e-12 * max(size, 1e-9))


@pytest.fixture(scope="module", params=list(MESHES))
def made(request):
    return Twin(request.param)


@pytest.fixture
def twin(made):
    made.weight.value[:], made.lowered.value = (0.4, -2.0), -0.01  # others may have moved on in time
    return made


@pytest.mark.parametrize("compile_first", [False, True], ids=["UFL", "compiled"])
@pytest.mark.parametrize("friction", [None, 0.3])
def test_statics_agree_with_the_ready_made_forms(twin, friction, compile_first, tmp_path):
    a, L = (fem.form(twin.a), fem.form(twin.L)) if compile_first else (twin.a, twin.L)
    system = forms.assemble(a, L, bcs=twin.bcs, stress=stress)
    contact = BodyOnRoad(system, facets=twin.tags.find(BOTTOM), road=Plane(), friction=friction)
    solution = solve(contact, tolerance=1e-14, correction="direct")
    load = twin.elasticity.body_force((0.4, -2.0))
    reference = BodyOnRoad(twin.elasticity.system(load, twin.support()), "bottom", Plane(), friction=friction)
    expected = solve(reference, tolerance=1e-14, correction="direct")
    assert solution.pressure_force.sum() > 10.0
    twin.agree(contact, solution, reference, expected)

    uh = contact.function(solution)
    assert uh.function_space.dofmap.index_map_bs == 2
    norm = fem.assemble_scalar(fem.form(ufl.inner(uh, uh) * ufl.dx))
    assert norm > 0 and (compile_first or uh.function_space is twin.V)
    contact.write(tmp_path / "pressed.xdmf", solution)
    fields, cells = contact.fields(solution)
    pressure = fields["contact_pressure"]
    assert set(fields) == {"displacement", "contact_pressure", "contact_traction", "gap", "status"}
    at = twin.elasticity.stress(reference.displacement(expected))[:, :2, :2]
    np.testing.assert_allclose(cells["stress"], at, rtol=0, atol=1e-11 * np.abs(at).max())
    shape = fem.form(ufl.inner(fem.Constant(twin.domain, (0.0, 1.0)), twin.v) * ufl.ds)
    area = fem.assemble_vector(shape).array[1::2]
    inside = contact.nodes[np.abs(contact.points[:, 0] - 1.0) < 0.9]
    np.testing.assert_allclose(
        (pressure * area)[inside], solution.pressure_force[np.isin(contact.nodes, inside)], rtol=1e-12
    )


def test_a_load_path_and_prescribed_displacements_follow_the_users_constants(twin):
    steps = [0.25, 0.5, 1.0]
    system = forms.assemble(twin.a, twin.L, bcs=twin.bcs, update=lambda t: _set(twin, t))
    contact = BodyOnRoad(system, facets=twin.tags.find(BOTTOM), road=Plane(), friction=0.3)
    path = list(follow(contact, steps, "direct", tolerance=1e-14))

    load = twin.elasticity.body_force((1.0, -2.0))
    support = twin.support(y=lambda t: -0.02 * t)
    reference = BodyOnRoad(
        twin.elasticity.system(lambda t: t * load, support), "bottom", Plane(), friction=0.3
    )
    expected = list(follow(reference, steps, "direct", tolerance=1e-14))
    for solution, known in zip(path, expected):
        twin.agree(contact, solution, reference, known)
    assert {1, 2} & set(np.concatenate([s.status for s in path]))

    # and the same by hand, one constant after the other
    by_hand = follow(contact, (_set(twin, t) for t in steps), "direct", tolerance=1e-14)
    for solution, known in zip(by_hand, path):
        np.testing.assert_array_equal(solution.displacement, known.displacement)


def _set(twin, t):
    twin.weight.value[:] = (t, -2.0 * t)
    twin.lowered.value = -0.02 * t


def test_solve_reads_constants_anew(twin):
    system = forms.assemble(twin.a, twin.L, bcs=twin.bcs)
    contact = BodyOnRoad(system, twin.tags.find(BOTTOM), Plane())
    answers = []
    for t in (0.5, 1.0):
        _set(twin, t)
        answers.append(solve(contact, "direct", 1e-13))
    # u is in proportion to the load as long as contact nodes are the same (all of them, on this plane)
    assert (answers[0].status == answers[1].status).all()
    np.testing.assert_allclose(
        2 * answers[0].displacement, answers[1].displacement, atol=1e-12 * 0.02, rtol=0
    )
    _set(twin, 0.5)


def test_robin_terms_and_regions_are_the_users_affair():
    domain, tags = rectangle_mesh()
    V = fem.functionspace(domain, ("Lagrange", 1, (2,)))
    a, u, v = elastic(V)
    ds = ufl.Measure("ds", domain, subdomain_data=tags)
    k = fem.Constant(domain, 50.0)  # a bed of springs above: nothing else holds the block
    L = ufl.inner(fem.Constant(domain, (0.0, -3.0)), v) * ds(TOP)
    system = forms.assemble(a + k * ufl.inner(u, v) * ds(TOP), L)
    contact = BodyOnRoad(system, tags.find(BOTTOM), Plane((0.0, -0.01)))
    solution = solve(contact, tolerance=1e-12)
    uh = contact.function(solution)
    springs = fem.assemble_scalar(fem.form(k * uh[1] * ds(TOP)))
    assert solution.pressure_force.sum() - springs == pytest.approx(6.0, rel=1e-10)
    assert solution.gap.min() == 0.0


def test_a_cube_in_space_and_a_curved_road():
    domain = mesh.create_box(MPI.COMM_SELF, [(0.0,) * 3, (1.0,) * 3], [3, 3, 3], mesh.CellType.hexahedron)
    V = fem.functionspace(domain, ("Lagrange", 1, (3,)))
    a, _, v = elastic(V)
    L = ufl.inner(fem.Constant(domain, (0.0, 0.0, -1.0)), v) * ufl.dx
    top = fem.locate_dofs_geometrical(V, lambda x: np.isclose(x[2], 1.0))
    bottom = mesh.locate_entities_boundary(domain, 2, lambda x: np.isclose(x[2], 0.0))
    down = fem.Constant(domain, (0.0, 0.0, -0.03))
    system = forms.assemble(a, L, bcs=[fem.dirichletbc(down, top, V)])
    flat = solve(BodyOnRoad(system, bottom, Plane((0.0,) * 3, (0.0, 0.0, 1.0))))
    assert flat.gap.max() == 0.0 and flat.contact_force[:, 2].sum() > 10.0


def test_one_solve_finds_a_road_that_is_not_below_the_body_at_first():
    bump = SmoothRoad(lambda x: 0.1 * np.exp(-((x - 2.5) ** 2) / 0.1), np.linspace(-2.0, 5.0, 141))
    body = Body.from_grid(rectangle(2.0, 0.5, 24, 6, corner=(-1.0, 0.001)))
    elasticity = Elasticity(body, Isotropic(100.0, 0.3))
    system = elasticity.system(np.zeros_like(body.coordinates), Support(body).fix("top", x=1.5, y=0.0))
    contact = BodyOnRoad(system, "bottom", bump)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        solution = solve(contact)
    at = contact.points + contact.displacement(solution)[contact.nodes]
    assert bump.closest(at)[0].min() > -1e-9
    assert solution.contact_force[:, 1].sum() > 0.5


REFUSED = {
    "degree 2": ("degree 2; .* needs degree 1", lambda m: ("Lagrange", 2, (2,))),
    "discontinuous": ("a discontinuous one", lambda m: ("DG", 1, (2,))),
    "scalar": (r"the shape \(\)", lambda m: ("Lagrange", 1)),
    "three components": (r"the shape \(3,\)", lambda m: ("Lagrange", 1, (3,))),
    "another kind": ("of the kind", lambda m: ("N1curl", 1)),
}


@pytest.mark.parametrize("case", REFUSED)
def test_spaces_that_cannot_be_used_are_refused_with_what_would_do(case):
    words, kind = REFUSED[case]
    domain, _ = rectangle_mesh(cell="triangle")
    V = fem.functionspace(domain, kind(domain))
    u, v = ufl.TrialFunction(V), ufl.TestFunction(V)
    with pytest.raises(ValueError, match=words):
        forms.assemble(ufl.inner(ufl.grad(u), ufl.grad(v)) * ufl.dx)


def test_mixed_spaces_surfaces_and_curved_cells_are_refused():
    domain, _ = rectangle_mesh(cell="triangle")
    element = basix.ufl.mixed_element(
        [basix.ufl.element("P", "triangle", 1, shape=(2,)), basix.ufl.element("P", "triangle", 1)]
    )
    W = fem.functionspace(domain, element)
    u, v = ufl.TrialFunction(W), ufl.TestFunction(W)
    with pytest.raises(ValueError, match="mixed"):
        forms.assemble(ufl.inner(u, v) * ufl.dx)
    points = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 1.0]])
    surface = basix.ufl.element("Lagrange", "triangle", 1, shape=(3,))
    shell = mesh.create_mesh(MPI.COMM_SELF, cells=np.array([[0, 1, 2]]), x=points, e=ufl.Mesh(surface))
    V = fem.functionspace(shell, ("Lagrange", 1, (3,)))
    with pytest.raises(ValueError, match="cells of 2 dimensions in a space of 3"):
        forms.assemble(ufl.inner(ufl.TrialFunction(V), ufl.TestFunction(V)) * ufl.dx)


def test_forms_that_cannot_be_used_are_refused_in_one_sentence():
    domain, tags = rectangle_mesh()
    V = fem.functionspace(domain, ("Lagrange", 1, (2,)))
    W = fem.functionspace(domain, ("Lagrange", 1, (2,)))
    a, u, v = elastic(V)
    turning = ufl.as_matrix([[0.0, 1.0], [0.0, 0.0]])
    on_other = ufl.inner(fem.Constant(domain, (0.0, 1.0)), ufl.TestFunction(W)) * ufl.dx
    elsewhere = fem.dirichletbc(np.zeros(2), np.array([0], dtype=np.int32), W)
    complex_load = ufl.inner(fem.Constant(domain, np.array([0.0, 1.0], dtype=np.complex128)), v) * ufl.dx
    cases = {
        "a.u, v. is not symmetric": lambda: forms.assemble(a + ufl.inner(turning * u, v) * ufl.dx),
        "a.u, v. is a linear form": lambda: forms.assemble(on_other),
        "L.v. is a bilinear form": lambda: forms.assemble(a, a),
        "mass m.u, v. is a linear form": lambda: forms.assemble(a, mass=on_other),
        "L.v. has test or trial functions of another space": lambda: forms.assemble(a, on_other),
        "boundary condition is on another space": lambda: forms.assemble(a, bcs=[elsewhere]),
        "type complex128": lambda: forms.assemble(a, complex_load),
        "negative diagonal": lambda: forms.assemble(-a),
        "no stiffness": lambda: forms.assemble(ufl.inner(u, v) * ufl.ds),
        "the shape .3, 2.": lambda: forms.assemble(a, np.zeros((3, 2))),
        "not on the boundary": lambda: BodyOnRoad(
            forms.assemble(a), np.arange(5, 40, dtype=np.int32), Plane()
        ),
        "No facets": lambda: BodyOnRoad(forms.assemble(a), tags.find(77), Plane()),
        "no names": lambda: BodyOnRoad(forms.assemble(a), "bottom", Plane()),
    }
    for words, call in cases.items():
        with pytest.raises(ValueError, match=words):
            call()
    with pytest.raises(TypeError, match="is a str"):
        forms.assemble("a")
    with pytest.raises(TypeError, match="bcs holds a float"):
        forms.assemble(a, bcs=[0.0])


def pressed_rectangle():
    """A rectangle that is lowered onto a plane: space, form, boundary condition, facets, system."""
    domain, tags = rectangle_mesh()
    V = fem.functionspace(domain, ("Lagrange", 1, (2,)))
    top = fem.dirichletbc(np.array([0.0, -0.01]), fem.locate_dofs_topological(V, 1, tags.find(TOP)), V)
    a, u, v = elastic(V)
    return V, a, u, v, top, tags


def test_what_is_no_argument_of_the_door_is_named():
    V, a, u, v, top, tags = pressed_rectangle()
    bottom, system = tags.find(BOTTOM), forms.assemble(a, None, [top])
    contact = BodyOnRoad(system, bottom, Plane())
    W = ufl.MixedFunctionSpace(V, fem.functionspace(V.mesh, ("P", 1)))
    mixed = [ufl.inner(x, y) * ufl.dx for x, y in zip(ufl.TrialFunctions(W), ufl.TestFunctions(W))]
    single = mesh.create_unit_square(MPI.COMM_SELF, 2, 2, dtype=np.float32)
    X = fem.functionspace(single, ("Lagrange", 1, (2,)))
    in_single = ufl.inner(ufl.TrialFunction(X), ufl.TestFunction(X)) * ufl.dx
    beyond = fem.dirichletbc(np.zeros(2), np.array([10**4], dtype=np.int32), V)
    weight = fem.form(ufl.inner(fem.Constant(V.mesh, (0.0, 1.0)), v) * ufl.dx)
    none = fem.Constant(V.mesh, 0.0)
    other = BodyOnRoad(system, tags.find(LEFT)[1:], Plane())
    cases = {
        "Facets are a MeshTags; .*tags.find": lambda: BodyOnRoad(system, tags, Plane()),
        "Facets are a int": lambda: BodyOnRoad(system, BOTTOM, Plane()),
        "Facets are a NoneType": lambda: BodyOnRoad(system, None, Plane()),
        "each must be one number": lambda: BodyOnRoad(system, bottom[:, None], Plane()),
        "of the type bool": lambda: BodyOnRoad(system, np.ones(20, dtype=bool), Plane()),
        "is the class Plane": lambda: BodyOnRoad(system, bottom, Plane),
        "bcs is a DirichletBC": lambda: forms.assemble(a, None, top),
        "the unknown 20001, of 90": lambda: forms.assemble(a, None, [beyond]),
        "on a mixed space": lambda: forms.assemble(sum(mixed)),
        "in single precision": lambda: forms.assemble(in_single),
        "The load is a Function": lambda: forms.assemble(a, fem.Function(V)),
        "The load is a Vector": lambda: forms.assemble(a, fem.assemble_vector(weight)),
        "update is a float": lambda: forms.assemble(a, update=1.0),
        "stress is a ": lambda: forms.assemble(a, stress=stress(u)),
        "is str; return a tensor": lambda: forms.assemble(a, stress=lambda u: "sigma"),
        "coarser is a Mesh": lambda: forms.assemble(a, coarser=V.mesh),
        "coarser holds a int": lambda: forms.assemble(a, coarser=[3]),
        "not fewer than": lambda: forms.assemble(a, coarser=[V.mesh]),
        "90 unknowns have no mass": lambda: forms.assemble(a, mass=none * ufl.inner(u, v) * ufl.dx),
        "The contact is a System": lambda: solve(system),
        "contact is a System": lambda: MovingBody.from_contact(system),
        "The solution is a ndarray": lambda: contact.function(np.zeros((45, 2))),
        "9 candidates, but this body has": lambda: other.fields(solve(contact)),
        "time is nan": lambda: list(follow(contact, [np.nan])),
        "steps is 3": lambda: list(follow(contact, 3)),
    }
    for words, call in cases.items():
        with pytest.raises((TypeError, ValueError), match=words):
            call()


def test_boundary_conditions_may_come_one_after_the_other():
    V, a, _, _, top, tags = pressed_rectangle()
    forces = []
    for bcs in ([top], (top,), iter([top])):
        contact = BodyOnRoad(forms.assemble(a, None, bcs), tags.find(BOTTOM), Plane())
        forces.append(solve(contact).pressure_force.sum())
    assert forces[0] > 1.0 and forces == [forces[0]] * 3


def test_a_submesh_is_a_mesh_like_any_other():
    whole, _ = rectangle_mesh()
    half = mesh.locate_entities(whole, 2, lambda x: x[0] < 1.0 + 1e-9)
    domain = mesh.create_submesh(whole, 2, half)[0]
    V = fem.functionspace(domain, ("Lagrange", 1, (2,)))
    a, _, v = elastic(V)
    L = ufl.inner(fem.Constant(domain, (0.0, -1.0)), v) * ufl.dx
    side = fem.locate_dofs_geometrical(V, lambda x: np.isclose(x[0], 0.0))
    bottom = mesh.locate_entities_boundary(domain, 1, lambda x: np.isclose(x[1], 0.0))
    contact = BodyOnRoad(forms.assemble(a, L, [fem.dirichletbc(np.zeros(2), side, V)]), bottom, Plane())
    assert isinstance(contact.problem, ContactProblem)
    assert 0.0 < solve(contact).contact_force[:, 1].sum() < 1.0


@pytest.mark.parametrize("cell", ["triangle", "quadrilateral"])
def test_nested_meshes_bring_the_multigrid_its_prolongations(cell):
    meshes = [rectangle_mesh(cell, 6, 3)[0]]
    for _ in range(3):
        if cell == "triangle":
            meshes[-1].topology.create_entities(1)
            meshes.append(mesh.refine(meshes[-1])[0])
        elif hasattr(mesh, "uniform_refine"):
            meshes[-1].topology.create_entities(1)
            meshes.append(mesh.uniform_refine(meshes[-1]))
        else:
            pytest.skip("this dolfinx refines simplices only")
    V = fem.functionspace(meshes[-1], ("Lagrange", 1, (2,)))
    a, _, v = elastic(V)
    L = ufl.inner(fem.Constant(meshes[-1], (0.3, -1.0)), v) * ufl.dx
    left = fem.locate_dofs_geometrical(V, lambda x: np.isclose(x[0], 0.0))
    bottom = mesh.locate_entities_boundary(meshes[-1], 1, lambda x: np.isclose(x[1], 0.0))
    bcs = [fem.dirichletbc(np.zeros(2), left, V)]
    system = forms.assemble(a, L, bcs, coarser=meshes[:-1])
    assert [P.shape[1] for P in system.prolongations] == [13 * 25, 7 * 13, 4 * 7]
    points = [system.points]
    for P, coarse in zip(system.prolongations, reversed(meshes[:-1])):
        np.testing.assert_allclose(P.sum(axis=1), 1.0)
        known = coarse.geometry.x[:, :2].round(9)
        # P of the coarse coordinates gives the fine ones, in the order that P itself has
        x = np.linalg.lstsq(P.toarray(), points[-1])[0]
        np.testing.assert_allclose(P @ x, points[-1], atol=1e-12)
        np.testing.assert_allclose(
            x[np.lexsort(x.round(9).T)], known[np.lexsort(known.round(9).T)], atol=1e-9
        )
        points.append(x)
    contact = BodyOnRoad(system, bottom, Plane(), friction=0.4)
    solution = solve(contact, "multigrid")
    direct = solve(contact, "direct")
    scale = np.abs(direct.displacement).max()
    np.testing.assert_allclose(solution.displacement, direct.displacement, atol=1e-7 * scale)
    assert solution.cycles <= 20
    with pytest.raises(ValueError, match="not nested"):
        forms.assemble(a, L, bcs, coarser=[rectangle_mesh(cell, 7, 3)[0]])
    with pytest.raises(ValueError, match="chain of refinements"):
        forms.assemble(a, L, bcs, coarser=meshes[:1])


def test_meshes_may_be_refined_in_part_and_held_where_they_are_not():
    meshes = [rectangle_mesh("triangle")[0]]
    for _ in range(3):
        meshes[-1].topology.create_entities(1)
        low = mesh.locate_entities(meshes[-1], 1, lambda x: x[1] < 0.3)
        meshes.append(mesh.refine(meshes[-1], low)[0])
    V = fem.functionspace(meshes[-1], ("Lagrange", 1, (2,)))
    a, _, _ = elastic(V)
    top = fem.locate_dofs_geometrical(V, lambda x: np.isclose(x[1], 1.0))
    bottom = mesh.locate_entities_boundary(meshes[-1], 1, lambda x: np.isclose(x[1], 0.0))
    bcs = [fem.dirichletbc(np.array([0.003, -0.01]), top, V)]
    contact = BodyOnRoad(forms.assemble(a, None, bcs, coarser=meshes[:-1]), bottom, Plane(), friction=0.2)
    solution, direct = solve(contact, "multigrid"), solve(contact, "direct")
    assert solution.cycles <= 15
    np.testing.assert_allclose(solution.displacement, direct.displacement, atol=1e-9 * 0.01, rtol=0)


def test_without_a_stress_the_file_is_written_and_it_is_said(tmp_path):
    domain, tags = rectangle_mesh()
    V = fem.functionspace(domain, ("Lagrange", 1, (2,)))
    a, _, v = elastic(V)
    left = fem.locate_dofs_geometrical(V, lambda x: np.isclose(x[0], 0.0))
    system = forms.assemble(a, None, [fem.dirichletbc(np.zeros(2), left, V)])
    contact = BodyOnRoad(system, tags.find(BOTTOM), Plane())
    solution = solve(contact)
    with pytest.warns(UserWarning, match="without stress"):
        contact.write(tmp_path / "a.xdmf", solution)
    assert "contact_pressure" in (tmp_path / "a.xdmf").read_text()


SCHEMES = [*IMPLICIT.values(), CentralDifferences]


def dynamic_scene(twin, load, update=None):
    """The user's scene with mass and Rayleigh's damping, in motion."""
    density = fem.Constant(twin.domain, 2.0)
    m = density * ufl.inner(twin.u, twin.v) * ufl.dx
    system = forms.assemble(twin.a, load, twin.bcs, mass=m, damping=0.3 * m + 1e-3 * twin.a, update=update)
    contact = BodyOnRoad(system, facets=twin.tags.find(BOTTOM), road=Plane((0.0, -0.002)), friction=0.3)
    return contact, MovingBody.from_contact(contact)


@pytest.mark.parametrize("scheme", IMPLICIT.values())
def test_time_steps_agree_with_the_ready_made_forms(twin, scheme, tmp_path):
    contact, moving = dynamic_scene(twin, twin.L, lambda t: _set(twin, t))
    load = twin.elasticity.body_force((1.0, -2.0))
    reference = MovingBody.from_forms(
        twin.elasticity,
        2.0,
        lambda t: t * load,
        Plane((0.0, -0.002)),
        "bottom",
        twin.support(y=lambda t: -0.02 * t),
        damping=(0.3, 1e-3),
        friction=0.3,
    )
    ours, theirs = scheme(moving, 0.02, tolerance=1e-13), scheme(reference, 0.02, tolerance=1e-13)
    state, expected = ours.start(), theirs.start()
    points = contact.system.points
    order = [twin.here[tuple(np.round(x, 9))] for x in points]
    for _ in range(20):
        state, expected = ours.step(state), theirs.step(expected)
        scale = 0.02 * state.time
        np.testing.assert_allclose(
            state.displacement, expected.displacement[order], rtol=0, atol=1e-12 * scale
        )
    assert state.count > 0
    top = np.isclose(points[:, 1], 1.0)
    np.testing.assert_allclose(state.displacement[top, 1], -0.02 * state.time, atol=1e-16)
    np.testing.assert_allclose(state.velocity[top, 1], -0.02, rtol=1e-10)
    np.testing.assert_allclose(state.acceleration[top, 1], 0.0, atol=1e-9)
    series = Series(tmp_path / "series.xdmf", contact)
    series.write(state.time, *contact.fields(state))
    assert contact.fields(state)[0]["contact_pressure"].max() > 0.0


@pytest.mark.parametrize("scheme", SCHEMES)
def test_supports_that_are_not_at_zero_are_held(scheme):
    body = Body.from_grid(rectangle(1.0, 1.0, 4, 4))
    elasticity = Elasticity(body, Isotropic(100.0, 0.3))
    support = Support(body).fix("top", x=0.0, y=-0.01)
    system = elasticity.system(elasticity.body_force((0.0, -1.0)), support, density=1.0)
    contact = BodyOnRoad(system, "bottom", Plane())
    integrator = scheme(MovingBody.from_contact(contact), 0.002)
    top = body.nodes("top")
    state = integrator.start()
    for _ in range(30):
        assert (state.displacement[top] == (0.0, -0.01)).all()
        assert not state.velocity[top].any() and not state.acceleration[top].any()
        state = integrator.step(state)
    # from the static solution nothing moves
    solution = solve(contact, tolerance=1e-13)
    state = integrator.start(solution.displacement)
    for _ in range(30):
        state = integrator.step(state)
    scale = np.abs(solution.displacement).max()
    still = 2e-4 if scheme is MassRedistribution else 1e-9
    np.testing.assert_allclose(state.displacement, solution.displacement, atol=still * scale)
    with pytest.raises(ValueError, match="is prescribed there"):
        integrator.start(np.zeros_like(body.coordinates))


@pytest.mark.parametrize("scheme", IMPLICIT.values())
def test_a_shaken_support_moves_the_body_to_second_order_in_dt(scheme):
    """A slice that cannot strain sideways, shaken from above, against the same with short steps."""
    body = Body.from_grid(rectangle(1.0, 1.0, 1, 4))
    elasticity = Elasticity(body, Isotropic(1.0, 0.0))
    ends = []
    for steps in (40, 80, 320):
        support = Support(body).fix("top", x=0.0, y=lambda t: 0.01 * (1.0 - np.cos(2.0 * t)))
        system = elasticity.system(np.zeros_like(body.coordinates), support, density=1.0)
        contact = BodyOnRoad(system, "bottom", Plane((0.0, -10.0)))
        integrator = scheme(MovingBody.from_contact(contact), 2.0 / steps)
        ends.append(integrator.run(integrator.start(), steps).displacement[:, 1])
    coarse, fine = (np.abs(end - ends[2]).max() for end in ends[:2])
    assert fine < 0.01 * np.abs(ends[2]).max()
    assert coarse / fine > 3.5


def test_a_run_says_once_that_linear_strain_is_left():
    body = Body.from_grid(rectangle(1.0, 1.0, 2, 2, corner=(0.0, 1.0)))
    elasticity = Elasticity(body, Isotropic(1e4, 0.3))
    scheme = Newmark(
        MovingBody.from_forms(elasticity, 1.0, np.zeros_like(body.coordinates), Plane(), "bottom"), 0.01
    )
    turning = np.stack([-(body.coordinates[:, 1] - 1.5), body.coordinates[:, 0] - 0.5], axis=1)
    with pytest.warns(BeyondLinear, match="rotation 0.1") as said:
        scheme.run(scheme.start(velocity=turning), 30)
    assert len(said) == 1


def test_a_system_without_mass_cannot_be_set_in_motion(twin):
    contact = BodyOnRoad(forms.assemble(twin.a), twin.tags.find(BOTTOM), Plane())
    with pytest.raises(ValueError, match="mass=m"):
        MovingBody.from_contact(contact)


@pytest.mark.parametrize(
    "first",
    [
        "import dolfinx, forms, model; model.Series",
        "from dolfinx import fem, io; from petsc4py import PETSc; import forms, model; model.Series",
        "import model, forms; import dolfinx; model.Series",
    ],
)
def test_imports_come_in_any_order(first):
    said = subprocess.run([sys.executable, "-c", first], capture_output=True, text=True)
    assert said.returncode == 0, said.stderr


def test_importing_changes_nothing_for_others():
    code = (
        "import sys, warnings, numpy, numba, scipy.sparse, scipy.special, dolfinx\n"
        "from petsc4py import PETSc\n"
        "def now(): return (sys.excepthook, list(warnings.filters), numpy.geterr(), numpy.get_printoptions(),"
        " PETSc.Options().getAll())\n"
        "before = now()\n"
        "import model, forms, geometry\n"
        "sys.exit(now() != before)"
    )
    assert subprocess.run([sys.executable, "-c", code]).returncode == 0


def test_steps_end_on_a_curved_road_whatever_the_scheme_is_called():
    road = SmoothRoad(lambda x: 0.2 * np.sin(2.0 * x), np.linspace(-3.0, 5.0, 161))
    body = Body.from_grid(rectangle(1.0, 1.0, 4, 4, corner=(0.0, 0.21)))
    elasticity = Elasticity(body, Isotropic(1e3, 0.3))
    system = elasticity.system(elasticity.body_force((0.0, -10.0)), density=1.0)
    contact = BodyOnRoad(system, "bottom", road, friction=0.2)
    scheme = MassRedistribution(MovingBody.from_contact(contact), 0.01)
    assert isinstance(scheme, MassRedistribution)
    touched = 0
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        state = scheme.start()
        for _ in range(40):
            state = scheme.step(state)
            at = contact.points + contact.displacement(state)[contact.nodes]
            gap = road.closest(at)[0]
            assert gap.min() > -1e-11 and np.abs(gap[state.status > 0]).max(initial=0.0) < 1e-11
            touched += state.count
    assert touched > 5


def test_coarser_meshes_of_several_processes_are_refused():
    launcher = Path(sys.executable).with_name("mpirun")
    if not launcher.exists():
        pytest.skip("there is no mpirun beside this Python")
    code = (
        "from mpi4py import MPI; import ufl, forms; from dolfinx import fem, mesh\n"
        "square = mesh.create_unit_square(MPI.COMM_WORLD, 4, 4)\n"
        "V = fem.functionspace(square, ('Lagrange', 1, (2,)))\n"
        "forms.assemble(ufl.inner(ufl.TrialFunction(V), ufl.TestFunction(V)) * ufl.dx, coarser=[square])"
    )
    said = subprocess.run([launcher, "-n", "2", sys.executable, "-c", code], capture_output=True, text=True)
    assert said.returncode != 0 and "not shared among ranks" in said.stderr
