"""How far to go to a solution on planes, where the road itself is curved.

Far from the solution of the whole a full step may overshoot: a node goes beyond the corner of a groove along
one slope, and back beyond it along the other, for ever. A step is therefore halved as long as that lowers the
augmented Lagrangian of the problem on the road itself,

    L(u) = 1/2 u.A u - b.u + sum bound |slip| + sum ((p - rho g(u))_+^2 - p^2) / (2 rho),                (1)

p being the pressures, rho the nodes' own stiffness (R. T. Rockafellar, J. Optim. Theory Appl. 12 (1973) 555).
It has no kink at g = 0, so that it lets full steps of Newton's pass near the solution.
"""

from typing import Any

import numpy as np

from model.curved.tangent_planes import RoadPlanes
from model.node_loop.blocks import defect
from model.node_loop.node_loop import NodeLoop, along_road
from model.solvers.contact_solver import Solution

LEAST = 1e-3  # of a step
SLIGHT = 0.1  # of what its force moves a node: nodes that come nearer to the road have not overshot
ROUNDING = 1e-10  # of the energies at work


def part_of_step(
    loop: NodeLoop, planes: RoadPlanes, points: np.ndarray, here: np.ndarray, solution: Solution, pull: Any
) -> float:
    """Return the part of the step from `here` to a solution that lowers (1) most, of 1, 1/2, 1/4, ...

    Parameters
    ----------
    loop : NodeLoop
        With the matrix, springs and friction of the solution.
    planes : RoadPlanes
        On which the solution was found.
    points : (n, d)
        Candidates at zero displacement.
    here : (N, d)
        Displacement from which the step goes.
    solution : Solution
    pull : (n, d)
        Forces of the springs at the solution.
    """
    nodes, p, rho = loop.nodes, solution.pressure_force, 1.0 / planes.softness
    way = solution.displacement - here
    start, step = points + here[nodes], way[nodes]
    touches = solution.status > 0
    gap = planes.road.closest(start + step)[0]
    off = max(np.abs(gap[touches]).max(initial=0.0), -gap[~touches].min(initial=0.0))
    if off <= SLIGHT * float((p * planes.softness).max(initial=0.0)) or way[loop.uncoupled].any():
        return 1.0
    product = np.zeros_like(way)
    defect(way.shape[1])(loop.A, product.copy(), way, product)
    stretch = -float(np.vdot(way, product))
    if loop.springs is not None:
        stretch -= float(np.einsum("ca,cab,cb->", step, loop.springs, step))
    slope = float(np.vdot(solution.contact_force + pull, step)) - stretch
    bound = np.asarray(loop.coefficient * p)

    def lagrangian(part: float) -> float:
        at = start + part * step
        gap, normal, _ = planes.road.closest(at)
        slip = np.linalg.norm(along_road(at - planes.anchor, normal), axis=1)
        pressed = np.maximum(p - rho * gap, 0.0)
        barrier = float(np.sum((pressed**2 - p**2) / (2 * rho)) + np.sum(bound * slip))
        return part * slope + 0.5 * part**2 * stretch + barrier

    part, value = 1.0, lagrangian(1.0)
    noise = ROUNDING * (abs(slope) + abs(stretch) + abs(value))
    while part > LEAST and (half := lagrangian(0.5 * part)) < value - noise:
        part, value = 0.5 * part, half
    return part if value < lagrangian(0.0) + noise else 1.0
