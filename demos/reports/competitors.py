"""What else solves a frictionless problem with bounds: PETSc's SNES and TAO.

They take the matrices of a `model.ContactProblem` whose road's normal is the last axis, start from the same first
guess, stop by the same residual, run on one core, and use MUMPS with the ordering that is asked for.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np

from geometry import compat  # noqa: F401  # comes before petsc4py

from petsc4py import PETSc  # isort: skip

ORDERINGS = {"AMD": 0, "AMF": 2, "Scotch": 3, "PORD": 4, "METIS": 5, "QAMD": 6}  # MUMPS's ICNTL(7)
PREFIX = "competitor_"


class Answer(NamedTuple):
    """Displacement (N, dim), seconds from matrix and load to the answer, and outer steps."""

    displacement: np.ndarray
    seconds: float
    steps: int


def snes(
    problem: Any,
    kind: str = "vinewtonrsls",
    linear: str = "mumps",
    start: np.ndarray | None = None,
    tolerance: float = 1e-8,
    ordering: str = "METIS",
) -> Answer:
    """Solve by PETSc's semismooth Newton methods with bounds (Benson and Munson, 2006).

    Parameters
    ----------
    problem : ContactProblem
    kind : str
        "vinewtonrsls" (reduced space) or "vinewtonssls" (Fischer and Burmeister's function).
    linear : str
        "mumps" for a factorisation, "gamg" for CG with GAMG and the rigid motions as its near null space.
    start : (N, dim), optional
        First guess, whose bounds should hold the body.
    tolerance : float
        Residual over the load.
    ordering : str
        Of MUMPS, one of `ORDERINGS`.

    Raises
    ------
    RuntimeError
        If SNES does not converge.
    """
    began = perf_counter()
    K, b, u, bounds = _in_petsc(problem, start)
    solver = PETSc.SNES().create(PETSc.COMM_SELF)
    solver.setType(kind)
    solver.setFunction(lambda snes, x, f: (K.mult(x, f), f.axpy(-1.0, b)), K.createVecLeft())
    solver.setJacobian(lambda snes, x, J, P: None, K)
    solver.setVariableBounds(*bounds)
    small = tolerance * b.norm()
    solver.setTolerances(rtol=0.0, atol=small, stol=0.0, max_it=100)
    with _linear(solver.getKSP(), linear, 0.01 * tolerance, ordering):
        solver.setOptionsPrefix(PREFIX)
        solver.getKSP().setFromOptions()
        solver.solve(None, u)
    return _answer(f"SNES {kind} with {linear}", solver, u, problem.dim, began)


def tao(
    problem: Any,
    kind: str,
    linear: str = "",
    start: np.ndarray | None = None,
    tolerance: float = 1e-8,
    ordering: str = "METIS",
) -> Answer:
    """Solve the quadratic programme with bounds by PETSc's TAO.

    Parameters
    ----------
    problem, start, tolerance, ordering
        As for `snes`.
    kind : str
        "gpcg" (gradient projection and conjugate gradients, Moré and Toraldo 1991), "blmvm" (limited-memory
        variable metric, Benson and Moré 2001), "bqpip" (interior point) or "bnls" (Newton on the active set).
    linear : str
        "mumps" or "gamg" where the method solves linear systems.

    Raises
    ------
    RuntimeError
        If TAO does not converge.
    """
    began = perf_counter()
    K, b, u, bounds = _in_petsc(problem, start)
    solver = PETSc.TAO().create(PETSc.COMM_SELF)
    solver.setType(kind)

    def energy(tao: Any, x: Any, g: Any) -> float:
        K.mult(x, g)
        value = 0.5 * x.dot(g) - x.dot(b)
        g.axpy(-1.0, b)
        return value

    solver.setObjectiveGradient(energy, K.createVecLeft())
    solver.setHessian(lambda tao, x, H, P: None, K)
    solver.setVariableBounds(bounds)
    solver.setTolerances(gatol=tolerance * b.norm(), grtol=0.0, gttol=0.0)
    solver.setMaximumIterations(5_000 if kind == "blmvm" else 200)
    solver.setSolution(u)
    solver.setOptionsPrefix(PREFIX)
    if linear:
        solver.setFromOptions()
        with _linear(solver.getKSP(), linear, 0.01 * tolerance, ordering):
            solver.getKSP().setFromOptions()
            solver.solve()
    else:
        solver.solve()
    return _answer(f"TAO {kind} {linear}".strip(), solver, u, problem.dim, began)


def _in_petsc(problem: Any, start: np.ndarray | None) -> tuple[Any, Any, Any, tuple[Any, Any]]:
    """Matrix with its near null space, load, first guess, and bounds."""
    dim = problem.dim
    if not np.allclose(problem.normal, np.eye(dim)[-1]):
        raise ValueError("Bounds are for one component only: the road's normal must be the last axis.")
    A = problem.A.tocsr()
    arrays = A.indptr.astype(PETSc.IntType), A.indices.astype(PETSc.IntType), A.data
    K = PETSc.Mat().createAIJ(A.shape, csr=arrays)
    K.setBlockSize(dim)
    K.setOption(PETSc.Mat.Option.SPD, True)
    b, lower, upper, u, coordinates = (K.createVecLeft() for _ in range(5))
    b.array[:] = problem.b.ravel()
    lower.set(PETSc.NINFINITY)
    upper.set(PETSc.INFINITY)
    lower.array[problem.contact_nodes * dim + dim - 1] = -problem.gap
    u.array[:] = 0.0 if start is None else start.ravel()
    coordinates.setBlockSize(dim)
    coordinates.array[:] = problem.coordinates.ravel()
    K.setNearNullSpace(PETSc.NullSpace().createRigidBody(coordinates))
    return K, b, u, (lower, upper)


@contextmanager
def _linear(ksp: Any, linear: str, tolerance: float, ordering: str) -> Iterator[None]:
    """Choose the linear solver; MUMPS's ordering is an option only while it runs."""
    pc, options, key = ksp.getPC(), PETSc.Options(), f"{PREFIX}mat_mumps_icntl_7"
    if linear == "mumps":
        ksp.setType("preonly")
        pc.setType("cholesky")
        pc.setFactorSolverType("mumps")
    elif linear == "gamg":
        ksp.setType("cg")
        ksp.setTolerances(rtol=tolerance, max_it=10_000)
        pc.setType("gamg")
    else:
        raise ValueError(f"linear is {linear!r}, but it must be 'mumps' or 'gamg'.")
    options[key] = ORDERINGS[ordering]
    try:
        yield
    finally:
        options.delValue(key)


def _answer(name: str, solver: Any, u: Any, dim: int, began: float) -> Answer:
    """Read the answer, or say that there is none."""
    reason, steps = solver.getConvergedReason(), solver.getIterationNumber()
    if reason <= 0:
        raise RuntimeError(f"{name} stopped with reason {reason} after {steps} steps.")
    return Answer(u.array.reshape(-1, dim).copy(), perf_counter() - began, steps)
