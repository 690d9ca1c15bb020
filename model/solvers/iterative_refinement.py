"""A displacement in two parts, where a double has too few digits for one.

A hard part that a soft one carries far off turns the rounding of its displacement, eps u, into forces
eps K u that may exceed what the soft part bears. Then the displacement is base + increment: what is missing
at the base is found with longer numbers, and the contact problem is solved once more, for the increment:

    A e = (b - A base) + contact forces,    (gap + n . base) + n . e >= 0.
"""

from typing import Any

import numpy as np
from scipy.sparse import bsr_array, csr_array

from model.node_loop.blocks import BlockMatrix

ROUNDING = float(np.finfo(np.float64).eps)


def rounding_floor(A: BlockMatrix, u: np.ndarray, scale: float) -> float:
    """Natural residual that the rounding of u (N, d) alone may leave, against forces of size `scale`."""
    size = np.abs(bsr_array((A.data, A.indices.astype(np.int64), A.indptr.astype(np.int64))))
    return ROUNDING * float(np.linalg.norm(size @ np.abs(u).ravel())) / scale if scale > 0.0 else 1.0


def missing_at(A: bsr_array, b: np.ndarray, base: np.ndarray) -> np.ndarray:
    """Return b - A base, (N, d), with every sum in long doubles."""
    long = csr_array(A).astype(np.longdouble)
    return np.asarray(b - (long @ base.ravel().astype(np.longdouble)).reshape(base.shape), dtype=np.float64)


def gap_at(gap: np.ndarray, normal: np.ndarray, base: Any) -> np.ndarray:
    """Return gap + n . base, (n,), at the candidates' displacements base (n, d), in long doubles."""
    along = np.sum(normal.astype(np.longdouble) * base, axis=1)
    return np.asarray(gap + along, dtype=np.float64)
