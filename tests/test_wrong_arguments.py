"""Every public door refuses a wrong argument at once, in one sentence of ours with its name and its value."""

import inspect
import re
from contextlib import chdir
from functools import cache, wraps
from pathlib import Path

import numpy as np
import pytest

import forms
import geometry
import model
from forms import (
    Anisotropic,
    Cords,
    Elasticity,
    Hyperelasticity,
    Isotropic,
    MooneyRivlin,
    NeoHookean,
    StrainEnergy,
    StVenantKirchhoff,
    Support,
)
from geometry import Body, Grid, Plane, rectangle
from model import BodyOnRoad, MovingBody

HOUSE = Path(__file__).parents[1]
NAN, INF = np.nan, np.inf
NO_NUMBER = ["stiff", None, NAN, True, [1.0, 2.0], 1j, np.array([[1.0]])]
ANY = [*NO_NUMBER, INF]  # a finite number is wanted
POSITIVE = [*ANY, 0.0, -1.0]
SOME = [*ANY, -1.0]  # a number of 0 or more
WHOLE = ["3", None, NAN, True, 1.5, [2], INF, -2]
VECTOR = ["up", None, 3.0, (NAN, 1.0), (INF, 1.0), ("a", "b"), (1.0,), np.zeros((2, 2)), [[1.0], [1.0, 2.0]]]
ARRAY = [
    "flat",
    None,
    ["a", "b"],
    [[1.0], [1.0, 2.0]],
    np.ones(3, dtype=bool),
    np.array([NAN, 1.0, 2.0]),
]
ROAD = [None, "road.csv", Plane, 3.0, np.zeros((3, 2))]
RESTING = [*ROAD, geometry.MovingRoad(Plane(), (1.0, 0.0))]
WORD = ["magic", None, 3, True, ["magic"]]
FUNCTION = ["f", 3.0, np.zeros(3)]
THING = [None, "body", 3.0, Body]
PATH = [None, 3.0, ["a"]]


def optional(values):
    """Where nothing need be said."""
    return [value for value in values if value is not None]


@cache
def scene():
    body = Body.from_grid(rectangle(2.0, 1.0, 4, 2))
    elasticity = Elasticity(body, Isotropic(1e3, 0.3))
    system = elasticity.system(np.zeros((15, 2)), Support(body).fix("top", x=0.0, y=-0.01), density=1.0)
    contact = BodyOnRoad(system, "bottom", Plane())
    moving = MovingBody.from_contact(contact)
    scheme = model.Newmark(moving, 0.01)
    rubber = Hyperelasticity(body, NeoHookean(1e3, 0.3))
    hung = rubber.system(np.zeros((15, 2)), Support(body).fix("top", x=0.0, y=0.0), density=1.0)
    finite = BodyOnRoad(hung, "bottom", Plane())
    return {
        "body": body,
        "elasticity": elasticity,
        "system": system,
        "contact": contact,
        "moving": moving,
        "scheme": scheme,
        "state": scheme.start(),
        "solution": model.solve(contact),
        "finite": finite,
        "finite body": model.FiniteBody.from_contact(finite),
        "finite contact": model.FiniteContact(finite),
        "support": Support(body),
        "moving road": geometry.MovingRoad(Plane(), (1.0, 0.0)),
        "series": model.Series("e.xdmf", body),
    }


class Of(str):
    """A part of the scene, or a method of one."""

    def __call__(self, *arguments, **named):
        return self.found(*arguments, **named)

    @property
    def found(self):
        owner, _, method = self.rpartition(".")
        return getattr(Of(owner).found, method) if owner else scene()[self]


def all_of(function):
    """A generator's function that takes all steps."""

    @wraps(function, assigned=("__name__",) if inspect.isfunction(function) else ())
    def door(**arguments):
        return list(function(**arguments))

    return door


HERTZ = model.HertzCylinder(P=1.0, R=1.0, E=1.0, nu=0.3)
SPHERE = model.HertzSphere(F=1.0, R=1.0, E=1.0, nu=0.3)
GRID = rectangle(1.0, 1.0, 2, 2)
MODULI = ({"E": 1.0, "nu": 0.3}, {"E": POSITIVE, "nu": [*ANY, 0.5, -1.0]})
BOX = {"width": 1.0, "height": 1.0, "columns": 2, "rows": 2}
SAMPLES = {"positions": [0.0, 1.0, 2.0], "heights": [0.0, 1.0, 0.0]}
SIDES = {"width": POSITIVE, "height": POSITIVE, "columns": WHOLE, "rows": WHOLE, "cell": WORD}
SIDES |= {"corner": VECTOR, "distortion": [*SOME, 0.5], "seed": WHOLE, "regions": ["all", 3, {1: min}]}
BLOCK = {"blocks": (3,), "size": (8.0,), "groove": (2.0,), "height": 6.0, "base": 4.0, "spacing": 2.0}
BY_BLOCK = [None, "abc", (), (NAN,), (0,), (-1,), (1.0, 1.0, 1.0), ("a",)]
DISPLACEMENTS = [None, "u", np.zeros((3, 2)), np.full((15, 2), NAN), np.zeros((15, 3))]
# door, arguments that are right, and what is wrong for each; `Of(name)` is a part of the scene
DOORS = [
    (
        model.contact_half_width,
        {"x": [0.0, 1.0, 2.0], "pressure": [0.0, 1.0, 0.0], "in_contact": [False, True, False]},
        {
            "x": ARRAY[:5],
            "pressure": ARRAY[:5],
            "in_contact": [np.ones(2, dtype=bool)],
            "degree": [*WHOLE, 0],
        },
    ),
    (
        model.on_body,
        {"count": 3, "nodes": [0], "values": [1.0]},
        {"count": WHOLE, "values": ARRAY[:4], "elsewhere": ANY},
    ),
    (Isotropic, *MODULI),
    (NeoHookean, *MODULI),
    (StVenantKirchhoff, *MODULI),
    (MooneyRivlin, {"c1": 1.0, "c2": 1.0, "lame": 1.0}, {"c1": SOME, "c2": SOME, "lame": POSITIVE}),
    (StrainEnergy, {"mu": 1.0}, {"mu": ANY}),
    (
        Cords,
        {"matrix": NeoHookean(1.0, 0.3), "stiffness": 1.0, "directions": [(1.0, 0.0)]},
        {"stiffness": SOME, "directions": [None, "x", 3.0, [1.0], [(NAN, 0.0)], ["ab"]]},
    ),
    (
        Anisotropic,
        {"matrix": np.eye(3)},
        {"matrix": ["stiff", None, np.eye(4), NAN * np.eye(3), [[1], [1, 2]]]},
    ),
    (
        Elasticity,
        {"body": Of("body"), "material": Isotropic(1.0, 0.3)},
        {"body": THING, "material": [None, "steel", 210e3, Isotropic], "kinematics": optional(WORD)},
    ),
    (
        Hyperelasticity,
        {"body": Of("body"), "energy": NeoHookean(1.0, 0.3)},
        {
            "body": THING,
            "energy": [None, "rubber", 3.0],
            "pressure": ["high", 3.0, {"top": NAN}, {"top": "p"}],
        },
    ),
    (Of("elasticity.mass"), {"density": 1.0}, {"density": POSITIVE}),
    (
        Of("elasticity.damping"),
        {"alpha": 0.1, "beta": 0.1, "density": 1.0},
        {"alpha": SOME, "beta": SOME, "density": POSITIVE},
    ),
    (Of("elasticity.body_force"), {"vector": (0.0, 1.0)}, {"vector": VECTOR}),
    (
        Of("elasticity.traction"),
        {"name": "top", "vector": (0.0, 1.0)},
        {"vector": VECTOR, "name": [None, 3, "lid"]},
    ),
    (
        Of("elasticity.total_force"),
        {"name": "top", "vector": (0.0, 1.0)},
        {"vector": VECTOR, "name": [None, 3]},
    ),
    (
        Of("elasticity.system"),
        {"load": np.zeros((15, 2)), "density": 1.0},
        {
            "load": [None, "weight", np.zeros((3, 2)), np.full((15, 2), NAN), np.full((15, 2), "a")],
            "density": optional(POSITIVE),
            "damping": [0.1, "no", (0.1,), (NAN, 0.1)],
            "support": ["top", 3.0, Support],
        },
    ),
    (Of("elasticity.stress"), {"u": np.zeros((15, 2))}, {"u": DISPLACEMENTS}),
    (Of("elasticity.gradient"), {"u": np.zeros((15, 2))}, {"u": DISPLACEMENTS}),
    (Of("elasticity.von_mises"), {"u": np.zeros((15, 2))}, {"u": DISPLACEMENTS}),
    (Support, {"body": Of("body")}, {"body": THING}),
    (
        Of("support.fix"),
        {"name": "top", "x": 0.0},
        {"x": optional(ANY), "y": optional(ANY), "name": [None, 3]},
    ),
    (Of("support.fix_node"), {"index": 0, "x": 0.0}, {"index": WHOLE, "x": optional(ANY)}),
    (
        Of("support.spring"),
        {"where": "top", "x": 1.0},
        {"x": SOME, "y": SOME, "where": [None, 3.5, "lid", 99], "end": FUNCTION},
    ),
    (Of("support.dashpot"), {"where": "top", "x": 1.0}, {"x": SOME, "y": SOME, "where": [None, 3.5, True]}),
    (Of("support.platen"), {"name": "top"}, {"name": [None, 3], "tilt": ["far", NAN, (1.0, 2.0), None]}),
    (
        Plane,
        {"point": (0.0, 0.0), "normal": (0.0, 1.0)},
        {"point": optional(VECTOR), "normal": optional(VECTOR)},
    ),
    (geometry.RoundRoad, {"radius": 1.0}, {"radius": [*ANY, 0.0], "point": optional(VECTOR)}),
    (
        geometry.ShiftedRoad,
        {"road": Plane(), "shift": (0.0, 1.0)},
        {"road": RESTING, "shift": VECTOR},
    ),
    (
        geometry.MovingRoad,
        {"road": Plane(), "velocity": (1.0, 0.0)},
        {
            "road": RESTING,
            "velocity": [*optional(VECTOR), lambda t: None, lambda t: (t, NAN)],
            "turn": FUNCTION,
            "centre": optional(VECTOR),
            "axis": [*optional(VECTOR), (0.0, 0.0, 0.0)],
        },
    ),
    (Of("moving road.at"), {"time": 1.0}, {"time": ANY}),
    (Of("moving road.displacement"), {"time": 1.0}, {"time": ANY}),
    (
        geometry.RoadSeenFromAfar,
        {"road": Plane(), "summit": 0.0, "reach": 1.0},
        {"road": RESTING, "summit": ANY, "reach": POSITIVE},
    ),
    (geometry.ExtrudedRoad, {"road": Plane()}, {"road": RESTING}),
    (
        geometry.SeveralRoads,
        {"roads": [Plane()]},
        {"roads": [None, "ab", 3.0, [], [Plane(), 3], [Plane], Plane()]},
    ),
    (geometry.LinearRoad, SAMPLES, {"positions": ARRAY, "heights": ARRAY}),
    (geometry.SmoothRoad.through, SAMPLES, {"positions": ARRAY, "heights": ARRAY}),
    (
        geometry.SmoothRoad,
        {"height": np.sin, "positions": [0.0, 1.0, 2.0]},
        {"height": [None, *FUNCTION], "positions": ARRAY, "slope": FUNCTION},
    ),
    (
        geometry.SurfaceRoad,
        {"points": [[0, 0, 0], [1, 0, 0], [0, 1, 0]], "triangles": [[0, 1, 2]]},
        {"points": ARRAY, "triangles": [*ARRAY, [[0, 1, 2.5]], [[0, 1, 9]]]},
    ),
    (geometry.PolylineRoad, {"points": [[0, 0], [1, 0]]}, {"points": ARRAY}),
    (geometry.read_mesh, {"path": "part.msh"}, {"path": PATH}),
    (geometry.read_msh, {"path": "part.msh"}, {"path": PATH}),
    (
        geometry.read_samples,
        {"path": "road.csv"},
        {"path": PATH},
    ),
    (geometry.SurfaceRoad.read, {"path": "part.stl"}, {"path": PATH, "scale": POSITIVE}),
    (geometry.read_topography, {"path": "scan.sur"}, {"path": PATH}),
    (geometry.samples_of, {}, {"topography": [None, 3.0, np.zeros(3)]}),
    (rectangle, BOX, SIDES),
    (geometry.box, BOX | {"depth": 1.0, "layers": 2}, SIDES | {"depth": POSITIVE, "layers": WHOLE}),
    (
        geometry.ring,
        {"outer": 1.0, "inner": 0.5, "around": 8, "across": 1},
        {"outer": POSITIVE, "inner": POSITIVE, "around": WHOLE, "across": WHOLE, "lowest": VECTOR},
    ),
    (
        geometry.half_ball,
        {"radius": 1.0},
        {
            "radius": POSITIVE,
            "part": WORD,
            "refinements": WHOLE,
            "inner_half_width": [*optional(POSITIVE), 2.0],
        },
    ),
    (
        geometry.half_cylinder,
        {"radius": 1.0},
        {
            "radius": POSITIVE,
            "columns": WHOLE,
            "layers": WHOLE,
            "spacing": optional(POSITIVE),
            "contact_half_width": optional(POSITIVE),
            "side": POSITIVE,
            "cell": WORD,
        },
    ),
    (
        geometry.half_cylinder_nested,
        {"radius": 1.0},
        {
            "radius": POSITIVE,
            "refinements": WHOLE,
            "inner_half_width": [*optional(POSITIVE), 2.0],
            "cell": WORD,
        },
    ),
    (
        geometry.half_cylinder_gmsh,
        {"radius": 1.0},
        {
            "radius": POSITIVE,
            "spacing": optional(POSITIVE),
            "largest": optional(POSITIVE),
            "contact_half_width": optional(POSITIVE),
            "cell": WORD,
        },
    ),
    (
        geometry.tread_block,
        BLOCK,
        {"blocks": [*BY_BLOCK, (1.5,)], "size": BY_BLOCK, "groove": BY_BLOCK}
        | {"height": POSITIVE, "base": POSITIVE, "spacing": POSITIVE},
    ),
    (geometry.join, {"grids": {"a": GRID}}, {"grids": [None, "a", [GRID], {}, {"a": None}, {"a": Grid}]}),
    (geometry.shifted, {"grid": GRID, "by": (0.0, 1.0)}, {"grid": [None, "a", Grid, 3], "by": VECTOR}),
    (
        Grid,
        {"points": GRID.points, "cells": GRID.cells, "cell": GRID.cell},
        {"points": [*ARRAY[:4], np.zeros(3)], "cells": ARRAY, "cell": WORD, "facets": ["a", 3.0]},
    ),
    (Body, {"facets": {}}, {"mesh": [None, "mesh", GRID]}),
    (Body.from_grid, {"grid": GRID}, {"grid": [None, "a", Grid, 3], "refinements": WHOLE}),
    (
        Of("body.mark"),
        {"name": "foot", "where": lambda x: x[1] < 0.1},
        {"where": [None, *FUNCTION], "name": [None, 3]},
    ),
    (Of("body.nearest_node"), {"point": (0.0, 0.0)}, {"point": VECTOR}),
    (Of("body.nodes"), {"name": "top"}, {"name": [None, 3, [], [3], "lid"]}),
    (
        BodyOnRoad,
        {"system": Of("system"), "facets": "bottom", "road": Plane()},
        {
            "system": [None, "a", 3],
            "facets": [None, 3, "tread", [None]],
            "road": ROAD,
            "friction": ["rough", NAN, -1.0, True, [0.1, 0.2], np.array([0.1]), INF, 1j],
            "reach": [*optional(ANY), -1.0],
        },
    ),
    (
        model.solve,
        {"contact": Of("contact")},
        {
            "contact": [None, "a", 3],
            "correction": WORD,
            "tolerance": [*POSITIVE, 1.0],
            "time": optional(ANY),
        },
    ),
    (
        all_of(model.follow),
        {"contact": Of("contact"), "steps": [1.0]},
        {
            "contact": [None, "a", 3],
            "steps": [None, 3, [NAN], ["late"], [True], [np.zeros(3)]],
            "tolerance": POSITIVE,
        },
    ),
    (
        model.other_answers,
        {"contact": Of("contact"), "solution": Of("solution")},
        {"contact": [None, "a", 3], "solution": [None, "a", 3], "tries": [*WHOLE, 0], "seed": WHOLE},
    ),
    (
        model.FiniteContact,
        {"contact": Of("finite")},
        {"contact": [None, "a", 3], "tolerance": [*POSITIVE, 1.0]},
    ),
    (
        all_of(Of("finite contact.follow")),
        {"times": [0.5, 1.0]},
        {"times": [None, 3, [NAN], ["late"], [0.0], [1.0, 0.5], [True]], "first": optional(POSITIVE)},
    ),
    (Of("finite contact.solve"), {"steps": 1}, {"steps": [*WHOLE, 0]}),
    *(
        (
            scheme,
            {"body": Of("moving"), "dt": 0.01},
            {"body": THING, "dt": POSITIVE, "tolerance": [*POSITIVE, 1.0]},
        )
        for scheme in (model.CentralDifferences, model.ContactStabilised, model.MassRedistribution)
    ),
    (
        model.Newmark,
        {"body": Of("moving"), "dt": 0.01},
        {"body": THING, "dt": POSITIVE, "beta": ANY, "gamma": ANY, "correction": WORD},
    ),
    (model.HHT, {"body": Of("moving"), "dt": 0.01}, {"dt": POSITIVE, "alpha": [*SOME, 0.5]}),
    (model.GeneralisedAlpha, {"body": Of("moving"), "dt": 0.01}, {"dt": POSITIVE, "rho": [*SOME, 1.5]}),
    *(
        (scheme, {"dt": 0.1} | {"body": Of("finite body")}, {"body": THING, "dt": POSITIVE})
        for scheme in (model.EnergyMomentum, model.LosslessContact)
    ),
    (
        Of("scheme.start"),
        {"velocity": np.zeros((15, 2))},
        {"displacement": optional(DISPLACEMENTS), "velocity": optional(DISPLACEMENTS)},
    ),
    (Of("scheme.run"), {"state": Of("state"), "steps": 1}, {"steps": WHOLE, "state": [None, 3, "rest"]}),
    (
        all_of(model.integrate),
        {"integrator": Of("scheme"), "state": Of("state"), "steps": 1},
        {"state": [None, 3, "rest"], "steps": WHOLE, "integrator": [None, 3], "every": WHOLE},
    ),
    (
        model.History,
        {"integrator": Of("scheme"), "state": Of("state")},
        {"integrator": [None, 3, "a"], "state": [None, 3, "a"], "points": ["A", 3, {"A": 99}, {"A": "top"}]},
    ),
    (
        model.HertzCylinder,
        {"P": 1.0, "R": 1.0, "E": 1.0, "nu": 0.3},
        {"P": POSITIVE, "R": POSITIVE, "E": POSITIVE, "nu": ANY},
    ),
    (
        model.HertzSphere,
        {"F": 1.0, "R": 1.0, "E": 1.0, "nu": 0.3},
        {"F": POSITIVE, "R": POSITIVE, "E": POSITIVE, "nu": ANY},
    ),
    *(
        (
            kind,
            {"normal": HERTZ, "Q": 0.1, "mu": 0.5},
            {"normal": [None, 1.0, SPHERE], "Q": SOME, "mu": POSITIVE},
        )
        for kind in (model.MindlinCylinder, model.Carter)
    ),
    (
        model.MindlinSphere,
        {"normal": SPHERE, "Q": 0.1, "mu": 0.5},
        {"normal": [None, 1.0, HERTZ], "Q": SOME, "mu": POSITIVE},
    ),
    (model.Spence, {"normal": HERTZ, "mu": 0.5}, {"normal": [None, 1.0, SPHERE], "mu": POSITIVE}),
    (model.RodImpact, {}, {"L": POSITIVE, "E": POSITIVE, "rho": POSITIVE}),
    (model.effective_modulus, {"E": 1.0, "nu": 0.3}, {"E": POSITIVE, "nu": [*ANY, -1.0]}),
    (model.dundurs_beta, {"nu": 0.3}, {"nu": [*ANY, -1.0]}),
    (model.goodman_stick_ratio, {"mu": 0.3, "nu": 0.3}, {"mu": POSITIVE, "nu": [*ANY, -1.0]}),
    (model.coulomb, {"mu": 0.3}, {"mu": ["rough", None, NAN, INF, -1.0, True, 1j]}),
    (
        model.viscous,
        {"mu": 0.3, "viscosity": 1.0},
        {"mu": ["rough", None, NAN, -1.0, True], "viscosity": ["thick", None, NAN, -1.0, True]},
    ),
    (
        model.static_kinetic,
        {"mu_static": 0.3, "mu_kinetic": 0.1},
        {"mu_static": ["rough", None, NAN, -1.0, True], "mu_kinetic": ["rough", None, NAN, -1.0, True, 0.4]},
    ),
    (
        model.stribeck,
        {"mu_static": 0.3, "mu_kinetic": 0.1, "speed": 1.0},
        {"speed": ["fast", None, NAN, INF, 0.0, True], "viscosity": ["thick", None, NAN, -1.0, True]},
    ),
    (model.friction_law, {"function": lambda p, s, state: p}, {"function": [None, *FUNCTION]}),
    (
        Of("series.write"),
        {"time": 0.0, "nodes": {"u": np.zeros(15)}},
        {"time": ANY, "nodes": ["u", 3.0, [1.0], {"u": None}, {"u": "a"}]},
    ),
    (
        model.Series,
        {"path": "a.xdmf", "body": Of("body")},
        {"path": PATH, "body": [None, 3.0, "body"], "resume_at": optional(ANY)},
    ),
    (
        model.write_xdmf,
        {"path": "b.xdmf", "body": Of("body"), "nodes": {}},
        {"path": PATH, "body": [None, 3.0, "body"], "nodes": ["u", 3.0, [1.0], {"u": "a"}]},
    ),
    (
        model.write_road,
        {"path": "c.xdmf", "road": Plane(), "around": np.eye(2)},
        {"path": PATH, "road": ROAD, "around": ARRAY, "times": [3.0, [NAN], ["late"]]},
    ),
    (
        model.save_checkpoint,
        {"path": "run.npz", "integrator": Of("scheme"), "state": Of("state")},
        {"integrator": [None, 3], "state": [None, 3]},
    ),
    (model.load_checkpoint, {"path": "run.npz"}, {"integrator": [None, 3]}),
    (HERTZ.pressure, {"x": 0.0}, {"x": ARRAY[:4]}),
    (SPHERE.pressure, {"r": 0.0}, {"r": ARRAY[:4]}),
    *(
        (kind(HERTZ, 0.1, 0.5).traction, {"x": 0.0}, {"x": ARRAY[:4]})
        for kind in (model.MindlinCylinder, model.Carter)
    ),
    (model.MindlinSphere(SPHERE, 0.1, 0.5).traction, {"r": 0.0}, {"r": ARRAY[:4]}),
    (model.Spence(HERTZ, 0.5).traction, {"x": 0.0}, {"x": ARRAY[:4]}),
    (model.RodImpact().displacement, {"x": 0.5, "t": 0.0}, {"x": ARRAY[:4], "t": ARRAY[:4]}),
    (model.write_vtkhdf, {"path": "d.xdmf"}, {"path": PATH}),
    (Of("contact.reactions"), {"solution": Of("solution")}, {"about": optional(VECTOR)}),
    (
        model.linear_limits,
        {"gradient": np.zeros((1, 2, 2))},
        {"gradient": ["a", None, np.zeros(3), NAN * np.eye(2)[None]]},
    ),
]


# What computations return, and what draws.
NOT_TRIED = {"HalfWidth", "Solution", "System", "body_picture", "bounce_figure", "contact_map", "film"}
NOT_TRIED |= {"convergence_figure", "cut_figure", "mesh_figure", "pressure_figure", "stick_slip_figure"}
NEED_FILES = {
    "read_mesh",
    "read_msh",
    "read_samples",
    "read",
    "read_topography",
    "write_vtkhdf",
    "load_checkpoint",
}
NEED_MORE = {"samples_of", "Body", "half_cylinder_gmsh"}  # or time
ALSO_CALLED = {  # in sentences
    "r": "x|r",
    "nu": "Poisson's ratio", "where": "name|node|condition|boundary", "steps": "time|load",
    "name": "boundary",
    "index": "node",
    "facets": "boundary|name", "friction": "mu", "directions": "direction", "roads": "road",
    "nodes": "field",
    "positions": "sample|position", "heights": "height|sample",
}  # fmt: skip


def called(door):
    return str(door).rpartition(".")[2] if isinstance(door, Of) else door.__name__


def found(arguments):
    return {name: value.found if isinstance(value, Of) else value for name, value in arguments.items()}


@pytest.fixture(scope="module", autouse=True)
def elsewhere(tmp_path_factory):
    with chdir(tmp_path_factory.mktemp("doors")):
        yield


@pytest.mark.parametrize(("door", "right"), [d[:2] for d in DOORS], ids=[called(d[0]) for d in DOORS])
def test_right_arguments_pass(door, right):
    if called(door) not in NEED_FILES | NEED_MORE:
        door(**found(right))


CASES = [(door, right, name, values) for door, right, wrong in DOORS for name, values in wrong.items()]


@pytest.mark.parametrize(
    ("door", "right", "name", "values"), CASES, ids=[f"{called(c[0])}-{c[2]}" for c in CASES]
)
def test_wrong_arguments_are_refused_in_one_sentence(door, right, name, values):
    lacking = []
    for value in values:
        said = complaint(lambda value=value: door(**(found(right) | {name: value})), name, value)
        if said:
            lacking.append(f"{name}={value!r}: {said}")
    assert not lacking, "\n".join(lacking)


def complaint(call, name, value):
    """What is wrong with how a wrong argument is refused; nothing where all is right."""
    try:
        call()
    except (TypeError, ValueError) as error:
        sentence, trace = str(error), error.__traceback__
    except Exception as error:
        return f"{type(error).__name__}: {error}"
    else:
        return "is taken"
    while trace.tb_next:
        trace = trace.tb_next
    if not Path(trace.tb_frame.f_code.co_filename).is_relative_to(HOUSE):
        return f"is refused by {trace.tb_frame.f_code.co_filename}: {sentence}"
    if not sentence.endswith(".") or "\n" in sentence:
        return f"no sentence: {sentence}"
    if not re.search(rf"\b({name}|{ALSO_CALLED.get(name, name)})", sentence, re.IGNORECASE):
        return f"its name is missing: {sentence}"
    shown = any(part in sentence for part in shown_as(value))
    return "" if shown else f"its value is missing: {sentence}"


def shown_as(value):
    """How a sentence may repeat a value, or the part of it that is wrong."""
    kind = value.__name__ if isinstance(value, type) else type(value).__name__
    yield from (" ".join(repr(value).split()), kind, str(getattr(value, "shape", kind)))
    if isinstance(value, np.ndarray) and value.dtype.kind == "f" and not np.isfinite(value).all():
        yield from ("nan", "not finite")
    if callable(value):
        yield "(0) is"  # what it returns at time 0
    if isinstance(value, list | tuple | dict):
        for part in value.values() if isinstance(value, dict) else value:
            yield from shown_as(part)


def test_every_number_that_a_constructor_takes_is_tried():
    tried = {(getattr(door, "__wrapped__", door), name) for door, _, wrong in DOORS for name in wrong}
    lacking = []
    for package in (geometry, forms, model):
        for public in package.__all__:
            thing = getattr(package, public)
            if not (inspect.isclass(thing) or inspect.isfunction(thing)) or public in NOT_TRIED:
                continue
            for name, parameter in parameters(thing):
                if (
                    re.search(r"(?<!\[)\b(float|int)\b", str(parameter.annotation))
                    and (thing, name) not in tried
                ):
                    lacking.append(f"{public}({name}: {parameter.annotation})")
    assert not lacking, "\n".join(lacking)


def parameters(thing):
    try:
        return [(n, p) for n, p in inspect.signature(thing).parameters.items() if p.kind != p.VAR_KEYWORD]
    except ValueError:  # a warning's
        return []
