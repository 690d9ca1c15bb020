"""Runs in time: their fields for ParaView, and what is noted of them."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from harness.scene import Scene
from model import History, integrate, write_road
from model.dynamics.moving_body import RigidPart
from model.dynamics.step_problem import save_step
from model.results.xdmf import Series, on_body


def recorded(
    scheme: Any,
    velocity: np.ndarray,
    steps: int,
    points: dict[str, int],
    path: Any = None,
    on_state: Callable[[Any], None] | None = None,
    save: Any = None,
    displacement: np.ndarray | None = None,
) -> History:
    """Run from a velocity, and a displacement if given, and return the history.

    Parameters
    ----------
    scheme : TimeIntegrator
    velocity, displacement : (N, dim)
        At the start.
    steps : int
    points : dict
        Nodes to follow, by name.
    path : Path, optional
        CSV file that grows with the run.
    on_state : callable, optional
        Called with each state.
    save : Path, optional
        NAME.npz for the step with the most nodes in contact, as a problem of its own.
    """
    most = first = scheme.start(displacement, velocity)
    history = History(scheme, first, points, path)
    for state in integrate(scheme, first, steps, history):
        most = state if state.count > most.count else most
        if on_state is not None:
            on_state(state)
    if save is not None:
        save_step(save, scheme, most)
    return history


def bounced(
    scene: Scene,
    key: str,
    scheme: Any,
    velocity: np.ndarray,
    point: dict[str, int],
    kinetic: float,
    fall: float,
) -> tuple[History, list[Any]]:
    """Throw a ring at a velocity (N, 2), note how it bounces in 130 steps; return the history and the states.

    The history goes to history_KEY.csv, and of Newmark's method, the paper's, the step with the most nodes in
    contact to problem.npz. Other parameters as for `note_motion` and `recorded`.
    """
    states: list[Any] = []
    path = scene.out / f"history_{key.replace(',', '_').replace(' ', '_')}.csv"
    save = scene.out / "problem.npz" if "," not in key else None
    run = recorded(scheme, velocity, 130, point, path, states.append, save)
    if scheme.body.friction is not None:
        spin = RigidPart(scheme.body.M, scheme.body.coordinates).amounts(states[89].displacement)[2]
        scene.result(f"spin[{key}]", spin, "rad, counter-clockwise, at 0.9 s")
    note_motion(scene, key, run, kinetic, fall)
    (name,) = point
    scene.result(f"first_touch_within_step[{key}]", run.touches(name)[0], "s", fall, "sqrt(2 h / g)")
    return run, states


def fields_in_motion(elasticity: Any, moving: Any, boundary: str, state: Any) -> tuple[dict, dict]:
    """Fields of nodes and cells for `Series.write`, named as those of `BodyOnRoad.fields`, and the velocity."""
    body, u, at = elasticity.body, moving.expand(state.displacement), moving.contact_nodes
    gap, normal, _ = moving.road.closest(body.coordinates + u)
    traction = state.contact_force / elasticity.boundary_mass(boundary).sum(axis=1)[at][:, None]
    pressure = np.maximum(np.einsum("ca,ca->c", traction, normal[at]), 0.0)
    gap[at[state.status > 0]] = 0.0
    nodes = {
        "displacement": u,
        "velocity": moving.expand(state.velocity),
        "contact_pressure": on_body(len(u), at, pressure),
        "contact_traction": on_body(len(u), at, traction),
        "gap": gap,
        "status": on_body(len(u), at, state.status),
    }
    return nodes, {"stress": elasticity.stress(u), "von_mises": elasticity.von_mises(u)}


def write_motion(
    path: Path, elasticity: Any, moving: Any, boundary: str, states: Sequence[Any]
) -> list[np.ndarray]:
    """Write the fields of all states to NAME.xdmf, and the road to NAME_road.xdmf; return von Mises' stresses (cells,)."""
    series, stresses = Series(path, elasticity.body), []
    for state in states:
        nodes, cells = fields_in_motion(elasticity, moving, boundary, state)
        series.write(state.time, nodes, cells)
        stresses.append(cells["von_mises"])
    places = [moving.coordinates + state.displacement for state in states]
    write_road(beside(path), moving.road, np.concatenate(places))
    return stresses


def beside(path: Path) -> Path:
    """File of the road, beside that of the body."""
    return path.with_name(f"{path.stem}_road.xdmf")


def keeping(
    path: Any, elasticity: Any, moving: Any, every: int, seldom: int
) -> tuple[Callable[[Any], None], dict[float, np.ndarray]]:
    """Return what keeps the states of a run, and the snapshots that it fills.

    Every so many steps it writes fields to an XDMF file, and seldom keeps the displacement (N, dim) by time (s); the
    body touches with its boundary "outer". The road is left to others: what lies below a long way is known at its end.
    """
    series, snapshots = Series(path, elasticity.body), {}

    def keep(state: Any) -> None:
        if state.step % every == 0:
            series.write(state.time, *fields_in_motion(elasticity, moving, "outer", state))
        if state.step % seldom == 0:
            snapshots[state.time] = state.displacement

    return keep, snapshots


def note_motion(scene: Scene, key: str, run: History, kinetic: float, fall: float) -> None:
    """Note when a falling body touches, what becomes of its energy, and how well the laws of contact are kept.

    A body that lets go and touches again within 0.05 s has released spuriously.

    Parameters
    ----------
    scene : Scene
    key : str
        Of the run, in brackets behind each result.
    run : History
    kinetic : float
        Energy at the start (J/m).
    fall : float
        Time of the free fall (s).
    """
    bounces, gain = run.bounces(apart=0.05), run["gain"].max()
    unit = "of the initial kinetic energy"
    scene.result(f"first_touch[{key}]", bounces[0][0], "s", fall, "sqrt(2 h / g); the step after it")
    if len(bounces) > 1:
        scene.result(f"second_touch[{key}]", bounces[1][0], "s", None, "the paper: earlier with friction")
    again = sum(again for *_, again in bounces)
    scene.result(f"spurious_releases[{key}]", again, "1", 0, "the ring flies for half a second")
    scene.result(f"max_energy_gain[{key}]", gain, "J/m in a step", 0.0, "exact contact does no work")
    scene.result(f"max_energy_gain_relative[{key}]", gain / kinetic, unit, 0.0)
    scene.result(f"energy_change[{key}]", run["total"][-1] - run["total"][0], "J/m", 0.0)
    scene.result(f"min_pressure[{key}]", run["lowest_pressure"].min(), "N/m, nodal force", 0.0, "eq. (6)")
    scene.result(f"min_gap[{key}]", run["lowest_gap"].min(), "m", 0.0, "eq. (5)")
    scene.result(f"max_coulomb_violation[{key}]", run["cone"].max(), "N/m, nodal force", 0.0, "eq. (7)")
    scene.result(f"momentum_error[{key}]", run["momentum_error"].max(), "N s/m", 0.0, "weight and road")


def note_energy(scene: Scene, newmark: Sequence[History], runs: Sequence[History], kinetic: float) -> None:
    """Note how a falling body keeps its energy and its momentum: by Newmark's method at impact, by all in flight.

    Parameters
    ----------
    scene : Scene
    newmark, runs : sequence of History
        Those by Newmark's method, and all.
    kinetic : float
        Energy at the start (J/m).
    """
    of_start = "of the initial kinetic energy"
    identity = max(np.abs(run["gain"] - run["numerical"]).max() for run in newmark) / kinetic
    flying = max(np.abs(run["gain"][run["contacts"].cumsum() == 0]).max() for run in runs) / kinetic
    drift, start = max(run["momentum_error"].max() for run in runs), newmark[0]["kinetic"][0]
    scene.result("newmark_energy_identity_error", identity, of_start, 0.0, "equation (*)")
    scene.result("free_flight_energy_error", flying, f"{of_start}, in a step", 0.0, "all schemes")
    scene.result("kinetic_energy_at_start", start, "J/m", kinetic, "rho pi (R^2 - r^2) v^2 / 2")
    scene.result("momentum_error", drift, "N s/m", 0.0, "all")


def note_impact(scene: Scene, name: str, run: History, exact: Any) -> None:
    """Note pressure, release, rebounds and energy of a rod that strikes a wall, beside `exact`, a `RodImpact`.

    The run follows the node "end".
    """
    time, energy, form = run["time"], run["kinetic"] + run["strain"], "closed form"
    off = np.abs(run["force_x"][(time > 1.1) & (time < 1.9)] / 0.5 - 1.0).max()
    release, gain = time[np.flatnonzero(run["contacts"])[-1]], run["gain"].max() / exact.energy
    scene.result(f"pressure_off_by[{name}]", off, "of 1/2", 0.0, f"{form}, 1.1 < t < 1.9")
    scene.result(f"release[{name}]", release, "s", 2.0, f"{form}; the last step in contact")
    scene.result(f"touches[{name}]", len(run.touches("end")), "1", 1, form)
    scene.result(f"max_energy_gain[{name}]", gain, "of 1/8 in a step", 0.0, form)
    scene.result(f"energy_at_end[{name}]", energy[-1], "J", exact.energy, form)
