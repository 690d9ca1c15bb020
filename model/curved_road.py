"""Contact with a road that is not flat: the same loop, on planes that follow the nodes along the road.

Each round solves the contact problem with these planes, and then lays them anew where the nodes have come
to be; it ends when every node that touches lies on the road itself and its force is along the road's
normal there. The planes touch the road, so the distance left falls with the square of the last move.

The force on a node turns as the node moves along the road, which its plane does not know. Where the road
is hollow the node therefore goes too far, and back, and so on for ever in a corner. So the road is looked
at from a little below each node that touches, by as much as its force would move it: seen from there a
hollow is less curved, by just what the turning force moves the node back, and the deepest point of a
corner is nearest to a whole wedge of nodes, with all the normals between those of its two slopes. (In
convex optimisation this is the projection x = P(x - f / k), k being the stiffness that the node feels.)
On a hill the same would do harm, so of the two looks, from the node and from below it, the one counts
that turns the normal less. What is left of creeping and overshooting Anderson's extrapolation removes.
"""

from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from .anderson import Anderson
from .contact_loop import FREE, SLIP, STICK
from .record import NotConverged, Record
from .solve import ContactSolver, Solution

ON_ROAD = 1e-12  # of the body's size: a node so near to the road is on it
SMOOTH = 0.1  # turns of the normals below which rounds are combined
ROUNDS = 200


class CurvedContact:
    """A contact problem on a curved road.

    >>> pressed = BodyOnRoad(elasticity, system, road, "arc")  # doctest: +SKIP
    >>> solution = CurvedContact(ContactSolver(pressed.problem), pressed.points).solve(road)  # doctest: +SKIP

    Parameters
    ----------
    solver : ContactSolver
        Of the problem with the road's normals and gaps at the start; what it keeps serves all rounds and
        loads.
    points : (n, d)
        Positions of the candidates at zero displacement.

    Attributes
    ----------
    normal, foot : (n, d)
        Normals and nearest points of the road at the last solution.
    distances : list of float
        After each round of the last solution, how far nodes that touched were from the road, or others
        below it.
    """

    def __init__(self, solver: ContactSolver, points: np.ndarray):
        self.solver, self.points = solver, np.asarray(points, dtype=np.float64)
        self.size = float(np.ptp(solver.problem.coordinates, axis=0).max())
        self.normal = solver.problem.normal
        self.foot = self.points - solver.problem.gap[:, None] * self.normal
        self.distances: list[float] = []

    def solve(
        self,
        road: Any,
        tangential_reference: np.ndarray | None = None,
        start: np.ndarray | None = None,
        tolerance: float = 1e-10,
        **options: Any,
    ) -> Solution:
        """Solve for one load and one place of the road.

        Parameters
        ----------
        road : Road
            Its `closest(points)` returns gap, normal and closest point.
        tangential_reference : (n, d), optional
            Displacement from which nodes stick: to the point of the road nearest to them then. Default
            the problem's. Where a road moves, add what it moved in the step.
        start : (N, d), optional
            First guess; default zero.
        tolerance : float
            Natural residual to reach; normals are found to ten times that.
        **options
            Further arguments of `ContactSolver.solve`, but `gap`.

        Returns
        -------
        Solution
            Its gaps are distances to the road itself; its sweeps, cycles, work and seconds are those of
            all rounds.

        Raises
        ------
        NotConverged
            If a round does not converge, or the rounds come to no end.
        """
        solver, points, nodes = self.solver, self.points, self.solver.problem.contact_nodes
        reference = (
            solver.problem.tangential_reference if tangential_reference is None else tangential_reference
        )
        anchor = road.closest(points + reference)[2]  # where nodes stick
        anchors = (road.closest(anchor)[1], anchor)
        _, self.normal, self.foot = road.closest(points if start is None else points + start[nodes])
        softness = 1.0 / np.einsum("caa->ca", solver.loop.diagonal[nodes]).mean(axis=1)
        turn, self.distances = np.zeros(points.shape), []
        anderson, status = Anderson(SMOOTH), np.zeros(0)
        rounds: list[Solution] = []
        options["start"] = start
        while len(rounds) < ROUNDS:
            solver.turn(self.normal, np.einsum("ca,ca->c", self.normal, points - self.foot))
            solution = solver.solve(tangential_reference=anchor - points, tolerance=tolerance, **options)
            rounds.append(solution)
            touching = np.flatnonzero(solution.status != FREE)
            gap, normal, foot = self._look(road, solution, anchors, softness * solution.pressure_force)
            before, turn = turn, normal - self.normal
            softness *= _rescaled(before, turn)
            above = np.delete(gap, touching)
            self.distances.append(max(np.abs(gap[touching]).max(initial=0.0), -above.min(initial=0.0)))
            steady = np.abs(turn[touching]).max(initial=0.0) <= 10 * tolerance or solution.history.size == 1
            if steady and self.distances[-1] <= ON_ROAD * self.size:
                gap[touching] = 0.0
                return _all_rounds(rounds, np.maximum(gap, 0.0))
            if not np.array_equal(status, solution.status):
                anderson.forget()
            status = solution.status
            places = np.stack([normal[touching], foot[touching]])
            normal[touching], foot[touching] = anderson.combine(turn[touching], places)
            self.normal, self.foot = normal / np.linalg.norm(normal, axis=1, keepdims=True), foot
            guess = solution.displacement.copy()
            guess[nodes[touching]] = (foot - points)[touching]
            options |= {"start": guess, "start_status": status}
        raise NotConverged(
            f"No convergence on the curved road: after {ROUNDS} rounds nodes are {self.distances[-1]:.1e} "
            "off it, or their forces still turn; take smaller load steps, or refine the body where the road "
            "is sharper than its elements.",
            Record(
                tolerance,
                ROUNDS,
                lambda: sum(s.sweeps for s in rounds),
                progress=False,
                history=self.distances,
                cycles=sum(s.cycles for s in rounds),
            ),
        )

    def follow(
        self, road: Any, steps: Iterable[tuple[float, np.ndarray]], **options: Any
    ) -> Iterator[Solution]:
        """Solve for one time after the other: nodes stick where they were, and go where the road goes.

        Parameters
        ----------
        road : MovingRoad
            Its `at(time)` is the road at a time, `displacement(time)` (d,) how far it has moved since time 0.
        steps : iterable of (time, load (N, d))
        **options
            Further arguments of `solve`.

        Yields
        ------
        Solution
            One a step.
        """
        nodes, reference = self.solver.problem.contact_nodes, self.solver.problem.tangential_reference
        moved = np.zeros(self.points.shape[1])
        for time, b in steps:
            way, moved = road.displacement(time) - moved, road.displacement(time)
            solution = self.solve(road.at(time), tangential_reference=reference + way, b=b, **options)
            yield solution
            reference = solution.displacement[nodes]
            options |= {"start": solution.displacement, "start_status": solution.status}
            self.solver.state = np.asarray(solution.status == SLIP, dtype=np.float64)

    def _look(
        self, road: Any, solution: Solution, anchors: tuple[np.ndarray, np.ndarray], depth: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return gap (n,), and normal and nearest point (n, d) where the nodes have come to be.

        Nodes that stick are at their anchors (normal, point). Touching nodes are seen from `depth` (n,) below
        where that turns the normal less.
        """
        at = self.points + solution.displacement[self.solver.problem.contact_nodes]
        gap, normal, foot = road.closest(at)
        sticks, touching = solution.status == STICK, np.flatnonzero(solution.status != FREE)
        normal[sticks], foot[sticks], at[sticks] = anchors[0][sticks], anchors[1][sticks], anchors[1][sticks]
        last = self.normal[touching]
        _, below, foot_below = road.closest(at[touching] - depth[touching, None] * last)
        steadier = np.sum((below - last) ** 2, axis=1) < np.sum((normal[touching] - last) ** 2, axis=1)
        normal[touching[steadier]], foot[touching[steadier]] = below[steadier], foot_below[steadier]
        return gap, normal, foot


def _rescaled(before: np.ndarray, turn: np.ndarray) -> np.ndarray:
    """Return factors (n,) on the softness that would have made the last turn (n, d) of each the only one."""
    square = np.einsum("ca,ca->c", before, before)
    ratio = np.einsum("ca,ca->c", turn, before) / np.where(square > 0.0, square, 1.0)
    return np.clip(1.0 - ratio, 0.5, 2.0)


def _all_rounds(rounds: list[Solution], gap: np.ndarray) -> Solution:
    """Return the last solution with the gaps (n,) to the road, and what all rounds cost."""
    total = {
        name: sum(getattr(s, name) for s in rounds)
        for name in ("sweeps", "cycles", "work_units", "seconds", "setup_seconds")
    }
    return replace(rounds[-1], gap=gap, **total)
