"""Explicit central differences on a lumped mass, with the contact still exact.

    u* = u0 + dt v0 + dt^2 / 2 a0,    u1 = u* + dt^2 M^-1 p,    a1 = M^-1 (load - C v' - K u1),    v1 = v' +
    dt / 2 a1,

v' = (u1 - u0) / dt. With a diagonal mass the contact problem falls apart into nodes, and one sweep of the
paper's loop solves it. Stable for dt < 2 / omega, omega the highest frequency of the mesh.

Source: Carpenter, Taylor and Katona, Int. J. Numer. Meth. Engng 32 (1991) 103.
"""

from time import perf_counter
from typing import Any

import numpy as np
from scipy.sparse import bsr_array, diags_array

from checks import positive
from model.dynamics.moving_body import MovingBody
from model.dynamics.time_integrator import State, TimeIntegrator
from model.solvers.krylov import largest_eigenvalue
from model.tolerances import TOLERANCE

LANCZOS = 1e-6  # relative, of the highest eigenvalue; it costs half of that of dt


class CentralDifferences(TimeIntegrator):
    """Explicit central differences.

    Parameters
    ----------
    body, dt, tolerance
        As for `TimeIntegrator`.

    Raises
    ------
    ValueError
        If dt is beyond the limit of stability, or lumping leaves a node without mass.

    Examples
    --------
    >>> from forms import Elasticity, Isotropic
    >>> from geometry import Body, Plane, rectangle
    >>> from model import MovingBody, CentralDifferences
    >>> elasticity = Elasticity(Body.from_grid(rectangle(2.0, 1.0, 4, 2)), Isotropic(E=1e4, nu=0.3))
    >>> weight = elasticity.body_force((0.0, -10.0))
    >>> body = MovingBody.from_forms(elasticity, 1.0, weight, Plane(point=(0.0, -0.001)), "bottom")
    >>> scheme = CentralDifferences(body, dt=0.001)
    >>> state = scheme.run(scheme.start(), 20)
    >>> bool(state.gap.min() == 0.0)  # it has landed
    True
    """

    name = "central differences"

    def __init__(self, body: MovingBody, dt: float, tolerance: float = TOLERANCE):
        positive(dt=dt)
        ones, ranks = np.ones(body.M.shape[0]), body.ranks
        self._lumped = np.where(body.prescribed.ravel(), body.M.diagonal(), body.M @ ones)
        ranks.update(self._lumped.reshape(body.coordinates.shape))
        lacking = "Lumping leaves a node without mass; use an implicit scheme on this mesh."
        ranks.agree("" if self._lumped.min(initial=np.inf) > 0.0 else lacking)
        limit = stable_step(body, self._lumped)
        beyond = f"dt is {dt:g}, but on this mesh central differences are stable to {limit:.3g}."
        ranks.agree(beyond if dt > limit else "")
        super().__init__(body, dt, correction="none", tolerance=tolerance)
        self._no_force = np.zeros_like(body.coordinates)

    def mass(self) -> Any:
        """Return the lumped mass; rows of other ranks' nodes are empty."""
        d, own = self.body.dim, self._lumped.copy()
        own[self.body.ranks.own(self.body.coordinates).size :] = 0.0
        return bsr_array(diags_array(own), blocksize=(d, d))

    def effective_matrix(self) -> Any:
        """Return M / dt^2."""
        return self.M * (1.0 / self.dt**2)

    def step(self, before: State) -> State:
        """Return the state one step later."""
        began = perf_counter()
        dt, v0 = self.dt, before.velocity
        moved = dt * v0 + (0.5 * dt**2) * before.acceleration
        touch = self.touch(before, moved, self._no_force)
        change = moved + touch.increment
        u1, speed = before.displacement + change, change / dt
        a1 = self.body.missing_force((before.step + 1) * dt, u1, speed) / self._lumped.reshape(u1.shape)
        v1 = speed + (0.5 * dt) * a1
        work = self.work(touch.force, change, before, touch.gap)
        work.damping = self.damping_work(speed, change)
        work.numerical = np.nan
        return self.after(before, touch, began, u1, v1, a1, touch.force, work)


def stable_step(body: MovingBody, lumped: np.ndarray) -> float:
    """Largest stable dt, 2 / omega with omega the highest frequency of K and the lumped mass (N d,).

    Lanczos' method approaches omega^2 from below; what its tolerance leaves is added.
    """
    scale = np.where(body.prescribed.ravel(), 0.0, 1.0 / np.sqrt(lumped))
    start, ranks = np.random.default_rng(0).standard_normal(lumped.size), body.ranks
    shape = body.coordinates.shape

    def product(v: np.ndarray) -> np.ndarray:
        ranks.update(v)
        return np.asarray(scale * (body.K @ (scale * v.ravel()))).reshape(shape)

    highest = largest_eigenvalue(product, start.reshape(shape), LANCZOS, ranks.dot)
    return 2.0 / float(np.sqrt(highest * (1.0 + LANCZOS)))
