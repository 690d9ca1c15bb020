"""Friction that varies: by boundaries of the body, or by roads."""

from functools import partial
from typing import Any

import numpy as np

from model.node_loop.friction_laws import FrictionLaw, as_law


def placed(friction: Any, system: Any, nodes: np.ndarray, road: Any) -> FrictionLaw | None:
    """Return the law with parameters by boundaries as arrays, and those by roads as functions of places.

    Parameters
    ----------
    friction : FrictionLaw, or whatever `coulomb` takes
    system : forms.System
        Its body knows the names of boundaries.
    nodes : (n,)
        Candidates, as nodes of the space.
    road : Road

    Raises
    ------
    ValueError
        If boundaries are unknown or leave candidates out, or roads and values are not as many.
    """
    law = as_law(friction)
    return law if law is None else law.with_each(partial(_placed, system, nodes, road))


def _placed(system: Any, nodes: np.ndarray, road: Any, value: Any) -> Any:
    if isinstance(value, dict):
        return _by_boundary(system, nodes, value)
    return _by_road(road, value) if isinstance(value, list) else value


def _by_boundary(system: Any, nodes: np.ndarray, value: dict[str, float]) -> np.ndarray:
    if system.body is None:
        raise ValueError(
            "The friction is given by boundaries, but this mesh has no names; give an array with one value a "
            "candidate, or a function of places."
        )
    found = np.full(nodes.size, np.nan)
    for name, number in value.items():
        found[np.isnan(found) & np.isin(nodes, system.body.nodes(name))] = number
    if np.isnan(found).any():
        raise ValueError(
            f"The friction is given on {', '.join(map(repr, value))}, but {np.isnan(found).sum()} nodes that "
            "may touch lie on none of these boundaries; name all of the contact boundary."
        )
    return found


def _by_road(road: Any, value: list[float]) -> Any:
    roads = getattr(road, "roads", [road])
    if len(roads) != len(value):
        raise ValueError(
            f"The friction is a list of {len(value)} values, one a road, but there are {len(roads)} roads; "
            "give one for each of SeveralRoads, in their order."
        )
    if len(roads) == 1:
        return value[0]
    return lambda points: np.array(value)[road.which(points)]
