"""What PETSc makes of the truncated matrix of many ranks: algebraic multigrid (GAMG), or factors (MUMPS)."""

import sys
from typing import Any

import numpy as np
from scipy.sparse import bsr_array

from model.ranks.gathered_meshes import WholeMesh
from model.ranks.shared_levels import SharedLevel

SHIFT = 1e-10  # of the largest diagonal entry, where a body that contact alone holds would leave no factors


def has_petsc() -> bool:
    """Whether PETSc has been loaded, as dolfinx does where both are there."""
    return "petsc4py.PETSc" in sys.modules


class PetscCycle:
    """Solves for the unknowns that truncation leaves, about (algebraic) or wholly (direct).

    Parameters
    ----------
    finest : SharedLevel
    coordinates : (nodes, d)
        Of the nodes held here: GAMG is told the rigid motions.
    correction : "algebraic" or "direct"
    """

    def __init__(self, finest: SharedLevel, coordinates: np.ndarray, correction: str):
        self.levels, self.correction = [finest], correction
        exchange = finest.ranks
        self._petsc: Any = sys.modules["petsc4py.PETSc"]
        mesh, d = WholeMesh(exchange, finest.nodes), finest.d
        self._columns, self._count = (mesh.number[:, None] * d + np.arange(d)).ravel(), mesh.size
        self._points = exchange.own(coordinates)
        self._solver: Any = None
        self._stale, self._z = True, np.zeros(finest.shape)

    def truncate(self, nodes: np.ndarray, projectors: np.ndarray) -> None:
        """Hold nodes (k,), ghosts too, to the ranges of their projectors (k, d, d)."""
        self.levels[0].hold(nodes, projectors)
        self._stale = True

    def _set_up(self) -> None:
        """Hand the truncated matrix to PETSc; collective."""
        level, petsc = self.levels[0], self._petsc
        A, d, owned = level.A, level.d, level.ranks.owned
        T = np.where(level.held[:, None, None], level.T, np.eye(d))
        rows = np.repeat(np.arange(owned), np.diff(A.indptr).astype(np.int64))
        data = T[rows] @ A.data @ T[A.indices]
        largest = level.ranks.max(float(np.abs(A.data[level.middle]).max(initial=0.0)))
        data[level.middle] += largest * (np.eye(d) - T[:owned]) + SHIFT * largest * np.eye(d)
        shape = (owned * d, level.nodes * d)
        whole = bsr_array((data, A.indices.astype(np.int64), A.indptr.astype(np.int64)), shape=shape).tocsr()
        sizes = ((owned * d, self._count * d),) * 2
        csr = (
            whole.indptr.astype(petsc.IntType),
            self._columns[whole.indices].astype(petsc.IntType),
            whole.data,
        )
        self.destroy()
        matrix = petsc.Mat().createAIJ(sizes, bsize=d, csr=csr, comm=level.ranks.comm)
        matrix.setOption(petsc.Mat.Option.SPD, True)
        self._solver = solver = petsc.KSP().create(level.ranks.comm)
        solver.setType("preonly")
        pc = solver.getPC()
        self._x, self._b = matrix.createVecs()
        if self.correction == "direct":
            pc.setType("cholesky")
            pc.setFactorSolverType("mumps")
        else:
            pc.setType("gamg")
            at = matrix.createVecRight()
            at.setBlockSize(d)
            at.array[:] = self._points.ravel()
            matrix.setNearNullSpace(petsc.NullSpace().createRigidBody(at))
        solver.setOperators(matrix)
        solver.setUp()
        self._matrix = matrix

    def destroy(self) -> None:
        """Give back what PETSc holds; collective."""
        if self._solver is not None:
            for thing in (self._solver, self._matrix, self._x, self._b):
                thing.destroy()
            self._solver = None

    def __call__(self, r: np.ndarray, left: np.ndarray | None = None) -> np.ndarray:
        """Solve for A z = r, as `SharedCycle` does; collective."""
        level = self.levels[0]
        if self._stale:
            self._set_up()
            self._stale = False
        self._b.array[:] = r[: level.ranks.owned].ravel()
        self._solver.solve(self._b, self._x)
        self._z[: level.ranks.owned] = self._x.array.reshape(-1, level.d)
        level.ranks.update(self._z)
        if left is not None:
            level.missing(r, self._z, left)
        return self._z
