"""Every call in the table of formats and features names what is there, with arguments that it takes."""

import ast
import inspect
import re
from pathlib import Path

import forms
import geometry
import model

PAGE = Path(__file__).parents[1] / "demos" / "what_you_can_bring.md"
ROOMS = (model, geometry, forms)
OBJECTS = {"body": geometry.Body, "support": forms.Support, "contact": model.BodyOnRoad, "forms": forms}


def calls():
    cells = [text for text in re.findall(r"`([^`]*)`", PAGE.read_text()) if "(" in text]
    trees = [ast.parse(f"f({text})" if text.startswith("friction=") else text) for text in cells]
    return [node for tree in trees for node in ast.walk(tree) if isinstance(node, ast.Call)]


def found(name):
    if name in OBJECTS:
        return OBJECTS[name]
    return next((getattr(room, name) for room in ROOMS if hasattr(room, name)), None)


def called(function):
    if isinstance(function, ast.Name):
        return found(function.id)
    return getattr(found(function.value.id), function.attr) if isinstance(function.value, ast.Name) else None


def test_every_call_can_be_made():
    seen = 0
    for call in calls():
        if ast.unparse(call.func) in ("f", "np.linspace", "np.where"):
            continue
        target = called(call.func)
        if target is not None:
            parameters = inspect.signature(target).parameters
            assert {keyword.arg for keyword in call.keywords} <= set(parameters), ast.unparse(call)
            seen += 1
    assert seen > 30
