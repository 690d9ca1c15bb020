"""A body pressed on a road that is then pulled away below it: the path, and what is noted of it."""

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from geometry import MovingRoad
from harness.motion import beside
from harness.scene import Scene
from model import ContactSolver, Series, write_road
from model.quasistatics.curved_contact import CurvedContact


class Dragged(NamedTuple):
    """A path of m steps.

    Attributes
    ----------
    pressure, way, friction, area : (m,)
        Mean pressure on the blocks, way of the road, tangential over normal force, real over nominal contact area.
    solutions : list of Solution
    """

    pressure: np.ndarray
    way: np.ndarray
    friction: np.ndarray
    area: np.ndarray
    solutions: list

    def cost(self) -> dict[str, float]:
        """Cycles and seconds of the whole path, for `Scene.finish`."""
        names = {"cycles": "cycles", "solve_seconds": "seconds"}
        return {cost: sum(getattr(s, name) for s in self.solutions) for cost, name in names.items()}


def press_and_drag(
    scene: Scene,
    name: str,
    pressed: Any,
    road: Any,
    pressure: float,
    sliding: float,
    steps: tuple[int, int],
    file: Path | None = None,
) -> Dragged:
    """Press a body with a unit load on a road in some steps, then pull the road away along -x in some more.

    Parameters
    ----------
    scene : Scene
        Gets off_the_road, residual, real_area, friction_at_the_end, rounds_a_step and cycles_a_step of `name`.
    name : str
    pressed : BodyOnRoad
        Its load is one unit of force; its `road` follows the path.
    road : Road
        Where it is at the beginning.
    pressure : float
        Mean pressure at the end.
    sliding : float
        Way of the road.
    steps : (pressing, dragging)
    file : Path, optional
        NAME.xdmf for the fields of each step; the road as it moves goes to NAME_road.xdmf.
    """
    total, points = pressed.area.sum(), pressed.points
    moving = MovingRoad(road, -np.eye(points.shape[1])[0])  # its time is the way
    loads = np.concatenate([np.linspace(0, 1, steps[0] + 1)[1:], np.ones(steps[1])]) * pressure * total
    ways = np.concatenate([np.zeros(steps[0]), np.linspace(0, sliding, steps[1] + 1)[1:]])
    contact = CurvedContact(ContactSolver(pressed.problem, "direct"), points)
    path = contact.follow(moving, zip(ways, loads[:, None, None] * pressed.problem.b), tolerance=1e-8)
    solutions, friction, area, off, rounds = [], [], [], 0.0, 0
    series = Series(file, pressed.elasticity.body) if file else None
    for step, solution in enumerate(scene.progress(path, name, len(ways))):
        touching, force = solution.status > 0, solution.contact_force.sum(axis=0)
        solutions.append(solution)
        friction.append(-force[0] / loads[step])
        area.append(pressed.area[touching].sum() / total)
        pressed.road = moving.at(ways[step])
        at = points + solution.displacement[pressed.problem.contact_nodes]
        off = max(off, np.abs(pressed.road.closest(at[touching])[0]).max())
        rounds += len(contact.distances)
        if series:
            series.write(step + 1, *pressed.fields(solution))
    if file:
        below = points + sliding * np.eye(points.shape[1])[0]  # where the road comes from
        steps_of_road = MovingRoad(
            road, lambda step: -ways[max(round(step) - 1, 0)] * np.eye(points.shape[1])[0]
        )
        write_road(beside(file), steps_of_road, np.concatenate([points, below]), range(1, len(ways) + 1))
    length = np.ptp(pressed.problem.coordinates, axis=0).max()
    scene.result(f"off_the_road[{name}]", off / length, "body lengths", 1e-12, "wanted", "at most")
    residual = max(s.residual for s in solutions)
    scene.result(f"residual[{name}]", residual, "1", 1e-8, "asked for", "at most")
    scene.result(f"real_area[{name}]", area[steps[0] - 1], "of the blocks")
    mu = pressed.problem.friction_coefficient
    scene.result(f"friction_at_the_end[{name}]", friction[-1], "of the load", mu, "mu, on a flat road")
    scene.result(f"rounds_a_step[{name}]", rounds / len(ways), "1")
    scene.result(f"cycles_a_step[{name}]", sum(s.cycles for s in solutions) / len(ways), "1")
    return Dragged(loads / total, ways, np.array(friction), np.array(area), solutions)
