"""The contact problem of one time step, for other solvers to check."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np

from model.dynamics.time_integrator import State, TimeIntegrator
from model.problem.contact_problem import ContactProblem


def step_problem(integrator: TimeIntegrator, before: State) -> tuple[ContactProblem, SimpleNamespace]:
    """Take a step, and say what its contact problem was.

    Displacements count from the beginning of the step, where every node would stick; coordinates are those
    there. The smaller problems that the stabilised schemes solve beside it are left out.

    Parameters
    ----------
    integrator : TimeIntegrator
    before : State
        Where the step begins.

    Returns
    -------
    problem : ContactProblem
    solution
        Its `displacement` (N, d) and `contact_force` (n, d), as `ContactProblem.save` takes them.
    """
    integrator.step(before)
    moved, b, touch = integrator.posed
    body, A = integrator.body, integrator.effective_matrix()
    end = (before.step + 1) * integrator.dt
    gap, normal = body.gaps(before.displacement, end) if body.road_moves else integrator.ground(before)
    problem = ContactProblem(
        A,
        b + (A @ moved.ravel()).reshape(b.shape),
        body.coordinates + before.displacement,
        body.contact_nodes,
        normal,
        gap,
        body.friction,
        tangential_reference=np.zeros_like(normal) + integrator.way(before),
        prolongations=body.prolongations,
        interference=body.road_moves,
    )
    return problem, SimpleNamespace(displacement=moved + touch.increment, contact_force=touch.force)


def save_step(path: str | Path, integrator: TimeIntegrator, before: State) -> None:
    """Write the contact problem of the step after `before`, and its solution, to an `.npz` file."""
    problem, solution = step_problem(integrator, before)
    problem.save(path, solution)
