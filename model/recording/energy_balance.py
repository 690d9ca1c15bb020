"""The energy and momentum of a run, accounted for step by step.

With E = kinetic + strain + load potential,

    gain = change of E + dissipated by damping and friction - work of changing loads            (1)

is what the integrator itself adds in a step: the road is rigid and at rest, so that exact contact does no
work. What a scheme's closed form says of its own gain is kept beside it.
"""

import warnings
from dataclasses import dataclass

import numpy as np

from model.dynamics.central_differences import CentralDifferences
from model.dynamics.midpoint import Midpoint
from model.dynamics.time_integrator import State, TimeIntegrator

# Of the energy at work: what may be added unsaid. Newmark's scheme adds 4 to 9 % on a rod in impact.
GROWTH = 0.03
UNEXPLAINED = 1e-6  # of the same: what it may add beyond its own identity, which holds to rounding


class EnergyGrowth(UserWarning):
    """The integrator adds energy."""


@dataclass
class Entry:
    """The books after a step; energies in J (per thickness in the plane), momenta in N s.

    Attributes
    ----------
    kinetic, strain, potential : float
        Potential of the loads included, - load . u.
    damping, friction : float
        Dissipated so far.
    contact_work : float
        Work of the road along its normals so far, by the forces that the scheme works with.
    load_work : float
        Put in so far by loads that change.
    gain : float
        What the integrator added in this step, (1).
    numerical : float
        What its closed form says of that; NaN where there is none.
    total : float
        Energy with all that was dissipated, less what changing loads put in: it changes by `gain`.
    momentum : (d,)
    momentum_error : float
        Change of momentum not explained by the impulses of loads and road; NaN for a body on supports.
    """

    kinetic: float
    strain: float
    potential: float
    damping: float
    friction: float
    contact_work: float
    load_work: float
    gain: float
    numerical: float
    total: float
    momentum: np.ndarray
    momentum_error: float


class Ledger:
    """Keeps the books of one integrator.

    Parameters
    ----------
    integrator : TimeIntegrator
    state : State
        Where the run starts, or goes on.
    entry : Entry, optional
        The last entry of the run that goes on.
    """

    def __init__(self, integrator: TimeIntegrator, state: State, entry: Entry | None = None):
        self.integrator = integrator
        self.entry = self._opening(state) if entry is None else entry

    def close(self, before: State, after: State) -> Entry:
        """Return, and keep as the last, the entry of the step from `before` to `after`."""
        integrator, last, work = self.integrator, self.entry, after.work
        ranks = integrator.body.ranks
        entry = self._opening(after)
        entry.damping = last.damping - work.damping
        entry.friction = last.friction - work.friction
        entry.contact_work = last.contact_work + work.normal
        change = after.displacement - before.displacement
        load = free_part(integrator, integrator.mean_load(before))
        entry.load_work = last.load_work + work.road
        if callable(integrator.body.load):
            entry.load_work += entry.potential - last.potential + ranks.dot(load, change) + work.load
        entry.total = entry.kinetic + entry.strain + entry.potential
        entry.total += entry.damping + entry.friction - entry.load_work
        entry.gain, entry.numerical = entry.total - last.total, work.numerical
        impulse = integrator.dt * ranks.sum(ranks.own(load).sum(axis=0)) + work.impulse
        if integrator.body.floats:
            entry.momentum_error = float(np.abs(entry.momentum - last.momentum - impulse).max())
        self.entry = entry
        return entry

    def skip(self, after: State) -> None:
        """Note what the step to `after` dissipated and nothing else, where loads do not change."""
        self.entry.damping -= after.work.damping
        self.entry.friction -= after.work.friction

    def _opening(self, state: State) -> Entry:
        body = self.integrator.body
        momenta = (self.integrator.M @ state.velocity.ravel()).reshape(state.velocity.shape)
        kinetic, strain, potential = energies(self.integrator, state)
        total = kinetic + strain + potential
        error = 0.0 if body.floats else np.nan
        momentum = body.ranks.sum(free_part(self.integrator, momenta).sum(axis=0))
        return Entry(kinetic, strain, potential, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, total, momentum, error)


def free_part(integrator: TimeIntegrator, values: np.ndarray) -> np.ndarray:
    """Values (N, d) of what moves by itself: supports are driven, and what they do is a load on the rest."""
    return np.where(integrator.body.prescribed, 0.0, values)


def energies(integrator: TimeIntegrator, state: State) -> tuple[float, float, float]:
    """Kinetic, strain and load energy of a state."""
    body = integrator.body
    v = free_part(integrator, state.velocity).ravel()
    potential = -body.ranks.dot(free_part(integrator, body.load_at(state.time)), state.displacement)
    return (
        0.5 * float(body.ranks.sum(v @ (integrator.M @ v))),
        body.strain_energy(state.displacement),
        potential,
    )


def total_energy(integrator: TimeIntegrator, state: State) -> float:
    """Their sum."""
    return sum(energies(integrator, state))


class GrowthWatch:
    """Says once when an integrator has added more than a few per cent to the energy of a run.

    Or more than its own identity allows, where it has one. The energy at work is what the body began with,
    what its weight has given it and what changing loads have put in.

    Parameters
    ----------
    integrator : TimeIntegrator
    entry : Entry
        Of the start of the run.
    """

    def __init__(self, integrator: TimeIntegrator, entry: Entry):
        self.integrator, self.start = integrator, entry
        self.fallen, self.driven = 0.0, 0.0
        self.warned = False

    def check(self, entry: Entry, time: float, explained: float = np.nan) -> None:
        """Warn if too much has been added.

        Parameters
        ----------
        entry : Entry
            Of the time reached.
        time : float
        explained : float
            What the integrator's identity says of all steps so far; NaN where there is none.

        Warns
        -----
        EnergyGrowth
            Once, with the numbers and what to do.
        """
        start = self.start
        self.fallen = max(self.fallen, start.potential - entry.potential)
        self.driven = max(self.driven, abs(entry.load_work))
        at_work = start.kinetic + start.strain + self.fallen + self.driven
        added = entry.total - start.total
        unexplained = abs(added - explained) if np.isfinite(explained) else 0.0
        if not self.warned and (added > GROWTH * at_work > 0.0 or unexplained > UNEXPLAINED * at_work > 0.0):
            self.warned = True
            warnings.warn(self._words(added, unexplained, at_work, time), EnergyGrowth, stacklevel=3)

    def _words(self, added: float, unexplained: float, at_work: float, time: float) -> str:
        integrator = self.integrator
        done, of = ("added", "to") if added > 0.0 else ("lost", "of")
        words = (
            f"{integrator.name} with dt = {integrator.dt:.3g} has {done} {abs(added):.3g} {of} an energy of "
            f"{at_work:.3g} by time {time:.4g} ({100.0 * added / at_work:.2g} %)"
        )
        if unexplained > UNEXPLAINED * at_work:
            return f"{words}, {unexplained:.2g} of it beyond its own identity: ask for a smaller tolerance."
        if isinstance(integrator, Midpoint | CentralDifferences):
            return f"{words}: take smaller steps."
        return (
            f"{words}, by contacts that open and close within a step: take ContactStabilised or "
            "MassRedistribution, which never gain energy in contact."
        )
