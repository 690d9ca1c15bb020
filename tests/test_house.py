"""The walls of the house: who may import whom, and what a public name owes its reader."""

import ast
import importlib
import inspect
import subprocess
import sys
from pathlib import Path

import pytest

HOUSE = Path(__file__).parents[1]
ALLOWED = {"geometry": set(), "forms": {"geometry"}, "model": set()}
FILES = [file.relative_to(HOUSE) for package in ALLOWED for file in (HOUSE / package).glob("*.py")]


@pytest.mark.parametrize("file", FILES, ids=str)
def test_imports_run_one_way(file):
    imported = set()
    for node in ast.walk(ast.parse((HOUSE / file).read_text())):
        if isinstance(node, ast.Import):
            imported.update(alias.name.split(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and not node.level:
            imported.add(node.module.split(".")[0])
    package = file.parts[0]
    assert imported & {*ALLOWED, "demos"} <= {package, *ALLOWED[package]}


def test_the_contact_loop_needs_no_dolfinx():
    code = "import sys, model; sys.exit('dolfinx' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code]).returncode == 0


def public_functions():
    for package in ALLOWED:
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
