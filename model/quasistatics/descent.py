"""How far to go to a solution on planes, where the road itself is curved: the exact penalty function falls.

A step goes to the solution on planes, or only a part of the way, so that

    phi(u) = 1/2 u.A u - b.u + sum bound |slip| + nu sum max(0, -g(u))                                  (1)

falls: sequential quadratic programming of S. P. Han, J. Optim. Theory Appl. 22 (1977), with the penalty of
M. J. D. Powell, Math. Program. 14 (1978), which follows the pressures. It asks no more than these of a node
below the road, so that a hard body under a light load may go as far as its planes are true. In corners, and
wherever the penalty stops good steps, nodes below the road are put on it: a second-order correction. Without
friction a way that leads up is not gone. Where hills count in the stiffness, (1) need not fall before the
next iteration has brought the nodes down to the road, so that whole steps are relaxed (the watchdog
technique, R. M. Chamberlain et al., Math. Program. Study 16 (1982)).
"""

import numpy as np

from model.curved.tangent_planes import RoadPlanes
from model.node_loop.blocks import defect
from model.node_loop.node_loop import NodeLoop, along_road
from model.problem.rigid_modes import RigidModes
from model.solvers.contact_solver import Solution

HALVINGS = 10  # of a step: a shorter one is worth no solve
ENOUGH = 1e-2  # of what the planes promise (Armijo)
ROUNDING = 1e-10  # of the energies at work
PENALTY = 1.5  # times the largest pressure; beyond 1 it is exact


class Descent:
    """Steps by which (1) falls.

    Parameters
    ----------
    loop : NodeLoop
    planes : RoadPlanes
    points : (n, d)
        Candidates at zero displacement.
    rigid : RigidModes or None
    """

    def __init__(self, loop: NodeLoop, planes: RoadPlanes, points: np.ndarray, rigid: RigidModes | None):
        self.loop, self.planes, self.points, self.rigid, self.penalty = loop, planes, points, rigid, 0.0

    def step(
        self, here: np.ndarray, solution: Solution, pull: np.ndarray, longest: float
    ) -> tuple[np.ndarray, float]:
        """Return where to go from `here` towards a solution, (N, d), and which part of the way that is.

        It is `here` if no part of the way lowers (1).

        Parameters
        ----------
        here : (N, d)
        solution : Solution
            On the planes, the loop's springs at rest at `here`.
        pull : (n, d)
            Forces of the springs at the solution.
        longest : float
            Part of the way that is the most. Up to the whole it is halved until (1) falls; beyond, where
            springs or hills have kept the step short and there is no friction, doubled as long as it falls.
        """
        loop, road = self.loop, self.planes.road
        nodes, p = loop.nodes, solution.pressure_force
        largest = PENALTY * float(p.max(initial=0.0))
        nu = self.penalty = max(largest, 0.5 * (self.penalty + largest))
        way = np.where(loop.uncoupled, 0.0, solution.displacement - here)
        start, move = self.points + here[nodes], way[nodes]
        resisted = self._times(way)
        stretch, work = float(np.vdot(way, resisted)), solution.contact_force + pull
        slope = float(np.vdot(work, move) - np.vdot(loop.R, way)) - stretch
        bound = np.asarray(loop.coefficient * p)

        def friction(at: np.ndarray, normal: np.ndarray) -> float:
            slip = np.linalg.norm(along_road(at - self.planes.anchor, normal), axis=1)
            return float(np.sum(bound * slip))

        def penalised(part: float) -> tuple[float, np.ndarray]:
            """What (1) changes by a part of the way, and which nodes (n,) are below then."""
            at = start + part * move
            gap, normal, _ = road.closest(at)
            under = np.maximum(-gap, 0.0)
            change = part * slope + 0.5 * part**2 * stretch + nu * under.sum() + friction(at, normal)
            return float(change) - before, under > 0.0

        gap, normal, _ = road.closest(start)
        rubs = friction(start, normal)
        before = rubs + nu * float(np.maximum(-gap, 0.0).sum())
        rubbed = friction(start + move, road.closest(start + move)[1])
        promised = slope + 0.5 * stretch + rubbed - before
        if self.planes.hills:
            promised += 0.5 * float(np.einsum("ca,cab,cb->", move, self.planes.springs, move))
        noise = ROUNDING * (abs(slope) + abs(stretch) + before) + nu * self.planes.near
        if promised > noise and loop.friction is None:
            return here, 0.0
        if self.planes.hills and longest >= 1.0:
            return solution.displacement, 1.0
        part = min(longest, 1.0)
        for _ in range(HALVINGS):
            change, under = penalised(part)
            enough = ENOUGH * part * promised + noise
            if promised > -noise or change <= enough:
                break
            at, left = start + part * move, -loop.R - (1.0 - part) * resisted
            left[nodes] += work
            back = self._back(at, under | (p > 0.0))
            change = part * slope + 0.5 * part**2 * stretch
            change += friction(at + back[nodes], road.closest(at)[1])
            change += float(np.vdot(left, back) + 0.5 * np.vdot(back, self._times(back)))
            if change - before <= enough:
                return here + part * way + back, part
            part *= 0.5
        else:
            return here, 0.0
        sure = loop.friction is None and ENOUGH * promised < -noise
        while sure and 1.0 <= part <= 0.5 * longest:
            farther = penalised(2.0 * part)[0]
            if farther > change + ENOUGH * promised:
                break
            part, change = 2.0 * part, farther
        return solution.displacement if part == 1.0 else here + part * way, part

    def _back(self, at: np.ndarray, wanted: np.ndarray) -> np.ndarray:
        """The displacement (N, d) that puts nodes at (n, d) back on the road.

        First as a rigid body, which brings those `wanted` (n,) there as it can; then those still below.
        """
        loop, road, back = self.loop, self.planes.road, np.zeros(self.loop.shape)
        if self.rigid is not None and self.rigid.count:
            gap, normal, _ = (values[wanted] for values in road.closest(at))
            lift = np.einsum("ca,cam->cm", normal, self.rigid.at(self.rigid.nodes)[wanted])
            back += self.rigid.nearest(lift, -gap)
        gap, _, foot = road.closest(at + back[loop.nodes])
        under = np.where((gap < 0.0)[:, None], foot - at, back[loop.nodes])
        back[loop.nodes] = np.where(loop.uncoupled[loop.nodes], 0.0, under)
        return back

    def _times(self, way: np.ndarray) -> np.ndarray:
        """What the body, its springs apart, resists a way (N, d)."""
        product = np.zeros_like(way)
        defect(way.shape[1])(self.loop.A, product.copy(), way, product)
        if self.loop.springs is not None:
            nodes = self.loop.nodes
            product[nodes] += np.einsum("cab,cb->ca", self.loop.springs, way[nodes])
        return -product
