"""Histories of a run: a row a step, readable at any moment, and the events at the nodes."""

import csv
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from checks import instance, named, refused, whole
from model.atomic_file import write_aside
from model.dynamics.time_integrator import State, TimeIntegrator
from model.node_loop.status import Status
from model.recording.contact_events import Event, events
from model.recording.energy_balance import Entry, GrowthWatch, Ledger
from model.recording.wave_resolution import Resolution

AXES = "xyz"
EVERY = 10  # contact steps between measurements of the resolution, which cost a product with K each


class History:
    """Records every step of a run.

    Columns: step, time, contacts, sticking, the entries of the ledger (see `Entry`), force_x and so on (of
    the road on the body), lowest_gap, lowest_pressure (a nodal force), cone (largest |tau| - mu p), residual,
    cycles, seconds, and for each point NAME displacement u_x(NAME), velocity v_x(NAME), contact force
    f_x(NAME) and so on.

    Parameters
    ----------
    integrator : TimeIntegrator
    state : State
        Where the run starts.
    points : dict
        Nodes of the mesh to follow, by name. On several ranks -1 where a rank does not hold one, as
        `Body.nearest_node` says; all ranks have all rows and events, with the numbers of nodes on which they
        agree.
    path : str or Path, optional
        CSV file that grows with the run; the first rank writes it.

    Attributes
    ----------
    events : list of Event

    Examples
    --------
    >>> from forms import Elasticity, Isotropic
    >>> from geometry import Body, Plane, rectangle
    >>> from model import History, MovingBody, Newmark, integrate
    >>> elasticity = Elasticity(Body.from_grid(rectangle(2.0, 1.0, 4, 2)), Isotropic(E=1e4, nu=0.3))
    >>> weight = elasticity.body_force((0.0, -10.0))
    >>> scheme = Newmark(MovingBody.from_forms(elasticity, 1.0, weight, Plane(), "bottom"), dt=0.001)
    >>> state = scheme.start()
    >>> history = History(scheme, state, {"A": 0}, "history.csv")
    >>> for state in integrate(scheme, state, 5, history):
    ...     pass
    >>> len(history["u_y(A)"])  # with the start
    6
    """

    def __init__(
        self,
        integrator: TimeIntegrator,
        state: State,
        points: Mapping[str, int] | None = None,
        path: str | Path | None = None,
    ):
        instance(TimeIntegrator, integrator=integrator)
        instance(State, state=state)
        body = integrator.body
        self.integrator, self.ranks = integrator, body.ranks
        self._held = {name: of_body(body, name, node) for name, node in named("points", points).items()}
        self.points = {name: agreed_number(body, name, node) for name, node in self._held.items()}
        candidates = body.contact_nodes
        self._candidate = {
            name: int(found[0]) if (found := np.flatnonzero(candidates == node)).size else -1
            for name, node in self._held.items()
        }
        self.events: list[Event] = []
        self.resolution = Resolution(integrator)
        self.ledger = Ledger(integrator, state)
        self.watch = GrowthWatch(integrator, self.ledger.entry)
        self._explained = 0.0
        self._measured = 0
        self._file: Any = None
        self.path = None if path is None or self.ranks.before(1) else Path(path)
        self.rows: list[list[float]] = []
        first = self._row(state, self.ledger.entry)
        self.columns = list(first)
        self._add(list(first.values()))

    def __getitem__(self, column: str) -> np.ndarray:
        """Return a column, a value a step and one for the start."""
        number = self.columns.index(column)
        return np.array([row[number] for row in self.rows])

    def record(self, before: State, after: State) -> None:
        """Take down a step."""
        entry = self.ledger.close(before, after)
        self._explained += entry.numerical
        self.watch.check(entry, after.time, self._explained)
        self.events += events(self.integrator, before, after)
        self._add(list(self._row(after, entry).values()))
        if after.count:
            if self._measured % EVERY == 0:
                self.resolution.measure(after)
            self._measured += 1

    def touches(self, name: str) -> list[float]:
        """Times at which a point touched."""
        return [e.time for e in self.events if e.node == self.points[name] and e.kind == "touch"]

    def bounces(self, apart: float) -> list[tuple[float, float, int]]:
        """Contacts of the body as a whole; those less than `apart` in time from each other are one bounce.

        Returns
        -------
        list of (first time in contact, last time, how often the body let go and touched again)
        """
        found: list[tuple[float, float, int]] = []
        last = -np.inf
        for time, contacts in zip(self["time"], self["contacts"]):
            if not contacts:
                continue
            if found and time - last < apart:
                begin, _, again = found[-1]
                found[-1] = (begin, time, again + (time - last > 1.5 * self.integrator.dt))
            else:
                found.append((time, time, 0))
            last = time
        return found

    def cost(self) -> dict[str, float]:
        """Return what the run cost, set-up of the integrator included, for `Scene.cost`."""
        integrator, seconds = self.integrator, float(self["seconds"].sum())
        loops = [solver.loop for solver in integrator.solvers.values()]
        seconds += integrator.setup_seconds
        sweep = loops[0].seconds_of_passes / max(loops[0].passes, 1)
        return {
            "dofs": integrator.body.coordinates.size,
            "contact_candidates": integrator.body.contact_nodes.size,
            "sweeps": sum(loop.sweeps for loop in loops),
            "cycles": len(self.rows) - 1 + int(self["cycles"].sum()),
            "work_units": seconds / sweep if sweep else 0.0,
            "solve_seconds": seconds,
            "residual": float(self["residual"].max()),
        }

    def write(self, path: str | Path) -> None:
        """Write all rows to a CSV file."""
        with write_aside(path) as aside, open(aside, "w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow(self.columns)
            writer.writerows(self.rows)

    def write_events(self, path: str | Path) -> None:
        """Write the events to a CSV file."""
        with write_aside(path) as aside, open(aside, "w", newline="", encoding="utf-8") as file:
            csv.writer(file).writerows([Event._fields, *self.events])

    def saved(self) -> dict[str, np.ndarray]:
        """Return all that `restore` needs, as arrays."""
        return {
            "rows": np.array(self.rows),
            "event_times": np.array([e.time for e in self.events]),
            "event_nodes": np.array([e.node for e in self.events], dtype=np.int64),
            "event_kinds": np.array([e.kind for e in self.events], dtype="U5"),
            "resolution": np.array([self.resolution.fewest, self.resolution.at, self._measured]),
        }

    def restore(self, arrays: Mapping[str, np.ndarray], state: State) -> None:
        """Go on with the history of an earlier run that had come to `state`; a CSV file is written anew."""
        self._close()
        self.rows = [list(map(float, row)) for row in arrays["rows"]]
        kinds = (arrays[f"event_{name}"].tolist() for name in ("times", "nodes", "kinds"))
        self.events = [Event(*event) for event in zip(*kinds)]
        self.resolution.fewest, self.resolution.at = map(float, arrays["resolution"][:2])
        self._measured = int(arrays["resolution"][2])
        self.ledger.entry = self._entry(-1)
        self.watch = GrowthWatch(self.integrator, self._entry(0))
        self._explained = float(self["numerical"].sum())
        self._stream()

    def _entry(self, number: int) -> Entry:
        """The ledger's entry in a row."""
        row = dict(zip(self.columns, self.rows[number]))
        names = [name for name in Entry.__dataclass_fields__ if name != "momentum"]
        momentum = np.array([row[f"momentum_{a}"] for a in AXES[: self.integrator.body.dim]])
        return Entry(**{name: row[name] for name in names}, momentum=momentum)

    def _row(self, state: State, entry: Entry) -> dict[str, float]:
        loop, dim, ranks = self.integrator.solvers["step"].loop, self.integrator.body.dim, self.ranks
        pressure = np.einsum("ca,ca->c", loop.normal, state.contact_force)
        row: dict[str, float] = {
            "step": state.step,
            "time": state.time,
            "contacts": state.count,
            "sticking": ranks.sum(int(np.count_nonzero(state.status == Status.STICK))),
        }
        row |= {name: value for name, value in vars(entry).items() if name != "momentum"}
        row |= {f"momentum_{a}": float(x) for a, x in zip(AXES, entry.momentum)}
        row |= {f"force_{a}": float(x) for a, x in zip(AXES, ranks.sum(state.contact_force.sum(axis=0)))}
        row |= {
            "lowest_gap": -ranks.max(float(np.max(-state.gap, initial=-np.inf))),
            "lowest_pressure": -ranks.max(float(np.max(-pressure, initial=-np.inf))),
            "cone": ranks.max(self._cone(state, pressure)),
            "residual": state.residual,
            "cycles": state.cycles,
            "seconds": ranks.max(state.seconds),
        }
        owned = len(ranks.own(state.displacement))
        for name, node in self._held.items():
            c, here = self._candidate[name], 0 <= node < owned
            values = np.zeros((3, dim))
            if here:
                values[:2] = state.displacement[node], state.velocity[node]
            if c >= 0:
                values[2] = state.contact_force[c]
            for letter, value in zip("uvf", ranks.sum(values)):
                row |= {f"{letter}_{a}({name})": float(x) for a, x in zip(AXES, value)}
        return row

    def _cone(self, state: State, pressure: np.ndarray) -> float:
        """Largest |tau| - mu p; only Coulomb's cone can be judged by the force alone."""
        body, loop = self.integrator.body, self.integrator.solvers["step"].loop
        law: Any = body.friction
        mu = 0.0 if law is None else law.nodes(np.zeros(pressure.size), body.places(state))[:, 1]
        tangential = state.contact_force - pressure[:, None] * loop.normal
        return float(np.max(np.linalg.norm(tangential, axis=1) - mu * pressure, initial=-np.inf))

    def _add(self, row: list[float]) -> None:
        self.rows.append(row)
        if self.path is not None:
            if self._file is None:
                self._stream()
            else:
                csv.writer(self._file).writerow(row)
                self._file.flush()

    def _stream(self) -> None:
        """Write the rows so far, and keep the file open for those to come."""
        if self.path is not None:
            self.write(self.path)
            self._file = open(self.path, "a", newline="", encoding="utf-8")  # noqa: SIM115

    def _close(self) -> None:
        if self._file is not None:
            self._file.close()
            self._file = None


def of_body(body: Any, name: str, node: int) -> int:
    """Return the node of the body that one of its mesh has become on this rank, -1 where it is not held."""
    whole(-1, **{f"points[{name!r}]": node})
    count = len(body.coordinates if body.node_of is None else body.node_of)
    if node >= count:
        raise refused(f"points[{name!r}]", f"the number of a node, 0 to {count - 1}", node)
    return int(node) if body.node_of is None or node < 0 else int(body.node_of[node])


def agreed_number(body: Any, name: str, node: int) -> int:
    """Return the number of a node on which all ranks agree, of which one owns it (else ValueError)."""
    if not body.exchanges:
        return node
    owned = 0 <= node < body.ranks.owned
    number, count = body.ranks.sum(np.array([body.ids[0][node] if owned else 0, int(owned)]))
    trouble = (
        "" if count == 1 else f"The point {name!r} is on {count} ranks; give what Body.nearest_node says."
    )
    body.ranks.agree(trouble)
    return int(number)
