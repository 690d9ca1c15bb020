"""What public functions ask of their arguments; one sentence for a wrong one, with its name and its value."""

import os
from collections.abc import Mapping, Sequence
from numbers import Integral, Real
from pathlib import Path
from typing import Any

import numpy as np

FEW = 3  # numbers of an array that a sentence repeats
LONGEST = 80  # characters of a value that it repeats


def number(value: Any) -> float:
    """Return a real number as a float; NaN for what is none, truth values and text too.

    Examples
    --------
    >>> number(3), number("3"), number(True)
    (3.0, nan, nan)
    """
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value[()]
    if not isinstance(value, Real) or isinstance(value, bool):
        return np.nan
    try:
        return float(value)
    except OverflowError:
        return np.inf


def said(value: Any) -> str:
    """Return how a sentence repeats a value: as it is written, if that is short, else its type and shape.

    Examples
    --------
    >>> said("steel"), said(np.zeros((9, 2))), said([0.0] * 99)
    ("'steel'", 'an array of shape (9, 2)', 'a list of length 99')
    """
    if isinstance(value, np.ndarray) and value.size > FEW:
        return f"an array of shape {value.shape}"
    text = " ".join(repr(value.item() if isinstance(value, np.generic) else value).split())
    if len(text) <= LONGEST and " at 0x" not in text:
        return text
    return f"a {type(value).__name__}" + (f" of length {len(value)}" if hasattr(value, "__len__") else "")


def refused(name: str, wanted: str, value: Any) -> ValueError:
    """Return the error that says what an argument must be, and is."""
    return ValueError(f"{name} is {said(value)}; it must be {wanted}.")


def finite(**values: Any) -> None:
    """Refuse any named value that is not a finite number.

    Raises
    ------
    ValueError
        Naming the argument and its value, as all checks do.
    """
    for name, value in values.items():
        if not np.isfinite(number(value)):
            raise refused(name, "a finite number", value)


def positive(**values: Any) -> None:
    """Refuse any named value that is not a finite number above zero (ValueError)."""
    for name, value in values.items():
        if not 0 < number(value) < np.inf:
            raise refused(name, "a finite number greater than 0", value)


def not_negative(**values: Any) -> None:
    """Refuse any named value that is not a finite number of zero or more (ValueError)."""
    for name, value in values.items():
        if not 0 <= number(value) < np.inf:
            raise refused(name, "a finite number >= 0", value)


def between(low: float, high: float, **values: Any) -> None:
    """Refuse any named value that is not a number from `low` to `high`, both allowed (ValueError)."""
    for name, value in values.items():
        if not low <= number(value) <= high:
            raise refused(name, f"a number from {low:g} to {high:g}", value)


def whole(least: int, **values: Any) -> None:
    """Refuse any named value that is not a whole number of at least so much (ValueError)."""
    for name, value in values.items():
        if not (isinstance(value, Integral) and least <= number(value)):
            raise refused(name, f"a whole number >= {least}", value)


def one_of(choices: Sequence[str], **values: Any) -> None:
    """Refuse any named value that is none of some words (ValueError)."""
    for name, value in values.items():
        if not (isinstance(value, str) and value in choices):
            raise refused(name, "one of " + ", ".join(map(repr, choices)), value)


def instance(kind: type, **values: Any) -> None:
    """Refuse any named value that is not of a type (ValueError)."""
    for name, value in values.items():
        if not isinstance(value, kind):
            raise refused(name, f"a {kind.__name__}", value)


def function(**values: Any) -> None:
    """Refuse any named value that cannot be called (ValueError)."""
    for name, value in values.items():
        if not callable(value):
            raise refused(name, "a function", value)


def is_path(path: Any) -> Path:
    """Return the path of a file, or refuse what is none (ValueError)."""
    if not isinstance(path, str | os.PathLike) or not os.fspath(path):
        raise refused("path", "the name of a file", path)
    return Path(path)


def named(name: str, values: Any) -> Mapping[str, Any]:
    """Return a mapping from names, an empty one for None, or refuse what is none (ValueError)."""
    if values is None:
        return {}
    if not (isinstance(values, Mapping) and all(isinstance(key, str) for key in values)):
        raise refused(name, "a dictionary of names", values)
    return values


def numbers(name: str, values: Any) -> np.ndarray:
    """Return real numbers as an array of floats of any shape, or refuse them (ValueError).

    Examples
    --------
    >>> numbers("heights", [1, 2.5])
    array([1. , 2.5])
    """
    try:
        found = np.asarray(values)
    except ValueError:  # rows of different lengths
        raise refused(name, "an array of numbers", values) from None
    if found.dtype.kind not in "iuf":
        raise refused(name, "numbers", values)
    return found.astype(float, copy=False)


def whole_numbers(name: str, values: Any) -> np.ndarray:
    """Return whole numbers as an array of integers of any shape, or refuse them (ValueError)."""
    found = numbers(name, values)
    if (found != np.floor(found)).any() or not np.isfinite(found).all():
        raise refused(name, "whole numbers", values)
    return found.astype(np.int64)


def finite_numbers(name: str, values: Any) -> np.ndarray:
    """Return finite numbers as an array of floats of any shape, or refuse them (ValueError)."""
    found = numbers(name, values)
    if not np.isfinite(found).all():
        raise ValueError(f"{name} holds {found[~np.isfinite(found)][0]}, but every value must be finite.")
    return found


def array(name: str, values: Any, shape: tuple[int, ...]) -> np.ndarray:
    """Return finite numbers of some shape as an array, or refuse them (ValueError)."""
    found = numbers(name, values)
    if found.shape != shape:
        raise refused(name, f"an array of shape {shape}", found)
    return finite_numbers(name, found)


def vector(name: str, values: Any, *sizes: int) -> np.ndarray:
    """Return so many finite numbers as an array (size,), or refuse them (ValueError).

    Examples
    --------
    >>> vector("shift", (0, 1), 2, 3)
    array([0., 1.])
    """
    wanted = " or ".join(map(str, sizes)) + " finite numbers"
    try:
        found = numbers(name, values)
    except ValueError:
        raise refused(name, wanted, values) from None
    if found.shape not in [(size,) for size in sizes] or not np.isfinite(found).all():
        raise refused(name, wanted, values)
    return found


def is_tolerance(tolerance: float) -> None:
    """Refuse a tolerance that is no part of the forces at work.

    Raises
    ------
    ValueError
        With its value.
    """
    if not 0 < number(tolerance) < 1:
        raise ValueError(
            f"tolerance is {said(tolerance)}, but what may be missing of equilibrium is a part of the "
            "forces at work, a number between 0 and 1."
        )


def poisson_ratio(nu: float, highest: float = 0.5) -> None:
    """Refuse a Poisson's ratio outside -1 < nu <= `highest`.

    Raises
    ------
    ValueError
        Naming the value.
    """
    if not -1 < number(nu) <= highest:
        raise ValueError(f"nu must be greater than -1 and at most {highest:g}, not {said(nu)}.")


def node_numbers(nodes: Any) -> np.ndarray:
    """Return numbers of nodes, (n,), or refuse masks and fractions, which would pass for other nodes.

    Raises
    ------
    ValueError
        Naming their type.
    """
    nodes = np.asarray(nodes).ravel()
    if nodes.size and nodes.dtype.kind not in "iu":
        raise ValueError(
            f"contact_nodes are of type {nodes.dtype}, but nodes are named by whole numbers; of a mask take "
            "np.flatnonzero(mask)."
        )
    return nodes.astype(np.int64)


def is_road(road: Any) -> None:
    """Refuse what is no road, a class of roads too.

    Raises
    ------
    ValueError
        Naming its type.
    """
    if isinstance(road, type):
        raise ValueError(f"The road is the class {road.__name__}; give a road of it, {road.__name__}(...).")
    if not (hasattr(road, "closest") or hasattr(road, "at")):
        raise ValueError(
            f"The road is of type {type(road).__name__}; give one of geometry's, say Plane(), "
            "SeveralRoads(...) of some, or whatever has closest(points); files and arrays become roads by "
            f"read_samples, LinearRoad, SurfaceRoad and their like. It was {said(road)}."
        )


def nearest(road: Any, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return gap (n,), normal and nearest point (n, dim) that a road has for points (n, dim), if it has such.

    Raises
    ------
    ValueError
        Saying what a road, maybe the user's own, returns instead.
    """
    found = road.closest(points)
    wanted = [points.shape[:1], points.shape, points.shape]
    shapes = [np.shape(part) for part in found] if isinstance(found, tuple | list) else found
    if shapes != wanted:
        raise ValueError(
            f"closest(points) of the road, a {type(road).__name__}, returns {said(found)}; it must return "
            f"gap, normal and nearest point of shapes {wanted[0]}, {wanted[1]} and {wanted[2]}."
        )
    return found[0], found[1], found[2]


def is_contact(contact: Any) -> None:
    """Refuse what is neither a body on a road nor a contact problem.

    Raises
    ------
    TypeError
        Naming its type.
    """
    if not hasattr(contact, "problem"):
        raise TypeError(
            f"The contact is a {type(contact).__name__}; give BodyOnRoad(system, facets, road), or a "
            "ContactProblem."
        )


def tangential_load(Q: float, limit: float) -> None:
    """Refuse a tangential force that friction cannot hold: 0 <= Q <= mu P is what it takes.

    Raises
    ------
    ValueError
        Naming the force and the limit.
    """
    if not 0 <= number(Q) <= limit:
        raise ValueError(
            f"Q must lie between 0 and mu P = {limit:g}, not {said(Q)}; beyond it the body slides."
        )
