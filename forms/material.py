"""Elastic materials: Hooke's law as a matrix, in Voigt's order xx, yy, zz, yz, xz, xy."""

from __future__ import annotations

import numpy as np

from checks import number, numbers, one_of, positive, said

KINEMATICS = ("plane strain", "plane stress", "3d", "axisymmetric")
SYMMETRIC = 1e-10  # of the largest entry: what tables of ten digits leave
IN_PLANE = [0, 1, 5]
AROUND = [0, 1, 2, 5]  # of axisymmetric strain: rr, zz, around the axis, rz
OUT_OF_PLANE = [2, 3, 4]


class Isotropic:
    """Hooke's law of a material alike in all directions.

    Parameters
    ----------
    E : Young's modulus (force per area), positive
    nu : Poisson's ratio, between -1 and 0.5, both excluded

    Raises
    ------
    ValueError
        for values outside these bounds.

    Examples
    --------
    >>> Isotropic(E=1.0, nu=0.0).matrix("plane strain")
    array([[1. , 0. , 0. ],
           [0. , 1. , 0. ],
           [0. , 0. , 0.5]])
    """

    def __init__(self, E: float, nu: float):
        moduli(E, nu)
        self.E, self.nu = float(E), float(nu)

    def matrix(self, kinematics: str) -> np.ndarray:
        """Return the elasticity matrix, (3, 3) in the plane, (4, 4) if axisymmetric, (6, 6) for "3d".

        Other kinematics, and those that a (3, 3) material does not serve, raise ValueError.
        """
        check_kinematics(kinematics)
        E, nu = self.E, self.nu
        shear = E / (2 * (1 + nu))
        if kinematics == "plane stress":
            direct = E / (1 - nu**2) * np.array([[1, nu], [nu, 1]])
        else:
            size = 2 if kinematics == "plane strain" else 3
            direct = 2 * shear * (np.eye(size) + nu / (1 - 2 * nu))
        size = len(direct)
        C = np.zeros({"3d": (6, 6), "axisymmetric": (4, 4)}.get(kinematics, (3, 3)))
        C[:size, :size] = direct
        C[range(size, len(C)), range(size, len(C))] = shear
        return C

    def out_of_plane(self, kinematics: str) -> np.ndarray:
        """Return the row (3,) that gives sigma_zz from the in-plane strain."""
        row = np.zeros(3)
        if kinematics == "plane strain":
            row[:2] = self.E * self.nu / ((1 + self.nu) * (1 - 2 * self.nu))
        return row


def moduli(E: float, nu: float) -> None:
    """Refuse moduli of no elastic material: E > 0 and -1 < nu < 0.5 are needed (ValueError)."""
    positive(E=E)
    if not -1 < number(nu) < 0.5:
        hint = " (rubber: nu = 0.499, with mean_dilatation=True)" if number(nu) == 0.5 else ""
        raise ValueError(
            f"Poisson's ratio nu is {said(nu)}; it must lie between -1 and 0.5, both excluded{hint}."
        )


class Anisotropic:
    """Any symmetric positive definite elasticity matrix.

    Parameters
    ----------
    matrix : (6, 6), order xx, yy, zz, yz, xz, xy; plane problems take from it what their kinematics leaves:
        strain zz, yz, xz zero (plane strain), or stress zz, yz, xz zero (plane stress). Or (3, 3), order xx,
        yy, xy, for plane problems only, taken as it is; stress zz is then unknown and counted as zero.

    Examples
    --------
    >>> import numpy as np
    >>> from forms import Anisotropic, Elasticity
    >>> from geometry import Body, rectangle
    >>> plywood = Anisotropic(np.array([[10.0, 1.0, 0.0], [1.0, 2.0, 0.0], [0.0, 0.0, 0.5]]))
    >>> Elasticity(Body.from_grid(rectangle(1.0, 1.0, 2, 2)), plywood).stiffness().shape
    (18, 18)
    """

    def __init__(self, matrix: np.ndarray):
        C = numbers("matrix", matrix)
        if C.shape not in ((3, 3), (6, 6)):
            raise ValueError(
                f"The elasticity matrix has the shape {C.shape}; it must be (6, 6), or (3, 3) in the plane."
            )
        if not np.isfinite(C).all():
            raise ValueError("The elasticity matrix has entries that are not finite numbers.")
        if not np.allclose(C, C.T, rtol=0, atol=SYMMETRIC * np.abs(C).max()):
            raise ValueError(
                f"The elasticity matrix differs from its transpose by {abs(C - C.T).max()}; they must agree."
            )
        self.C = (C + C.T) / 2
        smallest = np.linalg.eigvalsh(self.C)[0]
        if smallest <= 0:
            raise ValueError(f"The elasticity matrix has the eigenvalue {smallest}; all must be positive.")

    def matrix(self, kinematics: str) -> np.ndarray:
        """Return the elasticity matrix, (3, 3) in the plane, (4, 4) if axisymmetric, (6, 6) for "3d".

        Other kinematics, and those that a (3, 3) material does not serve, raise ValueError.
        """
        check_kinematics(kinematics)
        if len(self.C) == 3:
            if kinematics in ("3d", "axisymmetric"):
                raise ValueError("A 3 x 3 elasticity matrix serves plane problems only; give 6 x 6 for 3-D.")
            return self.C
        if kinematics == "3d":
            return self.C
        if kinematics == "axisymmetric":
            return self.C[np.ix_(AROUND, AROUND)]
        plane = self.C[np.ix_(IN_PLANE, IN_PLANE)]
        if kinematics == "plane strain":
            return plane
        across = self.C[np.ix_(IN_PLANE, OUT_OF_PLANE)]
        return plane - across @ np.linalg.solve(self.C[np.ix_(OUT_OF_PLANE, OUT_OF_PLANE)], across.T)

    def out_of_plane(self, kinematics: str) -> np.ndarray:
        """Return the row (3,) that gives sigma_zz from the in-plane strain."""
        known = kinematics == "plane strain" and len(self.C) == 6
        return self.C[2, IN_PLANE] if known else np.zeros(3)


def check_kinematics(kinematics: str) -> None:
    """Raise a ValueError unless the kinematics is known."""
    one_of(KINEMATICS, kinematics=kinematics)
