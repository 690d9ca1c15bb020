"""Platens that tilt by small angles: one more node each, whose displacement is the angle times a length.

A node of such a platen moves with its centre and turns about it, u = u_P + phi x r, phi = q / L: a linear map
from the unknowns of the system to those of the body, under which matrices and loads go over. L is the
platen's own size, so that q is a displacement like others.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sparse

from checks import finite

Angle = bool | float | Callable[[float], float]


class Tilting(NamedTuple):
    """A platen that tilts.

    Attributes
    ----------
    name : of the boundary, for messages
    nodes : (k,) nodes of the body
    arm : (k, dim) from the platen's centre to them
    size : L
    angles : about z in the plane, about x, y, z in space: True where it tilts as forces will, False where it
        does not, else the angle in radians, or a function of the time (or load parameter) that returns it
    """

    name: str
    nodes: np.ndarray
    arm: np.ndarray
    size: float
    angles: Sequence[Angle]


def tilting(name: str, nodes: np.ndarray, points: np.ndarray, tilt: Angle | Sequence[Angle]) -> Tilting:
    """Check what is said of a platen of nodes (k,) at points (k, dim)."""
    dim = points.shape[1]
    count = 2 * dim - 3
    angles: list[Any] = list(tilt) if isinstance(tilt, list | tuple) else [tilt]
    if tilt is True:
        angles *= count
    if len(angles) != count:
        raise ValueError(
            f"The platen {name!r} is to tilt by {tilt!r}; give True, or "
            f"{'one angle' if dim == 2 else 'three angles, about x, y and z'}."
        )
    for angle in angles:
        if not (callable(angle) or isinstance(angle, bool)):
            finite(tilt=angle)
    arm = points - points.mean(axis=0)
    return Tilting(name, nodes, arm, float(np.linalg.norm(arm, axis=1).max()), angles)


def prescribed_angles(platen: Tilting, time: float) -> np.ndarray:
    """Displacements (dim,) of the platen's own node, NaN where it tilts as forces will."""
    dim = platen.arm.shape[1]
    value = np.zeros(dim)
    for component, angle in enumerate(platen.angles):
        if angle is True:
            value[component] = np.nan
        elif angle is not False:
            value[component] = platen.size * (angle(time) if callable(angle) else angle)
    return value


def spreading(node_of: np.ndarray, platens: Sequence[Tilting]) -> sparse.bsr_array:
    """The map (N dim, R dim) from displacements of the system, whose last nodes are the platens' own.

    Parameters
    ----------
    node_of : (N,) node of the system that each node of the body moves with
    """
    dim, N = platens[0].arm.shape[1], len(node_of)
    first = int(node_of.max()) + 1
    rows, columns, blocks = [np.arange(N)], [node_of], [np.tile(np.eye(dim), (N, 1, 1))]
    for number, platen in enumerate(platens, start=first):
        rows.append(platen.nodes)
        columns.append(np.full(len(platen.nodes), number))
        blocks.append(_turns(platen.arm) / platen.size)
    at = np.concatenate(rows)
    order = np.argsort(at, kind="stable")
    indptr = np.concatenate([[0], np.cumsum(np.bincount(at, minlength=N))])
    data, indices = np.concatenate(blocks)[order], np.concatenate(columns)[order]
    return sparse.bsr_array((data, indices, indptr), shape=(N * dim, (first + len(platens)) * dim))


def _turns(arm: np.ndarray) -> np.ndarray:
    """Blocks (k, dim, dim) that make displacements of small angles; in the plane of the first component."""
    k, dim = arm.shape
    blocks = np.zeros((k, dim, dim))
    if dim == 2:
        blocks[:, 0, 0], blocks[:, 1, 0] = -arm[:, 1], arm[:, 0]
        return blocks
    for a, b, c in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):  # e_a x r: along e_c by r_b, against e_b by r_c
        blocks[:, c, a], blocks[:, b, a] = arm[:, b], -arm[:, c]
    return blocks
