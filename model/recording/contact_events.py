"""What happens at the nodes: touching, leaving, sticking, slipping, and when."""

from typing import Any, NamedTuple

import numpy as np

from model.dynamics.time_integrator import State, TimeIntegrator
from model.node_loop.status import Status


class Event(NamedTuple):
    """Something that happened at a node of the body: "touch", "leave", "stick" or "slip", and when."""

    time: float
    node: int
    kind: str


def events(integrator: TimeIntegrator, before: State, after: State) -> list[Event]:
    """List what happened in a step.

    Touching is timed within the step, by the gap as it would close with the velocity and acceleration of the
    step's beginning. A node leaves, sticks or slips from the last time on at which it did not. On many ranks
    all of them get the events of all, by the numbers of nodes on which they agree.
    """
    old, new = before.status, after.status
    body, ranks = integrator.body, integrator.body.ranks
    if not ranks.any(not np.array_equal(old, new)):
        return []
    nodes = body.ids[0][body.contact_nodes] if body.exchanges else body.contact_nodes
    found = []
    changes = [
        ("leave", (old != Status.FREE) & (new == Status.FREE)),
        ("stick", (old == Status.SLIP) & (new == Status.STICK)),
        ("slip", (old == Status.STICK) & (new == Status.SLIP)),
    ]
    for kind, where in changes:
        found += [Event(before.time, int(nodes[c]), kind) for c in np.flatnonzero(where)]
    touching = np.flatnonzero((old == Status.FREE) & (new != Status.FREE))
    for c, delay in zip(touching, closing_times(integrator, before, touching)):
        found.append(Event(before.time + delay, int(nodes[c]), "touch"))
    columns: Any = zip(*found) if found else ((), (), ())
    kinds: Any = (float, np.int64, "U5")
    every = (ranks.stacked(np.array(values, dtype=kind)) for values, kind in zip(columns, kinds))
    return sorted(Event(*event) for event in zip(*(values.tolist() for values in every)))


def closing_times(integrator: TimeIntegrator, before: State, numbers: np.ndarray) -> np.ndarray:
    """Times (k,) from the step's beginning to g + s g' + s^2 g'' / 2 = 0 at some candidates, at most dt."""
    nodes = integrator.body.contact_nodes[numbers]
    normal = integrator.solvers["step"].loop.frame[numbers, 0]
    gap = before.gap[numbers]
    speed = np.einsum("ca,ca->c", normal, before.velocity[nodes])
    acceleration = np.einsum("ca,ca->c", normal, before.acceleration[nodes])
    root = np.sqrt(np.maximum(speed**2 - 2.0 * acceleration * gap, 0.0))
    closing = root - speed  # twice the mean speed of approach until the gap is closed
    with np.errstate(divide="ignore", invalid="ignore"):
        delay = np.where(closing > 0.0, 2.0 * gap / closing, integrator.dt)
    return np.clip(np.nan_to_num(delay, nan=integrator.dt), 0.0, integrator.dt)
