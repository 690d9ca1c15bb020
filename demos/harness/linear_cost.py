"""What a run costs beside one without contact: one factorisation, and one back-substitution a step."""

from time import perf_counter

import numpy as np
from scipy.sparse import csc_array

from model.dynamics.time_integrator import State, TimeIntegrator
from model.solvers.factorisation import factorised


def run_seconds(integrator: TimeIntegrator, start: State, steps: int) -> tuple[float, State]:
    """Take so many steps; return their seconds, and the last state."""
    began = perf_counter()
    state = integrator.run(start, steps)
    return perf_counter() - began, state


def beside_linear(
    integrator: TimeIntegrator, state: State, steps: int, every: int = 1
) -> tuple[np.ndarray, float, np.ndarray]:
    """Take so many steps, and in between time what steps without contact would take.

    Both are measured at the same time, so that whatever else the machine does slows both.

    Parameters
    ----------
    integrator : TimeIntegrator
    state : State
    steps : int
    every : int
        Steps from one timed back-substitution to the next.

    Returns
    -------
    seconds of each step (steps,), of one factorisation, and of each back-substitution (steps / every,)
    """
    A = csc_array(integrator.effective_matrix())
    b = np.random.default_rng(0).standard_normal(A.shape[0])
    began = perf_counter()
    factor = factorised(A)
    factorisation = perf_counter() - began
    taken, linear = [], []
    for number in range(steps):
        state = integrator.step(state)
        taken.append(state.seconds)
        if number % every == 0:
            began = perf_counter()
            factor.solve(b)
            linear.append(perf_counter() - began)
    return np.array(taken), factorisation, np.array(linear)
