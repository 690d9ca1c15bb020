"""Whether dt resolves the waves that a scene excites.

The mean frequency of a motion is that of its velocity v with the rigid part taken out,

    omega^2 = v . K v / v . M v                                                                (1)

(Rayleigh's quotient): how often, weighted by energy, the body swings. An implicit scheme stays stable where
dt does not resolve it, and wrong. This says so, with the numbers.
"""

import warnings

import numpy as np

from model.dynamics.moving_body import RigidPart
from model.dynamics.time_integrator import State, TimeIntegrator

ENOUGH = 10  # steps per period: the trapezoidal rule then swings (omega dt)^2 / 12 = 3.3 % too slowly
WORTH = 1e-6  # part of the kinetic energy, a thousandth of the speed, that deformation must have to count


class UnresolvedWaves(UserWarning):
    """dt is too long for the waves in the body."""


class Resolution:
    """Watches the steps per period of the waves in a body.

    Parameters
    ----------
    integrator : TimeIntegrator

    Attributes
    ----------
    fewest : float
        Steps per mean period, at the worst time so far; infinite where nothing has swung.
    at : float
        That time.
    """

    def __init__(self, integrator: TimeIntegrator):
        body = integrator.body
        self.integrator, self.rigid = integrator, RigidPart(integrator.M, body.coordinates, body.ranks)
        self.fewest, self.at = np.inf, 0.0
        self._warned = False

    def measure(self, state: State) -> float:
        """Return the steps per mean period at this state, and warn, once a run, if they are too few."""
        integrator = self.integrator
        v, total = state.velocity.copy(), integrator.body.ranks.sum
        if integrator.body.finite_strain:
            self.rigid = RigidPart(integrator.M, integrator.body.coordinates + state.displacement)
        if integrator.body.floats:
            v = self.rigid.deformation(v)
        kinetic = total(float(v.ravel() @ (integrator.M @ v.ravel())))
        whole = total(float(state.velocity.ravel() @ (integrator.M @ state.velocity.ravel())))
        if not kinetic > WORTH * whole:
            return np.inf
        K = integrator.body.stiffness_at(state.displacement)
        omega = np.sqrt(max(total(float(v.ravel() @ (K @ v.ravel()))), 0.0) / kinetic)
        steps = float(2.0 * np.pi / (omega * integrator.dt)) if omega > 0.0 else np.inf
        if steps < self.fewest:
            self.fewest, self.at = steps, state.time
        if steps < ENOUGH and not self._warned:
            self._warned = True
            warnings.warn(
                f"dt = {integrator.dt:.3g} does not resolve the waves in the body: at time {state.time:.4g} "
                f"their mean period is {steps * integrator.dt:.3g}, {steps:.2g} steps; {ENOUGH} steps a "
                f"period take dt = {steps * integrator.dt / ENOUGH:.2g}.",
                UnresolvedWaves,
                stacklevel=2,
            )
        return steps
