"""Weak forms of frictionless contact, as users of FEniCSx write them: penalty, Nitsche, latent variable.

All on the road of height 0, its normal the last axis. Contact holds in a weak sense, so each leaves some
penetration. Newton's steps are solved by MUMPS, as symmetric systems where they are.
"""

from dataclasses import dataclass
from functools import cached_property
from time import perf_counter
from typing import Any

import numpy as np
import scipy.sparse as sparse
from competitors import ORDERINGS, Answer

from geometry import compat  # noqa: F401  # comes before petsc4py

from petsc4py import PETSc  # isort: skip
import ufl  # isort: skip
from dolfinx import fem  # isort: skip

STEPS = 100  # of Newton's method at most
ROUNDS = 25  # of the proximal point method at most


@dataclass
class Pressed:
    """A body that a load or a prescribed displacement presses on the road.

    Parameters
    ----------
    elasticity : forms.Elasticity
        Of one isotropic material.
    load : (N, dim)
    boundary : str
        May touch.
    fixed : (k,)
        Unknowns that are prescribed.
    values : (k,) or float
        What they are prescribed to be.
    degree : int
        Of the quadrature on the boundary.
    """

    elasticity: Any
    load: np.ndarray
    boundary: str
    fixed: np.ndarray
    values: Any = 0.0
    degree: int = 4

    def __post_init__(self) -> None:
        """Assemble what does not change."""
        body, V = self.elasticity.body, self.elasticity.V
        self.K = self.elasticity.stiffness().tocsr()
        self.free = np.setdiff1d(np.arange(self.K.shape[0]), self.fixed)
        self.axis = body.dim - 1
        self.u, self.v, self.w = fem.Function(V), ufl.TestFunction(V), ufl.TrialFunction(V)
        self.gap = ufl.SpatialCoordinate(body.mesh)[self.axis] + self.u[self.axis]
        metadata = {"quadrature_degree": self.degree}
        ds = ufl.Measure("ds", body.mesh, subdomain_data=body.facet_tags, metadata=metadata)
        self.ds = ds(body.names[self.boundary])

    def begin(self, start: np.ndarray | None = None) -> None:
        """Set the first guess, zero where there is none."""
        self.u.x.array[:] = 0.0 if start is None else start.ravel()
        self.u.x.array[self.fixed] = self.values

    def missing(self) -> np.ndarray:
        """Load less elastic forces, at all unknowns."""
        return self.load.ravel() - self.K @ self.u.x.array

    @cached_property
    def scale(self) -> float:
        """A force to measure by: of the load and the supports."""
        pulled = np.zeros(self.K.shape[0])
        pulled[self.fixed] = self.values
        return float(np.linalg.norm(self.load) + np.linalg.norm((self.K @ pulled)[self.free]))

    def answer(self, began: float, steps: int) -> Answer:
        """Return the displacement and what it took."""
        return Answer(self.u.x.array.reshape(self.load.shape).copy(), perf_counter() - began, steps)


def penalty(pressed: Pressed, stiffness: float, start: np.ndarray) -> Answer:
    """Solve a penalty form by Newton's method.

    Find u with a(u, v) - integral of stiffness <-g(u)>_+ v_n ds = load(v) (Kikuchi and Oden, Contact Problems
    in Elasticity, 1988, chapter 6).

    Parameters
    ----------
    pressed : Pressed
    stiffness : float
        Force per volume (MPa/mm).
    start : (N, dim)
        First guess.

    Raises
    ------
    RuntimeError
        If Newton's method does not converge.
    """
    kappa = fem.Constant(pressed.elasticity.body.mesh, float(stiffness))
    return _newton(pressed, kappa * _positive(-pressed.gap), start, "the penalty form", symmetric=True)


def nitsche(pressed: Pressed, gamma: float, start: np.ndarray) -> Answer:
    """Solve Nitsche's form, in its variant without symmetry, by semismooth Newton steps.

    Find u with a(u, v) - integral of <-sigma_n(u) - gamma g(u)>_+ v_n ds = load(v): the augmented Lagrangian
    with its multiplier eliminated. Consistent, whatever gamma (Chouly, Hild and Renard, Math. Comput. 84 (2015)).

    Parameters
    ----------
    pressed : Pressed
    gamma : float
        Young's modulus over the size of a cell, times a number of the order of 1 to 100.
    start : (N, dim)
        First guess.

    Raises
    ------
    RuntimeError
        If Newton's method does not converge.
    """
    mesh, axis = pressed.elasticity.body.mesh, pressed.axis
    material = pressed.elasticity.materials[0]
    mu = material.E / (2.0 * (1.0 + material.nu))
    lame = 2.0 * mu * material.nu / (1.0 - 2.0 * material.nu)
    strain = ufl.sym(ufl.grad(pressed.u))
    sigma_n = fem.Constant(mesh, 2.0 * mu) * strain[axis, axis] + fem.Constant(mesh, lame) * ufl.tr(strain)
    pressure = _positive(-sigma_n - fem.Constant(mesh, float(gamma)) * pressed.gap)
    return _newton(pressed, pressure, start, "Nitsche's form", symmetric=False)


def latent_variable(
    pressed: Pressed, alpha: float = 0.005, tolerance: float = 1e-6, newton: float = 1e-6
) -> tuple[Answer, int]:
    """Solve by the latent variable proximal point method.

    The gap is exp(psi) on the boundary, psi of the same degree as u, and each round finds u and psi with

        alpha a(u, v) + integral of (psi - psi_before) v_n ds = alpha load(v),    exp(psi) = g(u) weakly,

    so that (psi_before - psi) / alpha is the pressure; alpha doubles from round to round (Keith and Surowiec,
    Found. Comput. Math. 2024; Dokken, Farrell, Keith, Papadopoulos and Surowiec, Comput. Methods Appl. Mech.
    Eng. 2025).

    Parameters
    ----------
    pressed : Pressed
    alpha : float
        Of the first round, times 1/2.
    tolerance : float
        Change of the displacement in a round, Euclidean norm, at which the rounds end.
    newton : float
        What is left of the residual of a round, of its first or absolute; ten times that in the first round.

    Returns
    -------
    Answer
        Its steps are all linear solves.
    rounds : int

    Raises
    ------
    RuntimeError
        If a round does not converge, or the rounds do not.
    """
    began = perf_counter()
    axis, v, w = pressed.axis, pressed.v, pressed.w
    psi = fem.Function(pressed.elasticity.V)
    nodes = pressed.elasticity.body.nodes(pressed.boundary)
    latent = nodes * (axis + 1) + axis
    coupling = fem.form(w[axis] * v[axis] * pressed.ds)
    opening = fem.form((ufl.exp(psi[axis]) - pressed.gap) * v[axis] * pressed.ds)
    softness = fem.form(ufl.exp(psi[axis]) * w[axis] * v[axis] * pressed.ds)
    B = _assembled(coupling)[latent]
    K, B_free = pressed.K[pressed.free][:, pressed.free], B[:, pressed.free]
    pressed.begin()
    u, solves = pressed.u.x.array, 0
    before, psi_before = u.copy(), np.zeros(len(latent))
    for number in range(1, ROUNDS + 1):
        step, first = alpha * 2.0**number, None
        enough = newton * (10.0 if number < 2 else 1.0)
        for _ in range(STEPS):
            drive = psi.x.array[latent] - psi_before
            equilibrium = (step * pressed.missing() - B.T @ drive)[pressed.free]
            r = np.concatenate([equilibrium, fem.assemble_vector(opening).array[latent]])
            size = float(np.linalg.norm(r))
            if not np.isfinite(size):
                raise RuntimeError(f"In round {number} of the proximal point method exp(psi) overflowed.")
            first = size if first is None else first
            if solves and size <= enough * max(1.0, first):
                break
            D = _assembled(softness)[latent][:, latent]
            J = sparse.block_array([[step * K, B_free.T], [B_free, -D]], format="csr")
            x = _solved(J, r, symmetric=True)
            u[pressed.free] += x[: pressed.free.size]
            psi.x.array[latent] += x[pressed.free.size :]
            solves += 1
        else:
            raise RuntimeError(
                f"Round {number} of the proximal point method did not converge in {STEPS} steps."
            )
        if np.linalg.norm(u - before) <= tolerance:
            return pressed.answer(began, solves), number
        before[:], psi_before[:] = u, psi.x.array[latent]
    raise RuntimeError(f"The proximal point method did not converge in {ROUNDS} rounds.")


def _positive(q: Any) -> Any:
    return ufl.conditional(ufl.gt(q, 0.0), q, 0.0)


def _newton(pressed: Pressed, pressure: Any, start: np.ndarray, name: str, symmetric: bool) -> Answer:
    """Solve a(u, v) - integral of pressure(u) v_n ds = load(v) by Newton's method."""
    began = perf_counter()
    force = pressure * pressed.v[pressed.axis] * pressed.ds
    residual, tangent = fem.form(force), fem.form(ufl.derivative(force, pressed.u, pressed.w))
    pressed.begin(start)
    free, u = pressed.free, pressed.u.x.array
    for step in range(STEPS + 1):
        r = (pressed.missing() + fem.assemble_vector(residual).array)[free]
        if np.linalg.norm(r) < 1e-9 * pressed.scale:
            return pressed.answer(began, step)
        J = (pressed.K - _assembled(tangent))[free][:, free]
        u[free] += _solved(J, r, symmetric)
    raise RuntimeError(f"Newton's method on {name} did not converge in {STEPS} steps.")


def _assembled(form: Any) -> sparse.csr_array:
    A = fem.assemble_matrix(form)
    A.scatter_reverse()
    return sparse.csr_array(A.to_scipy())


def _solved(A: sparse.csr_array, r: np.ndarray, symmetric: bool) -> np.ndarray:
    """Solve A x = r by MUMPS."""
    A = sparse.csr_array(A)
    A.sort_indices()
    arrays = A.indptr.astype(PETSc.IntType), A.indices.astype(PETSc.IntType), A.data
    matrix = PETSc.Mat().createAIJ(A.shape, csr=arrays, comm=PETSc.COMM_SELF)
    if symmetric:
        matrix.setOption(PETSc.Mat.Option.SYMMETRIC, True)
    solver = PETSc.KSP().create(PETSc.COMM_SELF)
    solver.setOperators(matrix)
    solver.setType("preonly")
    solver.getPC().setType("cholesky" if symmetric else "lu")
    solver.getPC().setFactorSolverType("mumps")
    solver.getPC().setFactorSetUpSolverType()
    factor = solver.getPC().getFactorMatrix()
    factor.setMumpsIcntl(7, ORDERINGS["METIS"])
    x, b = matrix.createVecs()
    b.array[:] = r
    solver.solve(b, x)
    found = x.array.copy()
    for thing in (solver, matrix, x, b):
        thing.destroy()
    return found
