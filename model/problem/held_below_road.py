"""Supports that hold a node below the road: what is then said."""

import numpy as np

UNMOVED = 1e-8  # square root of rounding: what is free of the normal of a node that cannot move along it


def held_below_road(
    gap: np.ndarray,
    normal: np.ndarray,
    nodes: np.ndarray,
    held: np.ndarray,
    u: np.ndarray,
    near: float,
    when: str = "",
) -> str:
    """Say which node supports hold below a road, if they do.

    Parameters
    ----------
    gap, normal : (k,), (k, d)
        Of the road where the nodes are.
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
    >>> u, up = np.array([[0.0, -0.1]]), np.array([[0.0, 1.0]])
    >>> held_below_road(u[:, 1], up, np.array([7]), up > 0.0, u, 1e-12, " at time 2")[:60]
    'Node 7 is prescribed the displacement (0, -0.1) at time 2, w'
    """
    below = np.flatnonzero(held_along(normal, held) & (gap < -near))
    if not below.size:
        return ""
    worst = below[np.argmin(gap[below])]
    there = ", ".join(f"{x:.6g}" for x in u[worst])
    return (
        f"Node {nodes[worst]} is prescribed the displacement ({there}){when}, which is {-gap[worst]:g} below "
        "the road; prescribe one that leaves it above, or leave it free."
    )


def held_along(normal: np.ndarray, held: np.ndarray) -> np.ndarray:
    """Which nodes (k,) cannot move along normals (k, d), for what is `held` (k, d) of them."""
    return np.asarray(np.linalg.norm(np.where(held, 0.0, normal), axis=1) < UNMOVED)
