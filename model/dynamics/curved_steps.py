"""Time steps on a road that is not flat: the same contact problem, on planes that follow the nodes.

A scheme by itself takes the road for the planes at the nodes as the step begins; that is exact on a flat
road, and off it by curvature times way squared on another. There any scheme gets iterations like those of
`CurvedContact` instead, so that every node that touches ends the step on the road.

On a road that moves all is as on one at rest, seen by who goes with it: gaps are to where it is at the end of
the step, and who sticks is carried.

The schemes built on the midpoint rule gain no energy on a road that bends either, since their forces work
on the change of the gap alone (see `model.curved.tangent_planes`): mass redistribution to the last digit, and
contact-stabilised Newmark but for a remainder, from its projection, which does not know where the step ends;
it falls more than tenfold when dt is halved.
"""

from dataclasses import replace
from typing import Any

import numpy as np

from model.curved.tangent_planes import RoadPlanes, at_anchors, softness
from model.dynamics.midpoint import Midpoint
from model.dynamics.time_integrator import State, TimeIntegrator, Touch
from model.node_loop.node_loop import length
from model.node_loop.status import Status
from model.quasistatics.curved_contact import extent
from model.quasistatics.sequential_programming import ITERATIONS
from model.solvers.convergence_record import NotConverged, Record
from model.tolerances import ON_ROAD


class FollowsRoad(TimeIntegrator):
    """A time integrator whose steps end on a curved road; `on_curved_road` mixes it in before a scheme.

    Attributes
    ----------
    iterations : int
        Rounds that the last contact problem took.
    """

    iterations = 0
    rounding = 0.01 * ON_ROAD  # planes follow what is left of gaps

    def touch(self, before: State, moved: np.ndarray, b: np.ndarray, solver: str = "step") -> Touch:
        """Find the increment from the guess `before.displacement + moved` for the missing force b (N, d).

        Nodes stick at the point of the road nearest to where they were as the step began.
        """
        body, step = self.body, self.solvers[solver]
        nodes, end = body.contact_nodes, (before.step + 1) * self.dt
        was, road = body.positions(before.displacement), body.road_at(end)
        guessed = was + moved[nodes]
        carried = was + self.way(before)
        sticking = None if step.loop.friction is None else carried
        size = extent(body.coordinates, body.ranks)
        b = self.driven(before, moved, b, solver)
        since = None
        if isinstance(self, Midpoint) and solver == "step":
            gap, normal = self.ground(before)
            since = gap, road.closest(carried)[1] if body.road_moves else normal, carried
        planes = RoadPlanes(road, guessed, sticking, softness(step.loop), size, since, body.ranks)
        last, touch = before, None
        for self.iterations in range(1, ITERATIONS + 1):
            gap = planes.gaps(guessed)
            touch = step.solve(b, gap, planes.normal, planes.anchor - guessed, last)
            pressure = np.einsum("ca,ca->c", planes.normal, touch.force)
            steady = 10 * self.tolerance * (step.loop.load_size + length(touch.force))
            at = guessed + touch.increment[nodes]
            if planes.follow(at, at_anchors(step.loop, touch.status), np.maximum(pressure, 0.0), steady):
                return replace(touch, gap=np.where(touch.status == Status.FREE, planes.gap, 0.0))
            last = replace(before, status=touch.status)
        raise self._off(planes)

    def _settle(self, state: State) -> float:
        """Bring the massless nodes of a scheme that has such into equilibrium, on the road itself."""
        step, massless, ranks = self.solvers["step"], self.massless, self.body.ranks  # type: ignore[attr-defined]
        near, added = ON_ROAD * extent(self.body.coordinates, ranks), 0.0
        for _ in range(ITERATIONS):
            added += super()._settle(state)  # type: ignore[misc]
            gap, normal = self.body.gaps(state.displacement, state.time)
            turn, in_contact = normal - massless.normal, state.status != Status.FREE
            off, turned = (ranks.max(np.abs(x[in_contact]).max(initial=0.0)) for x in (gap, turn))
            if off <= near and turned <= 10 * self.tolerance:
                break
        step.take_planes(massless.normal.copy())
        return added

    def _off(self, planes: RoadPlanes) -> NotConverged:
        return NotConverged(
            f"No convergence on the curved road: after {ITERATIONS} iterations nodes "
            f"are {planes.distances[-1]:.1e} "
            "off it, or their forces still turn; take smaller time steps, or a finer mesh of the body.",
            Record(self.tolerance, ITERATIONS, lambda: 0, progress=False, history=planes.distances),
        )


def on_curved_road(scheme: type[TimeIntegrator]) -> Any:
    """Return the scheme with steps that end on a curved road: what `Newmark(body, dt)` is on such a road.

    Examples
    --------
    >>> from model import Newmark
    >>> on_curved_road(Newmark).__name__
    'NewmarkOnCurvedRoad'
    """
    if issubclass(scheme, FollowsRoad):
        return scheme
    return type(f"{scheme.__name__}OnCurvedRoad", (FollowsRoad, scheme), {})
