"""The way of a rigid body down to a road that is not flat, until it rests on it.

A body that nothing holds may start far from where the road will stop it, and planes at its nodes tell
little of the road there. So it is first moved as a rigid one, q being the amplitudes of its modes: each step
goes the way that friction and the nodes on the road leave to the load, as far as the planes of all nodes let
it,

    |q - way|  is least over  gap + n . Z q >= 0                                                       (1)

(least distance programming, C. L. Lawson and R. J. Hanson, Solving Least Squares Problems, 1974, ch. 23), and
steps are as long as the planes keep what they promise: a trust region.
"""

from typing import Any

import numpy as np

from model.node_loop.node_loop import along_road
from model.problem.nonnegative import nearest_admissible
from model.problem.rigid_modes import RigidModes

STEPS = 300
LONG = 0.25  # of the size: a step of a body on the road
AWAY = 1e3  # sizes that a body falls, or slides, before it is said to have left
FAR = 1e2  # and those beyond which it has left if it is not at rest after all steps
DEEP = 0.1  # of a step: who comes so far below the road has been misled by the planes
TRUE = 0.02  # and who does not even so much may go farther
FINE = 1e-10  # of the size: nodes that hold a body at rest are as near to the road
SMALL = 1e-9  # of the size: shorter steps lead nowhere


class CarriedOff(ValueError):
    """Says that a body has gone far in a motion, in words, and would go on."""

    def __init__(self, motion: str, travelled: float):
        super().__init__(
            f"The load carries the body off in {motion}: it has gone {travelled:.3g} without an end, and "
            "neither supports nor the road stop it; load it towards the road or fix it."
        )


def approach(
    road: Any,
    points: np.ndarray,
    rigid: RigidModes,
    b: np.ndarray,
    mu: Any,
    anchor: np.ndarray,
    size: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Move a body as a rigid one until it rests on a road.

    Parameters
    ----------
    road : Road
    points : (n, d)
        Where the candidates are.
    rigid : RigidModes
    b : (N, d)
        Load.
    mu : float or (n,)
        Coefficient of friction.
    anchor : (n, d)
        Points of the road where the candidates stick.
    size : float
        Of the body.

    Returns
    -------
    motion : (N, d)
    pressure : (n,)
        Forces that would hold the rigid body there.

    Raises
    ------
    CarriedOff
        If nothing stops it.
    """
    modes = rigid.at(rigid.nodes)
    unit = 1.0 / np.abs(modes).max()
    q, step, travelled, touching = np.zeros(rigid.count), LONG * size, 0.0, np.inf
    gap, normal, _ = road.closest(points)
    far = size + max(float(gap.max()), 0.0)
    for _ in range(STEPS):
        touching = min(touching, TRUE * step)
        near = gap <= touching
        slip = along_road(points + modes @ q - gap[:, None] * normal - anchor, normal)
        slip[np.linalg.norm(slip, axis=1) <= touching] = 0.0
        left = rigid.driven(b, normal, mu, near, slip)
        if not left.any() and gap.min() > -SMALL * size:
            if touching < FINE * size:
                break
            touching /= 4.0
            continue
        reach = LONG * (size + 0.1 * travelled)
        step = min(step, max(reach, float(gap.min())))
        work = np.einsum("cd,cdm->cm", normal, modes)
        way = step * unit / (np.abs(left).max() or 1.0) * left
        move = nearest_admissible(way, work, gap, step)
        there, next_normal, _ = road.closest(points + modes @ (q + move))
        length = float(np.abs(modes @ move).max())
        deep, before = -min(there.min(), 0.0), -min(gap.min(), 0.0)
        if length <= SMALL * size or deep > max(DEEP * length, 0.5 * before):
            step /= 4.0
            if step < SMALL * size:
                break
            continue
        if deep < TRUE * length:
            step *= 2.0
        q, gap, normal, travelled = q + move, there, next_normal, travelled + length
        if travelled > AWAY * far:
            raise CarriedOff(rigid.in_words(left), travelled)
    else:
        if np.abs(modes @ q).max() > FAR * far:
            raise CarriedOff(rigid.in_words(q), travelled)
    return (rigid.modes @ q).reshape(b.shape), rigid.holding(b, normal, gap <= touching)
