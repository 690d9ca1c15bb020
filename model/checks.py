"""Input checks that many share: one sentence a wrong argument."""

from numbers import Real
from typing import Any

import numpy as np


def positive(**values: float) -> None:
    """Refuse any named value that is not a finite number above zero.

    Raises
    ------
    ValueError
        Naming the argument and its value.
    """
    for name, value in values.items():
        if not (isinstance(value, Real) and np.isfinite(value) and value > 0):
            raise ValueError(f"{name} must be a finite number greater than 0, not {value!r}.")


def is_tolerance(tolerance: float) -> None:
    """Refuse a tolerance that is no part of the forces at work.

    Raises
    ------
    ValueError
        With its value.
    """
    if not (isinstance(tolerance, Real) and 0 < tolerance < 1):
        raise ValueError(
            f"tolerance is {tolerance!r}, but what may be missing of equilibrium is a part of the forces at "
            "work, a number between 0 and 1."
        )


def poisson_ratio(nu: float, highest: float = 0.5) -> None:
    """Refuse a Poisson's ratio outside -1 < nu <= `highest`.

    Raises
    ------
    ValueError
        Naming the value.
    """
    if not (isinstance(nu, Real) and -1 < nu <= highest):
        raise ValueError(f"nu must be greater than -1 and at most {highest:g}, not {nu!r}.")


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
            "read_samples, LinearRoad, SurfaceRoad and their like."
        )


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
    if not (isinstance(Q, Real) and 0 <= Q <= limit):
        raise ValueError(f"Q must lie between 0 and mu P = {limit:g}, not {Q!r}; beyond it the body slides.")
