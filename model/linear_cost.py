"""What a run would cost if there were no contact: one factorisation and one back-substitution a step."""

from time import perf_counter

import numpy as np
from scipy.sparse import csc_array
from scipy.sparse.linalg import splu

from .time_integrator import State, TimeIntegrator


def linear_seconds(integrator: TimeIntegrator, steps: int, repeat: int = 3) -> float:
    """Measure one factorisation of the effective matrix and so many back-substitutions.

    Parameters
    ----------
    integrator : TimeIntegrator
    steps : int
        Back-substitutions; of more than 100 a hundred are timed.
    repeat : int
        The quickest of so many measurements counts.

    Returns
    -------
    float
        Seconds.
    """
    A = csc_array(integrator.effective_matrix())
    b = np.random.default_rng(0).standard_normal(A.shape[0])
    factorisation, substitution, timed = np.inf, np.inf, min(steps, 100)
    for _ in range(repeat):
        began = perf_counter()
        factor = splu(A, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
        factored = perf_counter()
        for _ in range(timed):
            factor.solve(b)
        factorisation = min(factorisation, factored - began)
        substitution = min(substitution, (perf_counter() - factored) / timed)
    return factorisation + steps * substitution


def run_seconds(integrator: TimeIntegrator, start: State, steps: int) -> tuple[float, State]:
    """Take so many steps; return their seconds, and the last state."""
    began = perf_counter()
    state = integrator.run(start, steps)
    return perf_counter() - began, state
