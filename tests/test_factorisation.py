"""Factorisation: PETSc's MUMPS where it is loaded, SuperLU elsewhere; both solve."""

import sys

import numpy as np
import pytest
from scipy.sparse import csc_array

from geometry import compat  # noqa: F401  (dolfinx and, with it, PETSc)
from model.solvers.factorisation import MumpsCholesky, factorised


def laplacian(n):
    rng = np.random.default_rng(4)
    M = np.diag(np.full(n, 2.0)) - np.diag(np.ones(n - 1), 1) - np.diag(np.ones(n - 1), -1)
    scale = rng.uniform(1, 1e3, n)
    return scale[:, None] * M * scale


@pytest.mark.parametrize("petsc", [True, False])
def test_one_and_many_right_hand_sides(petsc, monkeypatch):
    if not petsc:
        monkeypatch.delitem(sys.modules, "petsc4py.PETSc")
    A = laplacian(60)
    factor = factorised(csc_array(A))
    assert isinstance(factor, MumpsCholesky) == petsc
    exact = np.random.default_rng(5).normal(size=(60, 5))
    many = factor.solve(A @ exact)
    assert np.allclose(many, exact, atol=1e-9)
    assert np.allclose(factor.solve(A @ exact[:, 1]), exact[:, 1], atol=1e-9)


def test_an_indefinite_matrix_is_left_to_superlu():
    A = laplacian(10)
    A[3, 3] -= 1e6
    factor = factorised(csc_array(A))
    assert not isinstance(factor, MumpsCholesky)
    assert np.allclose(factor.solve(A @ np.ones(10)), 1.0)


def test_a_singular_matrix_is_refused():
    with pytest.raises(RuntimeError):
        factorised(csc_array(np.diag([1.0, 0.0, 2.0])))
