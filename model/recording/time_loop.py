"""Integration in time: steps behind a progress bar, recorded, with checkpoints on the way."""

from collections.abc import Iterator
from pathlib import Path

from tqdm import tqdm

from checks import instance, whole
from model.dynamics.time_integrator import State, TimeIntegrator
from model.recording.checkpoint import save_checkpoint
from model.recording.energy_balance import GrowthWatch, Ledger
from model.recording.history import EVERY, History


def integrate(
    integrator: TimeIntegrator,
    state: State,
    steps: int,
    history: History | None = None,
    checkpoint: str | Path | None = None,
    every: int = 100,
    progress: bool = True,
) -> Iterator[State]:
    """Take so many steps and yield the state after each.

    Parameters
    ----------
    integrator : TimeIntegrator
    state : State
        Where to start: from `integrator.start`, or `load_checkpoint`.
    steps : int
        Number of steps.
    history : History, optional
        Records every step.
    checkpoint : str or Path, optional
        File for checkpoints, after every `every` steps and at the end. Each is written once the caller is
        done with the state that it holds, so that what the caller wrote is never behind it.
    progress : bool
        Show a bar with the number of nodes in contact, on terminals and after two seconds.

    Yields
    ------
    State

    Raises
    ------
    ValueError, TypeError
        If there is no such number of steps, or no state, once the first is asked for.

    Examples
    --------
    >>> from forms import Elasticity, Isotropic
    >>> from geometry import Body, Plane, rectangle
    >>> from model import History, MovingBody, Newmark, integrate
    >>> elasticity = Elasticity(Body.from_grid(rectangle(2.0, 1.0, 4, 2)), Isotropic(E=1e4, nu=0.3))
    >>> weight = elasticity.body_force((0.0, -10.0))
    >>> scheme = Newmark(MovingBody.from_forms(elasticity, 1.0, weight, Plane(), "bottom"), dt=0.001)
    >>> state = scheme.start()
    >>> for state in integrate(scheme, state, 5, checkpoint="run.npz"):
    ...     pass
    >>> state.step
    5

    Warns
    -----
    EnergyGrowth
        Once, if the integrator has added more than a few per cent to the energy; without a history, where
        loads do not change.
    """
    instance(TimeIntegrator, integrator=integrator)
    whole(0, steps=steps)
    whole(1, every=every)
    if not isinstance(state, State):
        raise TypeError(
            f"The state is a {type(state).__name__}; give what integrator.start() or load_checkpoint returns."
        )
    ledger = Ledger(integrator, state) if history is None and not callable(integrator.body.load) else None
    watch = None if ledger is None else GrowthWatch(integrator, ledger.entry)
    bar = tqdm(
        total=steps,
        desc=integrator.name,
        unit="step",
        delay=2,
        leave=False,
        disable=None if progress else True,
    )
    with bar:
        for number in range(1, steps + 1):
            before, state = state, integrator.step(state)
            if history is not None:
                history.record(before, state)
            elif ledger is not None and watch is not None:
                if number % EVERY:
                    ledger.skip(state)
                else:
                    watch.check(ledger.close(before, state), state.time)
            bar.set_postfix_str(f"{state.count} in contact", refresh=False)
            bar.update()
            yield state
            if checkpoint is not None and (number % every == 0 or number == steps):
                save_checkpoint(checkpoint, integrator, state, history)
