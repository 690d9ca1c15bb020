"""The walls of the house: who may import whom, and what a public name owes its reader."""

import ast
import importlib
import inspect
import subprocess
import sys
from pathlib import Path

import pytest

HOUSE = Path(__file__).parents[1]
ANYWHERE = {"checks", "model.atomic_file", "model.one_rank", "model.tolerances"}
# What each room may import of the others, floor by floor; what is not named here is forbidden.
ROOMS = {
    "geometry": set(),
    "geometry.meshes": {"geometry"},
    "geometry.obstacles": {"geometry.meshes"},
    "forms": {"geometry"},
    "model.node_loop": set(),
    "model.closed_forms": set(),
    "model.problem": {"model.node_loop"},
    "model.solvers": {"model.node_loop", "model.problem"},
    "model.curved": {"model.node_loop"},
    "model.ranks": {"model.node_loop", "model.problem", "model.solvers"},
    "model.quasistatics": {
        "model.node_loop",
        "model.problem",
        "model.solvers",
        "model.curved",
        "model.ranks",
    },
    "model.dynamics": {
        "model.node_loop",
        "model.problem",
        "model.solvers",
        "model.curved",
        "model.ranks",
        "model.quasistatics",
    },
    "model.finite_strain": {
        "model.node_loop",
        "model.problem",
        "model.solvers",
        "model.curved",
        "model.dynamics",
    },
    "model.recording": {"model.node_loop", "model.solvers", "model.dynamics"},
    "model.results": {"model.node_loop", "model.problem", "model.solvers", "model.ranks"},
    "model.figures": {"model.node_loop", "model.recording", "model.results"},
}
PACKAGES = {"geometry", "forms", "model"}
FILES = sorted(file.relative_to(HOUSE) for package in PACKAGES for file in (HOUSE / package).rglob("*.py"))


def room_of(module):
    """The longest name of a room that begins the module's."""
    parts = module.split(".")
    names = (".".join(parts[:k]) for k in range(len(parts), 0, -1))
    return next((name for name in names if name in ROOMS), module)


def imported_by(file):
    for node in ast.walk(ast.parse((HOUSE / file).read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert not node.level, "imports name the whole way"
            yield node.module


@pytest.mark.parametrize("file", FILES, ids=str)
def test_imports_run_one_way(file):
    module = ".".join(file.with_suffix("").parts).removesuffix(".__init__")
    imported = [name for name in imported_by(file) if name.split(".")[0] in {*PACKAGES, "demos", "harness"}]
    if module in PACKAGES:  # the door of a package shows what its rooms have
        assert {name.split(".")[0] for name in imported} <= {module}
        return
    room = room_of(module)
    for name in imported:
        assert name in ANYWHERE or room_of(name) in {room, *ROOMS[room]}, f"{room} must not import {name}"


def test_no_circle_of_rooms():
    seen = set()
    while len(seen) < len(ROOMS):
        free = {room for room, allowed in ROOMS.items() if room not in seen and allowed <= seen}
        assert free, f"a circle among {set(ROOMS) - seen}"
        seen |= free


def test_the_contact_loop_needs_neither_dolfinx_nor_mpi():
    code = "import sys, model; sys.exit('dolfinx' in sys.modules or 'mpi4py' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code]).returncode == 0


def public_functions():
    for package in sorted(PACKAGES):
        module = importlib.import_module(package)
        for name in module.__all__:
            thing = getattr(module, name)
            if inspect.isfunction(thing):
                yield f"{package}.{name}", thing
            elif inspect.isclass(thing):
                for method, function in vars(thing).items():
                    if inspect.isfunction(function) and not method.startswith("_"):
                        yield f"{package}.{name}.{method}", function


def test_public_functions_have_docstrings_and_types():
    lacking = []
    for name, function in public_functions():
        if not function.__doc__:
            lacking.append(f"{name}: docstring")
        signature = inspect.signature(function)
        if signature.return_annotation is inspect.Signature.empty:
            lacking.append(f"{name}: type of what it returns")
        for parameter in signature.parameters.values():
            if parameter.name != "self" and parameter.annotation is inspect.Parameter.empty:
                lacking.append(f"{name}: type of {parameter.name}")
    assert not lacking
