"""Sparse factorisation of symmetric positive definite matrices, by the best library at hand.

PETSc's MUMPS (P. R. Amestoy et al., SIAM J. Matrix Anal. Appl. 23 (2001)) factorises two to four times faster
than SuperLU, and solves for several right-hand sides at once. Bodies built by dolfinx have brought PETSc with
them; without it, SuperLU does.
"""

import sys
from typing import Any, Protocol

import numpy as np
from scipy.sparse import csc_array
from scipy.sparse.linalg import SuperLU, splu


class Factor(Protocol):
    """A factorised matrix."""

    def solve(self, b: np.ndarray) -> np.ndarray:
        """Solve A x = b for b (n,) or (n, k)."""
        ...


def factorised(A: csc_array) -> Factor:
    """Factorise a symmetric positive definite matrix (n, n).

    Raises
    ------
    RuntimeError
        If it is singular.

    Example
    -------
    >>> import numpy as np
    >>> from scipy.sparse import csc_array
    >>> factor = factorised(csc_array([[2.0, 1.0], [1.0, 2.0]]))
    >>> np.round(factor.solve(np.array([3.0, 3.0])), 12)
    array([1., 1.])
    """
    petsc: Any = sys.modules.get("petsc4py.PETSc")
    if petsc is not None and petsc.Sys.hasExternalPackage("mumps"):
        factor = MumpsCholesky(A, petsc)
        if factor.positive:  # else rounding has left the matrix indefinite, or it is singular
            return factor
    return by_superlu(A)


def by_superlu(A: csc_array) -> SuperLU:
    """Factorise a symmetric matrix by SuperLU, whose factors can be looked at, its pivots on the diagonal."""
    return splu(A, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})


class MumpsCholesky:
    """Cholesky factors by PETSc's MUMPS, on one process.

    Attributes
    ----------
    positive : bool
        Whether the matrix was found positive definite, without which there are no factors.
    """

    def __init__(self, A: csc_array, petsc: Any):
        self._petsc = petsc
        arrays = A.indptr.astype(petsc.IntType), A.indices.astype(petsc.IntType), A.data
        matrix = petsc.Mat().createAIJ(A.shape, csr=arrays, comm=petsc.COMM_SELF)  # by columns: symmetric
        matrix.setOption(petsc.Mat.Option.SPD, True)
        self._pc = petsc.PC().create(petsc.COMM_SELF)
        self._pc.setOperators(matrix)
        self._pc.setType("cholesky")
        self._pc.setFactorSolverType("mumps")
        self._pc.setUp()
        self._factor = self._pc.getFactorMatrix()
        self.positive = self._pc.getFailedReason() == 0 and self._factor.getMumpsInfog(12) == 0

    def solve(self, b: np.ndarray) -> np.ndarray:
        """Solve A x = b for b (n,) or (n, k)."""
        petsc, comm = self._petsc, self._petsc.COMM_SELF
        if b.ndim == 1:
            x = np.empty_like(b)
            right = petsc.Vec().createWithArray(np.ascontiguousarray(b), comm=comm)
            self._factor.solve(right, petsc.Vec().createWithArray(x, comm=comm))
            return x
        right = petsc.Mat().createDense(b.shape, array=np.asfortranarray(b), comm=comm)
        answers = petsc.Mat().createDense(b.shape, comm=comm)
        answers.setUp()
        self._factor.matSolve(right, answers)
        return np.array(answers.getDenseArray(), order="F")
