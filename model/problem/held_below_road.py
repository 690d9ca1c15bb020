"""Supports that hold a node below the road: what is then said."""

from typing import Any

import numpy as np

UNMOVED = 1e-8  # square root of rounding: what is free of the normal of a node that cannot move along it


def below_road(node: int, displacement: np.ndarray, depth: float, when: str = "") -> str:
    """Say that a node is prescribed a displacement (d,) by which it is so far below the road."""
    there = ", ".join(f"{x:.6g}" for x in displacement)
    return (
        f"Node {node} is prescribed the displacement ({there}){when}, which is {depth:g} below the road; "
        "prescribe one that leaves it above, or leave it free."
    )


def held_below_road(
    road: Any, at: np.ndarray, nodes: np.ndarray, held: np.ndarray, u: np.ndarray, near: float, when: str
) -> str:
    """Say which node supports hold below a road, if they do.

    Parameters
    ----------
    road : Road
    at : (k, d)
        Where the nodes are.
    nodes : (k,)
        Their numbers.
    held : (k, d)
        Which of their unknowns are prescribed.
    u : (k, d)
        Their displacements.
    near : float
        Depth that is rounding.
    when : str
        In words.

    Examples
    --------
    >>> from geometry import Plane
    >>> below = np.array([[0.0, -0.1]])
    >>> held_below_road(Plane(), below, np.array([7]), below != 0.0, below, 1e-12, " at time 2")[:60]
    'Node 7 is prescribed the displacement (0, -0.1) at time 2, w'
    """
    gap, normal, _ = road.closest(at)
    still = np.linalg.norm(np.where(held, 0.0, normal), axis=1) < UNMOVED
    depth = np.where(still, -gap, 0.0)
    worst = int(np.argmax(depth)) if depth.size else -1
    if worst < 0 or not depth[worst] > near:
        return ""
    return below_road(int(nodes[worst]), u[worst], float(depth[worst]), when)
