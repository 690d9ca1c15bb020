"""Strain energy densities psi(C) for finite rotation and finite strain, in UFL; C = F^T F is 3 x 3 always.

The part of psi that grows without bound as rubber becomes incompressible is kept apart (`volumetric`), so
that a mean dilatation can be given to a cell.

Source: Bonet and Wood, Nonlinear Continuum Mechanics for Finite Element Analysis, 2nd ed., Cambridge 2008.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from checks import finite, not_negative, positive, refused, vector
from forms.material import moduli
from geometry import compat  # noqa: F401  # compat comes before dolfinx

import ufl  # isort: skip
from ufl.algorithms.apply_algebra_lowering import apply_algebra_lowering  # isort: skip

ROTATIONS = 5  # that an energy is tried on
INDIFFERENT = 1e-9  # of the energy: what rounding may make of a rotation
# Of strain, for second differences of psi at rest: good to its square, and to rounding over that, 2e-8.
DIFFERENCE = 1e-4
RESOLVED = 1e-6  # of the hardest modulus: fifty times that


class StrainEnergy:
    """An energy density psi(C) with named parameters; `NeoHookean` and its like, or your own.

    Parameters
    ----------
    **parameters : float
        Force per area, or plain numbers.

    Examples
    --------
    >>> import ufl
    >>> from forms import Hyperelasticity, StrainEnergy
    >>> from geometry import Body, rectangle
    >>> class Gent(StrainEnergy):  # rubber that locks
    ...     def density(self, C, p):
    ...         I1, ln_J = ufl.tr(C), ufl.ln(ufl.det(C)) / 2
    ...         shape = -p["mu"] * p["limit"] / 2 * ufl.ln(1 - (I1 - 3) / p["limit"]) - p["mu"] * ln_J
    ...         return shape + p["lame"] / 2 * ln_J**2
    >>> rubber = Hyperelasticity(
    ...     Body.from_grid(rectangle(1.0, 1.0, 2, 2)), Gent(mu=1.0, limit=10.0, lame=2.0)
    ... )
    >>> round(rubber.strain_energy(0.1 * rubber.body.coordinates), 6)  # 0.214537 - 0.190620 + 0.036336
    0.060253
    """

    bears_compression = True  # psi grows without bound as a cell is pressed flat

    def __init__(self, **parameters: float):
        finite(**parameters)
        self.parameters = {name: float(value) for name, value in parameters.items()}

    def density(self, C: Any, p: Mapping[str, Any]) -> Any:
        """Return in UFL what every point of a cell has of its own, from C (3, 3) and the parameters."""
        raise NotImplementedError

    def volumetric(self, C: Any, p: Mapping[str, Any]) -> Any:
        """Return in UFL what hinders a change of volume only; 0 where psi is not split."""
        return 0.0

    def __call__(self, C: Any) -> Any:
        """Return psi(C) in UFL."""
        return self.density(C, self.parameters) + self.volumetric(C, self.parameters)


ZERO = StrainEnergy.volumetric


class NeoHookean(StrainEnergy):
    """Compressible neo-Hookean rubber: mu/2 (I1 - 3) - mu ln J + lambda/2 ln^2 J.

    Parameters
    ----------
    E, nu : float
        Young's modulus > 0 (force per area) and Poisson's ratio, -1 < nu < 0.5, at small strain.

    Raises
    ------
    ValueError
        For other moduli.

    Examples
    --------
    >>> from forms import Hyperelasticity, NeoHookean
    >>> from geometry import Body, rectangle
    >>> material = NeoHookean(E=1.0, nu=0.3)
    >>> rubber = Hyperelasticity(Body.from_grid(rectangle(1.0, 1.0, 2, 2)), material)
    >>> stretched = 0.1 * rubber.body.coordinates  # by ten per cent in both directions of the plane
    >>> round(rubber.strain_energy(stretched), 6)
    0.017935
    """

    def __init__(self, E: float, nu: float):
        mu, lame = lame_constants(E, nu)
        super().__init__(mu=mu, lame=lame)

    def density(self, C: Any, p: Mapping[str, Any]) -> Any:
        """Return mu/2 (I1 - 3) - mu ln J."""
        return p["mu"] * (0.5 * (ufl.tr(C) - 3) - ln_J(C))

    def volumetric(self, C: Any, p: Mapping[str, Any]) -> Any:
        """Return lambda/2 ln^2 J."""
        return 0.5 * p["lame"] * ln_J(C) ** 2


class MooneyRivlin(StrainEnergy):
    """Mooney and Rivlin's rubber: c1 (I1 - 3) + c2 (I2 - 3) - (2 c1 + 4 c2) ln J + lambda/2 ln^2 J.

    Parameters
    ----------
    c1, c2 : float
        Force per area; the shear modulus at small strain, 2 (c1 + c2), must be positive, and neither of the
        two negative.
    lame : float
        Lame's lambda > 0 of the same density written as above: at small strain it is lame + 4 c2.

    Raises
    ------
    ValueError
        For other moduli.

    Examples
    --------
    >>> from forms import Hyperelasticity, MooneyRivlin
    >>> from geometry import Body, rectangle
    >>> material = MooneyRivlin(c1=0.2, c2=0.05, lame=2.0)
    >>> rubber = Hyperelasticity(Body.from_grid(rectangle(1.0, 1.0, 2, 2)), material)
    >>> stretched = 0.1 * rubber.body.coordinates  # by ten per cent in both directions of the plane
    >>> round(rubber.strain_energy(stretched), 6)
    0.050169
    """

    def __init__(self, c1: float, c2: float, lame: float):
        not_negative(c1=c1, c2=c2)
        positive(**{"c1 + c2": c1 + c2}, lame=lame)
        super().__init__(c1=c1, c2=c2, lame=lame)

    def density(self, C: Any, p: Mapping[str, Any]) -> Any:
        """Return all but the part in lambda."""
        first = ufl.tr(C)
        second = 0.5 * (first**2 - ufl.tr(C * C))
        return p["c1"] * (first - 3) + p["c2"] * (second - 3) - (2 * p["c1"] + 4 * p["c2"]) * ln_J(C)

    def volumetric(self, C: Any, p: Mapping[str, Any]) -> Any:
        """Return lambda/2 ln^2 J."""
        return 0.5 * p["lame"] * ln_J(C) ** 2


class StVenantKirchhoff(StrainEnergy):
    """St. Venant and Kirchhoff's material: lambda/2 (tr E)^2 + mu E : E, E = (C - I)/2.

    Hooke's law that does not mind rotation, for small strain; in compression it softens, and lets cells be
    turned inside out.

    Parameters
    ----------
    E, nu : float
        Young's modulus > 0 (force per area) and Poisson's ratio, -1 < nu < 0.5.

    Raises
    ------
    ValueError
        For other moduli.

    Examples
    --------
    >>> from forms import Hyperelasticity, StVenantKirchhoff
    >>> from geometry import Body, rectangle
    >>> material = StVenantKirchhoff(E=1.0, nu=0.0)
    >>> rubber = Hyperelasticity(Body.from_grid(rectangle(1.0, 1.0, 2, 2)), material)
    >>> stretched = 0.1 * rubber.body.coordinates  # by ten per cent in both directions of the plane
    >>> round(rubber.strain_energy(stretched), 6)
    0.011025
    """

    bears_compression = False

    def __init__(self, E: float, nu: float):
        mu, lame = lame_constants(E, nu)
        super().__init__(mu=mu, lame=lame)

    def density(self, C: Any, p: Mapping[str, Any]) -> Any:
        """Return mu E : E."""
        E = 0.5 * (C - ufl.Identity(3))
        return p["mu"] * ufl.inner(E, E)

    def volumetric(self, C: Any, p: Mapping[str, Any]) -> Any:
        """Return lambda/2 (tr E)^2."""
        return 0.125 * p["lame"] * (ufl.tr(C) - 3) ** 2


class Cords(StrainEnergy):
    """Cords in a matrix: the matrix's energy + stiffness/8 (a . C a - 1)^2, a unit vectors along the cords.

    A layer of a carcass is orthotropic with one family of cords, or with two of angles +-theta.

    Parameters
    ----------
    matrix : StrainEnergy
        What the cords lie in.
    stiffness : float
        Of a family of cords, >= 0: modulus times volume fraction, force per area.
    directions : sequence of (d,)
        Along the cords of each family, at rest.

    Raises
    ------
    ValueError
        For a negative stiffness, or a direction of no length.

    Examples
    --------
    >>> from forms import Cords, Hyperelasticity, NeoHookean
    >>> from geometry import Body, rectangle
    >>> material = Cords(NeoHookean(E=1.0, nu=0.3), 10.0, [(1.0, 0.0)])
    >>> rubber = Hyperelasticity(Body.from_grid(rectangle(1.0, 1.0, 2, 2)), material)
    >>> stretched = 0.1 * rubber.body.coordinates  # by ten per cent in both directions of the plane
    >>> round(rubber.strain_energy(stretched), 6)
    0.07306
    """

    def __init__(self, matrix: StrainEnergy, stiffness: float, directions: Sequence[Sequence[float]]):
        not_negative(stiffness=stiffness)
        matrix = strain_energy(matrix)
        super().__init__(**matrix.parameters, cord=stiffness)
        self.matrix, self.bears_compression = matrix, matrix.bears_compression
        self.directions = []
        if isinstance(directions, str) or not isinstance(directions, Iterable):
            raise refused("directions", "a list of vectors along the cords", directions)
        for direction in directions:
            along = vector("each of directions", direction, 2, 3)
            a = np.pad(along, (0, 3 - along.size))
            if not np.linalg.norm(a) > 0.0:
                raise ValueError(f"The cords run along {direction}, which is no direction.")
            self.directions.append(ufl.as_vector((a / np.linalg.norm(a)).tolist()))

    def density(self, C: Any, p: Mapping[str, Any]) -> Any:
        """Return the matrix's part, and that of the cords."""
        strains = [ufl.dot(a, C * a) - 1 for a in self.directions]
        return self.matrix.density(C, p) + 0.125 * p["cord"] * sum(strain**2 for strain in strains)

    def volumetric(self, C: Any, p: Mapping[str, Any]) -> Any:
        """Return the matrix's."""
        return self.matrix.volumetric(C, p)


class OwnEnergy(StrainEnergy):
    """The user's own density, checked: a function of C, or of F if its argument is called F.

    A function of F that does not mind rotations is one of C: psi(F) = psi(R), R upper triangular, R^T R = C.

    Parameters
    ----------
    psi : callable
        Of a 3 x 3 UFL matrix, returns UFL.

    Raises
    ------
    ValueError
        If psi is no function of a 3 x 3 matrix, minds rotations, or rest is not its stable minimum.
    """

    def __init__(self, psi: Callable[[Any], Any]):
        super().__init__()
        names = list(inspect.signature(psi).parameters)
        self.psi = psi
        try:
            shape = ufl.as_ufl(psi(ufl.Identity(3))).ufl_shape
        except Exception as error:
            raise ValueError(
                f"The energy density fails at rest ({error}); it takes one 3 x 3 matrix, in the plane too, "
                "and returns UFL."
            ) from error
        if shape:
            raise ValueError(f"The energy density has values of shape {shape}; it must return one number.")
        if names[:1] == ["F"]:
            check_indifference(psi)
            self.psi = lambda C: psi(cholesky(C))
        check_rest(self.psi)

    def density(self, C: Any, p: Mapping[str, Any]) -> Any:
        """Return psi(C)."""
        return self.psi(C)


def strain_energy(psi: Any) -> StrainEnergy:
    """Return psi itself if it is a StrainEnergy, or the user's own function made one.

    Raises
    ------
    ValueError
        As `OwnEnergy`, for classes of the user's own too.
    """
    if isinstance(psi, StrainEnergy):
        if type(psi).__module__ != __name__:  # whose moduli nobody has looked at
            check_rest(psi)
        return psi
    if callable(psi):
        return OwnEnergy(psi)
    raise ValueError(
        "An energy density is wanted, as NeoHookean(E, nu) or a function of C in UFL, "
        f"not {type(psi).__name__}."
    )


def lame_constants(E: float, nu: float) -> tuple[float, float]:
    """Return the shear modulus and Lame's lambda, or refuse the moduli."""
    moduli(E, nu)
    return E / (2 * (1 + nu)), E * nu / ((1 + nu) * (1 - 2 * nu))


def ln_J(C: Any) -> Any:  # noqa: N802
    """Return the logarithm of the change of volume."""
    return 0.5 * ufl.ln(ufl.det(C))


def cholesky(C: Any) -> Any:
    """Return R, upper triangular with R^T R = C, in UFL."""
    a = ufl.sqrt(C[0, 0])
    b, c = C[0, 1] / a, C[0, 2] / a
    d = ufl.sqrt(C[1, 1] - b**2)
    e = (C[1, 2] - b * c) / d
    return ufl.as_matrix([[a, b, c], [0, d, e], [0, 0, ufl.sqrt(C[2, 2] - c**2 - e**2)]])


def number(psi: Callable[[Any], Any], matrix: np.ndarray) -> float:
    """Evaluate psi at a matrix of numbers (3, 3)."""
    expression = psi(ufl.as_matrix(matrix.tolist()))
    return float(apply_algebra_lowering(ufl.as_ufl(expression))(()))


def check_indifference(psi: Callable[[Any], Any]) -> None:
    """Refuse an energy of F (3, 3) that changes when the body turns as a whole."""
    random = np.random.default_rng(3)
    for _ in range(ROTATIONS):
        F = np.eye(3) + 0.2 * random.uniform(-1, 1, (3, 3))
        turn = np.linalg.qr(random.normal(size=(3, 3)))[0]
        turn *= np.sign(np.linalg.det(turn))
        before, after = number(psi, F), number(psi, turn @ F)
        if not abs(after - before) <= INDIFFERENT * max(abs(before), abs(after)):
            raise ValueError(
                f"The energy density goes from {before:g} to {after:g} when the body only turns, so it is no "
                "energy of deformation; write it in C = F^T F."
            )


def check_rest(psi: Callable[[Any], Any]) -> None:
    """Refuse an energy of C (3, 3) of which the body at rest is not a minimum, as with negative moduli."""
    h, rest = DIFFERENCE, number(psi, np.eye(3))
    pairs = [(0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1)]
    strains = []
    for i, j in pairs:
        E = np.zeros((3, 3))
        E[i, j] += 1.0
        E[j, i] += 1.0
        strains.append(E)
    slopes, moduli = np.empty(6), np.empty((6, 6))
    for k, A in enumerate(strains):
        slopes[k] = (number(psi, np.eye(3) + h * A) - number(psi, np.eye(3) - h * A)) / (2 * h)
        for m, B in enumerate(strains):
            corners = [(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)]
            moduli[k, m] = sum(s * number(psi, np.eye(3) + h * (a * A + b * B)) for a, b, s in corners)
    moduli /= 4 * h**2
    if not np.isfinite([rest, *slopes, *moduli.ravel()]).all():
        raise ValueError("The energy density is not a finite number at rest, where C is the identity.")
    softest, hardest = np.linalg.eigvalsh(moduli)[[0, -1]]
    if not softest > RESOLVED * abs(hardest):
        raise ValueError(
            f"The energy density has a modulus of {softest / 4:g} at rest, so the body would give way by "
            "itself; every modulus must be positive."
        )
    if np.abs(slopes).max() > RESOLVED * hardest:
        raise ValueError(
            f"The energy density leaves a stress of {np.abs(slopes).max():g} at rest, where C is the "
            "identity; rest must be its minimum."
        )
