"""Scenes that run alone and under mpirun: `on_ranks.py OUT KIND ...`; rank 0 writes what all ranks found."""

import sys

import numpy as np
import ufl
from mpi4py import MPI

import forms

from dolfinx import fem, graph, mesh  # isort: skip
from forms import Elasticity, Isotropic, Support
from geometry import (
    Body,
    LinearRoad,
    Plane,
    SeveralRoads,
    SmoothRoad,
    half_ball,
    half_cylinder_nested,
    rectangle,
    ring,
    tread_block,
)
from model import (
    BodyOnRoad,
    CentralDifferences,
    ContactStabilised,
    History,
    MassRedistribution,
    MovingBody,
    Newmark,
    NotConverged,
    Series,
    follow,
    load_checkpoint,
    save_checkpoint,
    solve,
)
from model.recording.energy_balance import Ledger
from model.results.gathered import Gathered

R, STEEL = 10.0, Isotropic(E=210e3, nu=0.3)


def cylinder(mu, force=1e4):
    """A half cylinder, held by the road but for one component of one node."""
    body = Body.from_grid(half_cylinder_nested(R), 2)
    support = Support(body).fix_node(body.nearest_node((0.0, R)), x=0.0)
    elasticity = Elasticity(body, STEEL)
    system = elasticity.system(elasticity.total_force("top", (0.0, -force)), support)
    return BodyOnRoad(system, "arc", Plane(), friction=mu)


def ball(mu):
    """A quarter of a ball, pressed."""
    body = Body.from_grid(half_ball(R, "quarter"), 1)
    support = Support(body).fix("x0", x=0.0).fix("y0", y=0.0)
    elasticity = Elasticity(body, STEEL)
    system = elasticity.system(elasticity.total_force("top", (0.0, 0.0, -2500.0)), support)
    return BodyOnRoad(system, "sphere", Plane(), friction=mu)


def triangles():
    """A block of triangles of two materials that is pulled along its foot, in one step."""
    regions = {"soft": lambda x: x[:, 0] < 1.0, "hard": lambda x: x[:, 0] >= 1.0}
    body = Body.from_grid(rectangle(2.0, 1.0, 4, 2, regions=regions), 2, triangles=True)
    elasticity = Elasticity(body, {"soft": Isotropic(E=1e3, nu=0.3), "hard": Isotropic(E=3e3, nu=0.2)})
    support = Support(body).fix("top", x=0.003, y=-0.01)
    system = elasticity.system(elasticity.body_force((0.0, -1.0)), support)
    return BodyOnRoad(system, "bottom", Plane((0.0, -0.002), (0.1, 1.0)), friction=0.4)


def held():
    """A block on a slope, a foot of which moves along its support only."""
    elasticity = Elasticity(Body.from_grid(rectangle(2.0, 1.0, 4, 2), 2), Isotropic(E=1e3, nu=0.3))
    support = Support(elasticity.body).fix("left", x=0.001)
    system = elasticity.system(elasticity.body_force((-0.4, -2.0)), support)
    return BodyOnRoad(system, "bottom", Plane((0.0, 0.0), (0.02, 1.0)))


def below():
    """A block that starts below the road at one end."""
    elasticity = Elasticity(Body.from_grid(rectangle(2.0, 1.0, 8, 4), 1), STEEL)
    system = elasticity.system(elasticity.body_force((0.0, 0.0)), Support(elasticity.body).fix("top", y=0.0))
    return BodyOnRoad(system, "bottom", Plane((1.0, 0.0), (-0.1, 1.0)))


def slides():
    """A block that nothing holds, on a slope."""
    elasticity = Elasticity(Body.from_grid(rectangle(2.0, 1.0, 8, 4), 1), STEEL)
    system = elasticity.system(elasticity.body_force((0.0, -1.0)))
    return BodyOnRoad(system, "bottom", Plane((0.0, 0.0), (0.1, 1.0)), friction=0.05, interference=True)


def tips():
    """A block of triangles that its load turns about the end of its foot."""
    body = Body.from_grid(rectangle(1.0, 2.0, 4, 8), 1, triangles=True)
    elasticity = Elasticity(body, STEEL)
    system = elasticity.system(elasticity.total_force("top", (0.8, -1.0)))
    return BodyOnRoad(system, "bottom", Plane(), friction=1.0)


def path():
    """The cylinder, pressed and then pushed."""
    contact = cylinder(0.3)
    push = 0.5 * contact.system.load[:, ::-1] * [-0.3, 0.0]
    *_, last = follow(contact, [contact.system.load, contact.system.load + push], tolerance=1e-11)
    return contact, last


def tread():
    """A block of rubber pressed into a rough road, and dragged along it."""
    elasticity = Elasticity(Body.from_grid(rectangle(2.0, 1.0, 8, 4), 2), Isotropic(E=1e3, nu=0.3))
    support = Support(elasticity.body).fix("top", x=lambda t: 0.005 * t, y=lambda t: -0.01 * min(t, 1.0))
    system = elasticity.system(elasticity.body_force((0.0, 0.0)), support)
    x = np.linspace(-1.0, 3.0, 161)
    road = LinearRoad(x, 0.01 * (np.sin(9.0 * x) + np.sin(23.0 * x) - 2.0))
    contact = BodyOnRoad(system, "bottom", road, friction=0.4)
    *_, last = follow(contact, [1.0, 2.0], tolerance=1e-11)
    return contact, last


def rubber():
    """Blocks of nearly incompressible rubber, drawn until some nodes lift, which sweeps do too often."""
    body = Body.from_grid(tread_block((3, 2), (8.0, 8.0), (2.0, 2.0), 6.0, 4.0, 4.0), 1)
    elasticity = Elasticity(body, Isotropic(E=50.0, nu=0.49), mean_dilatation=True)
    support = Support(body).platen("top").fix("top", y=0.0)
    forces = [80.0 * np.array([0.8 * part, 0.0, -1.0]) for part in (0.0, 0.25, 0.5)]
    pushes = [elasticity.total_force("top", force) for force in forces]
    system = elasticity.system(pushes[0], support)
    contact = BodyOnRoad(system, "bottom", Plane((0, 0, 0), (0, 0, 1)), friction=0.8)
    loads = [np.where(system.fixed, 0.0, system.reduce(push)) for push in pushes]
    *_, last = follow(contact, loads, "multigrid", tolerance=1e-11)
    return contact, last


def slippery():
    """A block on a floor that is more slippery on one side; its friction grows along the road."""
    elasticity = Elasticity(Body.from_grid(rectangle(2.0, 1.0, 8, 4), 2), Isotropic(E=1e3, nu=0.3))
    support = Support(elasticity.body).fix("top", x=0.004, y=-0.01)
    system = elasticity.system(elasticity.body_force((0.0, 0.0)), support)
    return BodyOnRoad(system, "bottom", Plane(), lambda x: 0.1 + 0.3 * x[:, 0])


def hollow():
    """The cylinder in a smooth hollow, without friction, held by contact but for one component."""
    x = np.linspace(-R, R, 101)
    body = Body.from_grid(half_cylinder_nested(R), 2)
    support = Support(body).fix_node(body.nearest_node((0.0, R)), x=0.01)
    elasticity = Elasticity(body, STEEL)
    system = elasticity.system(elasticity.total_force("top", (0.0, -1e4)), support)
    return BodyOnRoad(system, "arc", SmoothRoad.through(x, 0.02 * x**2))


def corner():
    """A block between a floor and a wall that comes, too large for the place between them."""
    elasticity = Elasticity(Body.from_grid(rectangle(2.0, 1.0, 4, 4), 2), Isotropic(E=1e3, nu=0.3))
    support = Support(elasticity.body).fix("right", x=-0.01)
    system = elasticity.system(elasticity.total_force("top", (0.0, -20.0)), support)
    road = SeveralRoads([Plane(), Plane((0.004, 0.0), (1.0, 0.0))])
    return BodyOnRoad(system, ["bottom", "left"], road, friction=0.2, interference=True)


def platen():
    """A block between a press, which is tied and pushes obliquely, a spring and the road."""
    body = Body.from_grid(rectangle(2.0, 1.0, 8, 4), 2)
    elasticity = Elasticity(body, Isotropic(E=1e3, nu=0.3))
    support = Support(body).platen("top").fix("top", y=-0.01).spring("left", x=50.0)
    system = elasticity.system(elasticity.total_force("top", (1.0, -30.0)), support)
    return BodyOnRoad(system, "bottom", Plane((0.0, -0.001), (0.0, 1.0)), friction=0.3)


def own_forms(correction, cell=mesh.CellType.triangle, partitioner=None):
    """A block of forms of one's own on a mesh that dolfinx distributes, pressed and pulled over the road."""
    many = MPI.COMM_WORLD.size > 1
    corners, cells, options = [(0.0, 0.0), (2.0, 1.0)], (12, 6), {}
    if many and partitioner is not None:
        options["partitioner"] = partitioner
    square = mesh.create_rectangle(MPI.COMM_WORLD, corners, cells, cell, **options)
    V = fem.functionspace(square, ("Lagrange", 1, (2,)))
    u, v = ufl.TrialFunction(V), ufl.TestFunction(V)
    strain = ufl.sym(ufl.grad(u))
    a = ufl.inner(800.0 * strain + 600.0 * ufl.tr(strain) * ufl.Identity(2), ufl.sym(ufl.grad(v))) * ufl.dx
    L = ufl.inner(fem.Constant(square, (0.0, -5.0)), v) * ufl.dx
    top = mesh.locate_entities_boundary(square, 1, lambda x: np.isclose(x[1], 1.0))
    given = fem.Constant(square, (0.002, -0.012))
    bc = fem.dirichletbc(given, fem.locate_dofs_topological(V, 1, top), V)
    foot = mesh.locate_entities_boundary(square, 1, lambda x: np.isclose(x[1], 0.0))
    contact = BodyOnRoad(forms.assemble(a, L, [bc]), foot, Plane((0.0, 0.0), (0.01, 1.0)), friction=0.3)
    return contact, solve(contact, correction if many else "direct", tolerance=1e-11, limit=100_000)


def odd(comm, parts, kinds, cells):
    """Give rank 1 nothing, rank 2 two cells at the foot and rank 3 cells far from it; rank 0 the rest."""
    count = cells[0].size // 4 if isinstance(cells, list) else cells.num_nodes
    ranks = np.zeros(count, dtype=np.int32)
    ranks[:2], ranks[-6:] = 2, 3
    found = graph.adjacencylist(ranks)
    return getattr(found, "_cpp_object", found)  # dolfinx 0.9 gives the object itself


def own_forms_of_body():
    """Forms of one's own on the nested meshes of a body."""
    body = Body.from_grid(rectangle(2.0, 1.0, 6, 3), 1)
    V = fem.functionspace(body.mesh, ("Lagrange", 1, (2,)))
    u, v = ufl.TrialFunction(V), ufl.TestFunction(V)
    strain = ufl.sym(ufl.grad(u))
    a = ufl.inner(800.0 * strain + 600.0 * ufl.tr(strain) * ufl.Identity(2), ufl.sym(ufl.grad(v))) * ufl.dx
    top = fem.locate_dofs_topological(V, 1, body.facet_tags.find(body.names["top"]))
    bc = fem.dirichletbc(np.array([0.002, -0.012]), top, V)
    foot = body.facet_tags.find(body.names["bottom"])
    contact = BodyOnRoad(forms.assemble(a, bcs=[bc]), foot, Plane((0.0, 0.0), (0.01, 1.0)), friction=0.3)
    return contact, solve(contact, tolerance=1e-11)


def block(scheme, road, dt, friction=0.3):
    """A block above a road; its top is tied to a plate that moves."""
    body = Body.from_grid(rectangle(2.0, 1.0, 6, 3), 1)
    elasticity = Elasticity(body, Isotropic(E=1e4, nu=0.3))
    support = Support(body).platen("top").fix("top", x=lambda t: 0.5 * t)
    system = elasticity.system(elasticity.body_force((0.0, -10.0)), support, 1.0, (0.1, 1e-4))
    contact = BodyOnRoad(system, "bottom", road, friction=friction)
    return contact, scheme(MovingBody.from_contact(contact), dt, tolerance=1e-11)


def thrown(scheme, road, dt, steps, friction=0.3):
    """The block, thrown obliquely, and its ledger."""
    contact, moving = block(scheme, road, dt, friction)
    state = moving.start(velocity=np.tile([0.5, -1.0], (len(contact.system.coordinates), 1)))
    ledger = Ledger(moving, state)
    for _ in range(steps):
        before, state = state, moving.step(state)
        ledger.close(before, state)
    return contact, state, ledger.entry


FLOOR = Plane((0.0, -0.002), (0.02, 1.0))


def saved(path):
    """Six steps of the block, then a checkpoint and a series."""
    contact, moving = block(Newmark, FLOOR, 1e-3)
    state = moving.start(velocity=np.tile([0.5, -1.0], (len(contact.system.coordinates), 1)))
    state = moving.run(state, 6)
    save_checkpoint(f"{path}/run.npz", moving, state)
    series = Series(f"{path}/run.xdmf", contact)
    series.write(state.time, *contact.fields(state))
    return contact, state


def continued(path):
    """Two steps more from the checkpoint."""
    contact, moving = block(Newmark, FLOOR, 1e-3)
    return contact, moving.run(load_checkpoint(f"{path}/run.npz", moving), 2)


def newmark():
    """With Newmark, on a plane."""
    return thrown(Newmark, FLOOR, 1e-3, 8)


def stabilised():
    """Contact-stabilised, on a wavy road."""
    x = np.linspace(-1.0, 3.0, 161)
    road = LinearRoad(x, 0.01 * (np.sin(9.0 * x) + np.sin(23.0 * x) - 2.0))
    return thrown(ContactStabilised, road, 2e-3, 12)


def recorded():
    """With Newmark and a history of a node at the foot and of one above it."""
    contact, moving = block(Newmark, FLOOR, 1e-3)
    body, state = (
        contact.system.body,
        moving.start(velocity=np.tile([0.5, -1.0], (len(contact.system.coordinates), 1))),
    )
    points = {"A": body.nearest_node((0.0, 0.0)), "B": body.nearest_node((1.0, 0.5))}
    history = History(moving, state, points)
    for _ in range(12):
        before, state = state, moving.step(state)
        history.record(before, state)
    columns = [name for name in history.columns if name not in ("seconds", "residual", "cycles", "numerical")]
    rows = np.array([history[name] for name in columns])
    kinds = ("touch", "leave", "stick", "slip")
    events = np.array(sorted((event.time, kinds.index(event.kind)) for event in history.events))
    assert len(history.touches("A")) > 0
    return contact, state, np.concatenate([np.nan_to_num(rows).ravel(), events.ravel()])


def redistributed():
    """With mass redistribution, on the wavy road, and without friction."""
    x = np.linspace(-1.0, 3.0, 161)
    road = LinearRoad(x, 0.01 * (np.sin(9.0 * x) + np.sin(23.0 * x) - 2.0))
    return thrown(MassRedistribution, road, 2e-3, 12, None)


def explicit():
    """With central differences."""
    return thrown(CentralDifferences, FLOOR, 2e-4, 40)


def too_long():
    """A step beyond the limit of stability."""
    return thrown(CentralDifferences, FLOOR, 0.1, 1)


def ordered():
    """An order of nodes, which ranks cannot keep."""
    contact = cylinder(None)
    return contact, solve(contact, order=np.arange(len(contact.system.coordinates)))


def bouncing():
    """A ring that falls, touches and bounces, with mass redistribution and friction."""
    elasticity = Elasticity(Body.from_grid(ring(1.0, 0.8, 24, 2, (0.0, -1.0)), 1), Isotropic(E=1e5, nu=0.3))
    system = elasticity.system(elasticity.body_force((0.0, -100.0)), density=10.0)
    contact = BodyOnRoad(system, "outer", Plane((0.0, -1.01), (0.0, 1.0)), friction=0.25)
    moving = MassRedistribution(MovingBody.from_contact(contact), 1e-3, tolerance=1e-11)
    state = moving.start(velocity=np.tile([0.5, -1.0], (len(system.coordinates), 1)))
    ledger = Ledger(moving, state)
    for _ in range(20):
        before, state = state, moving.step(state)
        ledger.close(before, state)
    return contact, state, ledger.entry


SCENES = {
    "algebraic": lambda: own_forms("algebraic"),
    "direct": lambda: own_forms("direct", mesh.CellType.quadrilateral),
    "none": lambda: own_forms("none"),
    "odd": lambda: own_forms("direct", mesh.CellType.quadrilateral, odd),
    "own_forms_of_body": own_forms_of_body,
    "cylinder": lambda: cylinder(None),
    "friction": lambda: cylinder(0.3),
    "ball": lambda: ball(0.3),
    "triangles": triangles,
    "held": held,
    "below": below,
    "slides": slides,
    "tips": tips,
    "path": path,
    "tread": tread,
    "rubber": rubber,
    "slippery": slippery,
    "hollow": hollow,
    "corner": corner,
    "platen": platen,
    "newmark": newmark,
    "stabilised": stabilised,
    "recorded": recorded,
    "redistributed": redistributed,
    "bouncing": bouncing,
    "explicit": explicit,
    "too_long": too_long,
    "ordered": ordered,
}


FILED = {"saved": saved, "continued": continued}


def found(kind, path="."):
    """The fields of a scene on the whole body, sorted by place, and the sheet of its forces; on rank 0."""
    scene = FILED[kind](path) if kind in FILED else SCENES[kind]()
    path = isinstance(scene, tuple)
    contact, solution, *books = scene if path else (scene, solve(scene, "multigrid", tolerance=1e-11))
    nodes, _ = contact.fields(solution)
    sheet = {}
    if not path:
        balance = contact.reactions(solution, about=(1.0, 0.5, 0.2)[: contact.points.shape[1]])
        sheet = {"sheet": np.concatenate([*balance.force.values(), *balance.moment.values()])}
    for entry in books:
        sheet["ledger"] = (
            entry
            if isinstance(entry, np.ndarray)
            else np.array([entry.kinetic, entry.strain, entry.potential, entry.damping, entry.friction])
        )
    nodes["points"] = contact.system.points
    if contact.system.exchanges:
        nodes = Gathered(contact.system).fields(nodes, {})[0]
    if nodes:
        order = np.lexsort(np.round(nodes["points"], 9).T)
        nodes = {name: values[order] for name, values in nodes.items()} | sheet | {"cycles": solution.cycles}
    return nodes


if __name__ == "__main__":
    out, *kinds = sys.argv[1:]
    for kind in kinds:
        try:
            fields = found(kind, out)
        except (ValueError, NotConverged) as error:
            if MPI.COMM_WORLD.size > 1 and not getattr(error, "everybody", False):
                raise  # which ends all ranks: the others have not met it
            fields = {"trouble": np.array(str(error))}
        everybody = MPI.COMM_WORLD.gather(str(fields.get("trouble", "")))
        if MPI.COMM_WORLD.rank == 0:
            np.savez(f"{out}/{kind}.npz", **fields, everybody=np.array(everybody))
