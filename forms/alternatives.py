"""What a FEniCSx user would otherwise pick for the same scene.

PETSc's semi-smooth Newton method, and a penalty form.

Kept for comparison only; nothing else depends on it.
"""

from __future__ import annotations

from dataclasses import dataclass
from time import perf_counter
from typing import Any

import numpy as np
import scipy.sparse as sparse
from scipy.sparse.linalg import splu

from geometry import compat  # noqa: F401  # compat comes before petsc4py

from petsc4py import PETSc  # isort: skip
import ufl  # isort: skip
from dolfinx import fem  # isort: skip

from forms.elasticity import Elasticity


@dataclass
class Answer:
    """Displacement (N, dim), seconds from matrix and load to the answer, and Newton steps taken."""

    displacement: np.ndarray
    seconds: float
    steps: int


def vinewtonrsls(
    problem: Any, linear: str = "mumps", start: np.ndarray | None = None, tolerance: float = 1e-8
) -> Answer:
    """Solve a frictionless problem by PETSc's reduced-space semi-smooth Newton method.

    The road's normal is +y (+z in 3-D), the bounds are u_n >= -gap on the candidates. Benson and Munson,
    Optimization Methods and Software 21 (2006).

    Parameters
    ----------
    problem : model.ContactProblem
    linear : "mumps" for MUMPS's Cholesky factorisation, "gamg" for CG with GAMG and the rigid motions as its
        near-nullspace
    start : (N, dim), optional; first guess, whose bounds should hold the body
    tolerance : relative residual of the outer and, a hundred times smaller, of the inner iteration

    Raises
    ------
    ValueError
        for another road, or another linear solver
    RuntimeError
        if SNES does not converge
    """
    dim = problem.dim
    if not np.allclose(problem.normal, np.eye(dim)[-1]):
        raise ValueError(
            "vinewtonrsls has bounds for one component only: the road's normal must be the last axis."
        )
    began = perf_counter()
    A = problem.A.tocsr()
    K = PETSc.Mat().createAIJ(
        A.shape, csr=(A.indptr.astype(PETSc.IntType), A.indices.astype(PETSc.IntType), A.data)
    )
    K.setBlockSize(dim)
    K.setOption(PETSc.Mat.Option.SPD, True)  # type: ignore[arg-type]
    b, lower, upper, u = (K.createVecLeft() for _ in range(4))
    b.array[:] = problem.b.ravel()
    lower.set(PETSc.NINFINITY)
    upper.set(PETSc.INFINITY)
    lower.array[problem.contact_nodes * dim + dim - 1] = -problem.gap
    if start is not None:
        u.array[:] = start.ravel()

    def residual(snes: Any, x: Any, f: Any) -> None:
        K.mult(x, f)
        f.axpy(-1.0, b)

    snes = PETSc.SNES().create(PETSc.COMM_SELF)
    snes.setType("vinewtonrsls")
    snes.setFunction(residual, K.createVecLeft())
    snes.setJacobian(lambda snes, x, J, P: None, K)
    snes.setVariableBounds(lower, upper)
    snes.setTolerances(rtol=tolerance, atol=tolerance * float(np.linalg.norm(b.array)), stol=0.0, max_it=100)
    ksp, pc = snes.getKSP(), snes.getKSP().getPC()
    if linear == "mumps":
        ksp.setType("preonly")
        pc.setType("cholesky")
        pc.setFactorSolverType("mumps")
    elif linear == "gamg":
        coordinates = K.createVecLeft()
        coordinates.setBlockSize(dim)
        coordinates.array[:] = problem.coordinates.ravel()
        K.setNearNullSpace(PETSc.NullSpace().createRigidBody(coordinates))
        ksp.setType("cg")
        ksp.setTolerances(rtol=0.01 * tolerance, max_it=10_000)
        pc.setType("gamg")
    else:
        raise ValueError(f"linear is {linear!r}, but it must be 'mumps' or 'gamg'.")
    snes.solve(None, u)
    reason: Any = snes.getConvergedReason()
    steps = snes.getIterationNumber()
    answer = Answer(u.array.reshape(-1, dim).copy(), perf_counter() - began, steps)
    for thing in (snes, K, b, lower, upper, u):
        thing.destroy()
    if reason <= 0:
        raise RuntimeError(
            f"SNES vinewtonrsls with {linear} stopped with reason {reason} after {steps} steps."
        )
    return answer


def penalty(
    elasticity: Elasticity,
    load: np.ndarray,
    boundary: str,
    stiffness: float,
    fixed: np.ndarray,
    start: np.ndarray,
) -> Answer:
    """Solve a frictionless problem on the road y = 0 with a penalty form and Newton's method.

    Find u with a(u, v) - integral of stiffness <-g(u)>_+ v_y ds = load(v), g = y + u_y (Kikuchi and Oden,
    Contact Problems in Elasticity, 1988, chapter 6).

    Parameters
    ----------
    elasticity : of the body
    load : (N, dim)
    boundary : may touch
    stiffness : of the penalty, force per volume (MPa/mm)
    fixed : (k,) unknowns held at zero
    start : (N, dim) first guess

    Raises
    ------
    RuntimeError
        if Newton's method does not converge in 100 steps
    """
    body = elasticity.body
    began = perf_counter()
    K = elasticity.stiffness().tocsr()
    u = fem.Function(elasticity.V)
    u.x.array[:] = start.ravel()
    v, w = ufl.TestFunction(elasticity.V), ufl.TrialFunction(elasticity.V)
    gap = ufl.SpatialCoordinate(body.mesh)[body.dim - 1] + u[body.dim - 1]
    kappa = fem.Constant(body.mesh, float(stiffness))
    ds = ufl.Measure("ds", body.mesh, subdomain_data=body.facet_tags, metadata={"quadrature_degree": 3})
    ds = ds(body.names[boundary])
    force = fem.form(-kappa * ufl.max_value(-gap, 0.0) * v[body.dim - 1] * ds)
    tangent = fem.form(
        kappa * ufl.conditional(ufl.lt(gap, 0.0), 1.0, 0.0) * w[body.dim - 1] * v[body.dim - 1] * ds
    )
    keep = np.setdiff1d(np.arange(K.shape[0]), fixed)
    scale = np.linalg.norm(load)
    for step in range(1, 101):
        r = load.ravel() - K @ u.x.array - fem.assemble_vector(force).array
        if np.linalg.norm(r[keep]) < 1e-9 * scale:
            return Answer(u.x.array.reshape(load.shape).copy(), perf_counter() - began, step - 1)
        T = fem.assemble_matrix(tangent)
        T.scatter_reverse()
        J = sparse.csc_array(K + sparse.csr_array(T.to_scipy()))[keep][:, keep]
        u.x.array[keep] += splu(sparse.csc_array(J), permc_spec="MMD_AT_PLUS_A").solve(r[keep])
    raise RuntimeError(
        f"Newton's method on the penalty form with stiffness {stiffness:g} did not converge in 100 steps."
    )
