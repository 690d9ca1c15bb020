"""Weak forms of contact, as users of FEniCSx write them: penalty, Nitsche, latent variable.

All on the road of height 0, its normal the last axis. Contact holds in a weak sense, so each leaves some
penetration, and the penalty form some slip where nodes stick. Newton's steps are solved by MUMPS, as symmetric
systems where they are.
"""

from collections.abc import Sequence
from dataclasses import dataclass
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
HALVINGS = 8  # of a step that does not lower the residual
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
    friction : float
        Coefficient.
    """

    elasticity: Any
    load: np.ndarray
    boundary: str
    fixed: np.ndarray
    values: Any = 0.0
    degree: int = 4
    friction: float = 0.0

    def __post_init__(self) -> None:
        """Assemble what does not change."""
        body, V = self.elasticity.body, self.elasticity.V
        self.K = self.elasticity.stiffness().tocsr()
        self.free = np.setdiff1d(np.arange(self.K.shape[0]), self.fixed)
        self.axis = body.dim - 1
        self.u, self.v, self.w = fem.Function(V), ufl.TestFunction(V), ufl.TrialFunction(V)
        self.gap = ufl.SpatialCoordinate(body.mesh)[self.axis] + self.u[self.axis]
        self.before = fem.Function(V)  # where the boundary was at the end of the last load step
        self.slip = [(self.u - self.before)[a] for a in range(self.axis)]
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

    @property
    def scale(self) -> float:
        """A force to measure by: of the load and the supports."""
        pulled = np.zeros(self.K.shape[0])
        pulled[self.fixed] = self.values
        return float(np.linalg.norm(self.load) + np.linalg.norm((self.K @ pulled)[self.free]))

    def answer(self, began: float, steps: int) -> Answer:
        """Return the displacement and what it took."""
        return Answer(self.u.x.array.reshape(self.load.shape).copy(), perf_counter() - began, steps)


def penalty(
    pressed: Pressed, stiffness: float, start: np.ndarray, path: Sequence[np.ndarray] | None = None
) -> Answer:
    """Solve a penalty form by Newton's method.

    Find u with a(u, v) - integral of (p v_n + tau . v_t) ds = load(v), p = stiffness <-g(u)>_+ and tau the
    projection of -stiffness slip(u) onto |tau| <= mu p (Kikuchi and Oden, Contact Problems in Elasticity,
    1988, chapters 6 and 10).

    Parameters
    ----------
    pressed : Pressed
    stiffness : float
        Force per volume (MPa/mm).
    start : (N, dim)
        First guess.
    path : sequence of (k,), optional
        Prescribed values, load step by load step; default those of `pressed`, one step.

    Raises
    ------
    RuntimeError
        If Newton's method does not converge.
    """
    kappa = fem.Constant(pressed.elasticity.body.mesh, float(stiffness))
    pressure = kappa * _positive(-pressed.gap)
    traction = _traction(pressed, pressure, [-kappa * s for s in pressed.slip])
    return _newton(pressed, traction, start, "the penalty form", not pressed.friction, path)


def nitsche(
    pressed: Pressed, gamma: float, start: np.ndarray, path: Sequence[np.ndarray] | None = None
) -> Answer:
    """Solve Nitsche's form, in its variant without symmetry, by semismooth Newton steps.

    Find u with a(u, v) - integral of (p v_n + tau . v_t) ds = load(v), p = <-sigma_n(u) - gamma g(u)>_+ and tau
    the projection of -sigma_t(u) - gamma slip(u) onto |tau| <= mu p: the augmented Lagrangian with its
    multipliers eliminated. Consistent, whatever gamma (Chouly, Hild and Renard, Math. Comput. 84 (2015); with
    friction Chouly, Hild, Lleras and Renard, SMAI J. Comput. Math. 8 (2022)).

    Parameters
    ----------
    pressed : Pressed
    gamma : float
        Young's modulus over the size of a cell, times a number of the order of 1 to 100.
    start : (N, dim)
        First guess.
    path : sequence of (k,), optional
        Prescribed values, load step by load step; default those of `pressed`, one step.

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
    twice_mu, gamma = fem.Constant(mesh, 2.0 * mu), fem.Constant(mesh, float(gamma))
    sigma_n = twice_mu * strain[axis, axis] + fem.Constant(mesh, lame) * ufl.tr(strain)
    pressure = _positive(-sigma_n - gamma * pressed.gap)
    rub = [-twice_mu * strain[a, axis] - gamma * s for a, s in enumerate(pressed.slip)]
    return _newton(pressed, _traction(pressed, pressure, rub), start, "Nitsche's form", False, path)


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


def _traction(pressed: Pressed, pressure: Any, rub: list[Any]) -> Any:
    """Pressure along the normal, and across it `rub`, cut to the friction disc |tau| <= mu p."""
    if not pressed.friction:
        return ufl.as_vector([0.0] * len(rub) + [pressure])
    most = fem.Constant(pressed.elasticity.body.mesh, pressed.friction) * pressure
    square = sum(q * q for q in rub)
    held = [ufl.conditional(ufl.gt(square, most * most), most * q / ufl.sqrt(square), q) for q in rub]
    return ufl.as_vector([*held, pressure])


def _newton(
    pressed: Pressed,
    traction: Any,
    start: np.ndarray,
    name: str,
    symmetric: bool,
    path: Sequence[np.ndarray] | None,
) -> Answer:
    """Solve a(u, v) - integral of traction(u) . v ds = load(v), for one step of a path after the other."""
    began = perf_counter()
    force = ufl.inner(traction, pressed.v) * pressed.ds
    residual, tangent = fem.form(force), fem.form(ufl.derivative(force, pressed.u, pressed.w))
    free, u, solves = pressed.free, pressed.u.x.array, 0
    pressed.before.x.array[:] = 0.0
    for number, values in enumerate([pressed.values] if path is None else path, 1):
        pressed.values = values
        pressed.begin(start if number == 1 else u.copy())
        small = 1e-9 * pressed.scale

        def missing() -> np.ndarray:
            return (pressed.missing() + fem.assemble_vector(residual).array)[free]

        r = missing()
        for step in range(STEPS + 1):
            size = np.linalg.norm(r)
            if size < small:
                break
            if step == STEPS or not np.isfinite(size):
                raise RuntimeError(f"Newton's method on {name} did not converge in load step {number}.")
            J = (pressed.K - _assembled(tangent))[free][:, free]
            x, base, part = _solved(J, r, symmetric), u[free], 1.0
            for _ in range(HALVINGS):  # as PETSc's line search does
                u[free] = base + part * x
                r = missing()
                if np.linalg.norm(r) < (1.0 - 1e-4 * part) * size:
                    break
                part *= 0.5
            solves += 1
        pressed.before.x.array[:] = u
    return pressed.answer(began, solves)


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
