"""Consistent initial acceleration, also for a body that starts in contact.

    M a = load - K u - C v + contact forces,                                                           (1)

where a node that touches (g = 0) must not accelerate into the road, sticks if it is at rest and slips against
its velocity if it is not. That is the contact problem once more: with M/epsilon for a matrix and the change
of velocity epsilon a for a displacement, the normal velocity for a gap and -v for the place where a node
sticks. A node that starts on the road with a velocity into it gets none of that impact here: its acceleration
is then >= 0.
"""

from types import SimpleNamespace
from typing import Any

import numpy as np

from model.dynamics.contact_update import confirm_contact
from model.dynamics.moving_body import MovingBody, rates_at_start
from model.one_rank import ONE_RANK
from model.ranks.solver_of import solver_of
from model.solvers.krylov import conjugate_gradients
from model.tolerances import TOLERANCE

EXACT, STEPS = 1e-15, 300  # residual, and conjugate gradients at most: three times what mass matrices ask for


def consistent_acceleration(
    body: MovingBody,
    u: np.ndarray,
    v: np.ndarray,
    gap: np.ndarray,
    normal: np.ndarray,
    dt: float,
    correction: str = "direct",
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Accelerations and contact forces at the start.

    Parameters
    ----------
    body : MovingBody
    u, v : (N, d)
        Initial displacement and velocity.
    gap, normal : (n,), (n, d)
        Of the candidates at u; gaps of those that touch exactly 0.
    dt : float
        Time step; only its size matters.
    correction : str
        As for `ContactSolver`.

    Returns
    -------
    acceleration (N, d), contact force (n, d), status (n,)
    """
    r = body.missing_force(0.0, u, v)
    force, status = np.zeros(normal.shape), np.zeros(gap.size, dtype=np.int8)
    in_contact = np.flatnonzero(gap == 0.0)
    ranks = body.ranks
    if not ranks.any(in_contact.size > 0):
        return mass_inverse(body.M, r, ranks), force, status
    nodes = body.contact_nodes[in_contact]
    epsilon = 2.0**-20 * dt
    speed, rate = road_rates(body, body.positions(u)[in_contact], dt)
    relative = v[nodes] - speed - epsilon * rate
    leaving = np.maximum(np.einsum("ca,ca->c", normal[in_contact], relative), 0.0)
    friction: Any = body.friction
    law = friction if friction is None else friction.of(in_contact)
    problem = body.problem(body.M / epsilon, r, nodes, normal[in_contact], leaving, law or False, -relative)
    solver = solver_of(problem, correction, progress=False, steps=True)
    places = body.places(SimpleNamespace(displacement=u, time=0.0))[in_contact]
    solution = solver.solve(tangential_reference=-relative, tolerance=0.01 * TOLERANCE, places=places)
    address = None if law is None else law.address
    rate = np.empty(in_contact.size)
    change, pushes, decided = solution.displacement, solution.contact_force, solution.status
    if not ranks.sum(confirm_contact(solver.loop.contact, change, pushes, address, decided, rate)):
        return mass_inverse(body.M, r, ranks), force, status
    force[in_contact], status[in_contact] = pushes, decided
    return change / epsilon, force, status


def road_rates(body: MovingBody, points: np.ndarray, dt: float) -> tuple[np.ndarray, np.ndarray]:
    """Velocity and acceleration (n, d) at time 0 of points of the road, by differences of second order."""
    if not body.road_moves:
        return np.zeros_like(points), np.zeros_like(points)
    return rates_at_start([body.carried(points, 0.0, 0.5 * dt * k) for k in range(4)], 0.5 * dt)


def mass_inverse(M: Any, r: np.ndarray, ranks: Any = ONE_RANK) -> np.ndarray:
    """Solve M a = r for a (N, d), by conjugate gradients from the lumped solution; 0 where no mass is.

    Scaled by its diagonal, M has a condition of 27 at most, on hexahedra (A. J. Wathen, IMA J. Numer. Anal. 7
    (1987)), so that 100 steps are enough for the last digit.
    """
    own, lumped = (x.reshape(r.shape) for x in (M.diagonal(), M @ np.ones(r.size)))
    diagonal, force = np.where(own == 0.0, 1.0, own), np.where(own == 0.0, 0.0, r)
    guess = force / np.where(lumped > 0.0, lumped, diagonal)
    ranks.update(guess)

    def missing(r: np.ndarray, a: np.ndarray) -> np.ndarray:
        return np.asarray(r - (M @ a.ravel()).reshape(r.shape))

    def cycle(r: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        z = r / diagonal
        ranks.update(z)
        return z, missing(r, z)

    wanted = EXACT * np.sqrt(ranks.dot(force, force))
    return guess + conjugate_gradients(cycle, missing(force, guess), wanted, STEPS, ranks)[0]
