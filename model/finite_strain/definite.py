"""Positive definite matrices, by the signs of pivots and a shift."""

from typing import Any

import numpy as np
from scipy.sparse import bsr_array, csc_array, diags_array

from model.solvers.factorisation import by_superlu

NONE_LOST = 1e-13  # of the diagonal: some roundings
FIRST_SHIFT = 1e-4  # of the diagonal at rest; doubled until it is enough


def indefinite(A: Any) -> bool:
    """Tell whether a symmetric matrix has a negative eigenvalue (Sylvester's law of inertia).

    That of a body which nothing holds is singular; whatever may be missing of a factorisation there is added.
    """
    try:
        pivots = by_superlu(csc_array(A)).U.diagonal()
    except RuntimeError:  # a pivot is 0
        more = diags_array(np.full(A.shape[0], NONE_LOST * np.abs(A.diagonal()).max()))
        pivots = by_superlu(csc_array(A + more)).U.diagonal()
    return bool(pivots.min() < -1e-12 * np.abs(pivots).max())


def shifted(A: Any, diagonal: np.ndarray) -> Any:
    """Return A (N d, N d) plus as much of a diagonal (N d,) as makes it positive definite; A if it is."""
    shift, d = FIRST_SHIFT, A.blocksize[0]
    found = A
    while indefinite(found):
        found = bsr_array(A + diags_array(shift * diagonal), blocksize=(d, d))
        shift *= 2.0
    return found
