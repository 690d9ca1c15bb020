"""Hooke's law as a matrix."""

import numpy as np
import pytest

from forms import Anisotropic, Isotropic


@pytest.mark.parametrize("kinematics", ["plane strain", "plane stress", "3d"])
@pytest.mark.parametrize("nu", [-0.9, 0.0, 0.3, 0.4999])
def test_anisotropic_with_isotropic_entries_is_isotropic(kinematics, nu):
    isotropic = Isotropic(210e3, nu)
    general = Anisotropic(isotropic.matrix("3d"))
    np.testing.assert_allclose(general.matrix(kinematics), isotropic.matrix(kinematics), rtol=1e-9, atol=1e-6)
    if kinematics != "3d":
        np.testing.assert_allclose(general.out_of_plane(kinematics), isotropic.out_of_plane(kinematics))


def test_uniaxial_stress_gives_youngs_modulus_and_poissons_ratio():
    E, nu = 3.0, 0.2
    strain = np.linalg.solve(Isotropic(E, nu).matrix("3d"), [1, 0, 0, 0, 0, 0])
    np.testing.assert_allclose(strain, [1 / E, -nu / E, -nu / E, 0, 0, 0], atol=1e-16)
    strain = np.linalg.solve(Isotropic(E, nu).matrix("plane stress"), [1, 0, 0])
    np.testing.assert_allclose(strain, [1 / E, -nu / E, 0], atol=1e-16)
    strain = np.linalg.solve(Isotropic(E, nu).matrix("plane strain"), [1, 0, 0])
    np.testing.assert_allclose(strain, [(1 - nu**2) / E, -nu * (1 + nu) / E, 0], atol=1e-16)


def test_plane_anisotropic_matrix_is_taken_as_it_is():
    C = np.array([[4.0, 1.0, 0.5], [1.0, 3.0, 0.0], [0.5, 0.0, 1.0]])
    np.testing.assert_array_equal(Anisotropic(C).matrix("plane stress"), C)
    with pytest.raises(ValueError, match="6 x 6"):
        Anisotropic(C).matrix("3d")


@pytest.mark.parametrize(
    "make, words",
    [
        (lambda: Isotropic(0.0, 0.3), "E is 0.0"),
        (lambda: Isotropic(-1.0, 0.3), "E is -1.0"),
        (lambda: Isotropic(np.nan, 0.3), "E is nan"),
        (lambda: Isotropic(np.inf, 0.3), "E is inf"),
        (lambda: Isotropic(1.0, 0.5), "nu is 0.5"),
        (lambda: Isotropic(1.0, -1.0), "nu is -1.0"),
        (lambda: Isotropic(1.0, np.nan), "nu is nan"),
        (lambda: Anisotropic(np.eye(4)), r"\(4, 4\)"),
        (lambda: Anisotropic(np.diag([1, 1, 0.0])), "eigenvalue 0.0"),
        (lambda: Anisotropic(np.triu(np.ones((3, 3)))), "differs from its transpose"),
        (lambda: Anisotropic(np.full((3, 3), np.nan)), "not finite"),
        (lambda: Isotropic(1.0, 0.3).matrix("plane"), "'plane strain', 'plane stress', '3d'"),
    ],
)
def test_impossible_materials_are_refused(make, words):
    with pytest.raises(ValueError, match=words):
        make()
