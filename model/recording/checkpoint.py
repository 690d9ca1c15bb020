"""Checkpoints: stop a run, and go on later to the last bit as if it had not stopped.

On another number of ranks a run goes on as well, as far as rounding goes: what belongs to nodes is then found
again by their places.
"""

from dataclasses import fields
from hashlib import sha256
from pathlib import Path
from zipfile import BadZipFile

import numpy as np
from scipy.spatial import cKDTree

from checks import instance
from model.atomic_file import write_aside
from model.dynamics.time_integrator import State, TimeIntegrator, Work
from model.recording.history import History
from model.solvers.static_condensation import Condensation

SAME = 1e-10  # of the body's size: places of nodes are written to the last digit, and made anew to some
AT_NODES = ("displacement", "velocity", "acceleration")
AT_CANDIDATES = ("contact_force", "gap", "status", "mean_force", "memory")


def save_checkpoint(
    path: str | Path, integrator: TimeIntegrator, state: State, history: History | None = None
) -> None:
    """Write all that the run needs to go on, replacing an earlier checkpoint once the new one is whole.

    Parameters
    ----------
    path : str or Path
        An `.npz` file without pickles.
    integrator : TimeIntegrator
    state : State
    history : History, optional

    Raises
    ------
    ValueError
        If the file cannot be written.

    Examples
    --------
    >>> from forms import Elasticity, Isotropic
    >>> from geometry import Body, Plane, rectangle
    >>> from model import History, MovingBody, Newmark, integrate, save_checkpoint
    >>> elasticity = Elasticity(Body.from_grid(rectangle(2.0, 1.0, 4, 2)), Isotropic(E=1e4, nu=0.3))
    >>> weight = elasticity.body_force((0.0, -10.0))
    >>> scheme = Newmark(MovingBody.from_forms(elasticity, 1.0, weight, Plane(), "bottom"), dt=0.001)
    >>> state = scheme.start()
    >>> history = History(scheme, state, {"A": 0})
    >>> for state in integrate(scheme, state, 5, history):
    ...     pass
    >>> save_checkpoint("run.npz", scheme, state, history)
    """
    instance(TimeIntegrator, integrator=integrator)
    instance(State, state=state)
    body, ranks = integrator.body, integrator.body.ranks
    arrays = {"run": np.array(fingerprint(integrator)), "scene": np.array(scene(integrator))}
    for field in fields(State):
        if field.name != "work" and getattr(state, field.name) is not None:
            values = np.asarray(getattr(state, field.name))
            if field.name in AT_NODES + AT_CANDIDATES:
                values = ranks.stacked(ranks.own(values) if field.name in AT_NODES else values)
            arrays[f"state_{field.name}"] = values
    arrays["nodes"] = ranks.stacked(ranks.own(body.coordinates))
    arrays["candidates"] = ranks.stacked(body.coordinates[body.contact_nodes])
    for field in fields(Work):
        arrays[f"work_{field.name}"] = np.asarray(getattr(state.work, field.name))
    for name, solver in integrator.solvers.items():
        if isinstance(solver.correction, Condensation):
            batches = solver.correction.batches
            arrays[f"known_{name}"] = np.concatenate([np.zeros(0, dtype=np.int64), *batches])
            arrays[f"batches_{name}"] = np.array([batch.size for batch in batches], dtype=np.int64)
    if history is not None:
        arrays |= {f"history_{name}": values for name, values in history.saved().items()}
    if ranks.before(1) == 0:
        with write_aside(path) as aside, open(aside, "wb") as file:
            np.savez(file, **arrays)  # type: ignore[arg-type]


def load_checkpoint(path: str | Path, integrator: TimeIntegrator, history: History | None = None) -> State:
    """Read a checkpoint; integrator and history go on from it.

    Parameters
    ----------
    path : str or Path
    integrator : TimeIntegrator
        Set up as for the run that was stopped.
    history : History, optional
        Likewise; its rows are replaced by those of the checkpoint.

    Returns
    -------
    State

    Raises
    ------
    ValueError
        If the file is no checkpoint, or one of another run.
    FileNotFoundError
        If there is no such file.

    Examples
    --------
    >>> from forms import Elasticity, Isotropic
    >>> from geometry import Body, Plane, rectangle
    >>> from model import History, MovingBody, Newmark, load_checkpoint, integrate, save_checkpoint
    >>> elasticity = Elasticity(Body.from_grid(rectangle(2.0, 1.0, 4, 2)), Isotropic(E=1e4, nu=0.3))
    >>> weight = elasticity.body_force((0.0, -10.0))
    >>> scheme = Newmark(MovingBody.from_forms(elasticity, 1.0, weight, Plane(), "bottom"), dt=0.001)
    >>> state = scheme.start()
    >>> history = History(scheme, state, {"A": 0})
    >>> for state in integrate(scheme, state, 5, history):
    ...     pass
    >>> save_checkpoint("run.npz", scheme, state, history)
    >>> load_checkpoint("run.npz", scheme, history).step
    5
    """
    instance(TimeIntegrator, integrator=integrator)
    try:
        with np.load(path, allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
        run = str(arrays["run"])
        same = run == fingerprint(integrator) and not integrator.body.exchanges
        if history is not None and integrator.body.exchanges:
            raise ValueError("on several ranks a history does not go on from a file; leave it out")
        if not same and (str(arrays["scene"]) != scene(integrator) or history is not None):
            raise ValueError(f"it is of another run ({run.split()[0]})")
        values = {name[6:]: value for name, value in arrays.items() if name.startswith("state_")}
        if not same:
            _find_places(values, arrays, integrator)
        work = {name[5:]: value for name, value in arrays.items() if name.startswith("work_")}
        impulse = work.pop("impulse")
        state = State(
            **{name: value[()] if value.ndim == 0 else value for name, value in values.items()},
            work=Work(**{name: float(value) for name, value in work.items()}, impulse=impulse),
        )
        for name in ("step", "count", "cycles"):
            setattr(state, name, int(getattr(state, name)))
        for name in ("time", "residual", "seconds"):
            setattr(state, name, float(getattr(state, name)))
        if history is not None:
            prefix = "history_"
            history.restore(
                {name[len(prefix) :]: v for name, v in arrays.items() if name.startswith(prefix)}, state
            )
        for name, solver in integrator.solvers.items() if same else ():
            if isinstance(solver.correction, Condensation):
                ends = np.cumsum(arrays[f"batches_{name}"])[:-1]
                known = arrays[f"known_{name}"]
                solver.correction.recall(np.split(known, ends) if known.size else [])
    except FileNotFoundError:
        raise
    except (OSError, KeyError, ValueError, BadZipFile, EOFError, TypeError, IndexError) as error:
        raise ValueError(f"{path} is no checkpoint of this run: {error}.") from None
    return state


def scene(integrator: TimeIntegrator) -> str:
    """Name what must be the same for a run to go on elsewhere: scheme, sizes, friction, step."""
    body = integrator.body
    sizes = body.ranks.sum(np.array([len(body.ranks.own(body.coordinates)), body.contact_nodes.size]))
    return f"{type(integrator).__name__} {sizes} {integrator.dt!r} {body.friction!r} {integrator.tolerance!r}"


def _find_places(
    values: dict[str, np.ndarray], arrays: dict[str, np.ndarray], integrator: TimeIntegrator
) -> None:
    """Bring the fields of a state into the order of the nodes that this rank holds."""
    body = integrator.body
    for names, places, points in (
        (AT_NODES, arrays["nodes"], body.coordinates),
        (AT_CANDIDATES, arrays["candidates"], body.coordinates[body.contact_nodes]),
    ):
        distance, at = cKDTree(places).query(points)
        if distance.max(initial=0.0) > SAME * body.size:
            raise ValueError("nodes of the body are not where they were")
        for name in set(names) & values.keys():
            values[name] = values[name][at]


def fingerprint(integrator: TimeIntegrator) -> str:
    """Name what must be the same for a run to go on: scheme, matrix, candidates, load, friction, step."""
    digest = sha256()
    body, loop = integrator.body, integrator.solvers["step"].loop
    if body.exchanges:  # of which no rank has all: such a run goes on by places
        return "shared"
    for values in (loop.A.indptr, loop.A.indices, loop.A.data, body.contact_nodes, body.load_at(0.0)):
        digest.update(np.ascontiguousarray(values).tobytes())
    digest.update(f"{integrator.dt!r} {loop.friction!r} {integrator.tolerance!r}".encode())
    for value in loop.friction.parameters.values() if loop.friction is not None else ():
        digest.update(np.asarray(value).tobytes() if isinstance(value, np.ndarray) else b"")
    return f"{type(integrator).__name__} {digest.hexdigest()}"
