"""Weak forms of linear elasticity, assembled into node-blocked arrays; only what is asked for."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sparse
from numpy.typing import ArrayLike

import checks
from geometry import Body, compat

import ufl  # isort: skip
from dolfinx import fem  # isort: skip

from forms import assembly
from forms.facets import boundary_measure
from forms.material import Anisotropic, Isotropic, check_kinematics
from forms.support import Support
from forms.system import System, shape_gradients

Material = Isotropic | Anisotropic

# Quadrature: exact for cells with straight and parallel sides (stiffness), and for any straight-sided cells
# (mass).
STIFFNESS_DEGREE = {"triangle": 0, "tetrahedron": 0, "quadrilateral": 2, "hexahedron": 2}
MASS_DEGREE = {"triangle": 2, "tetrahedron": 2, "quadrilateral": 3, "hexahedron": 4}
VOLUME_DEGREE = 2  # exact for a body force, linear in the plane, on straight-sided cells
AROUND_DEGREE = 2  # more in axisymmetry, for the distance from the axis
ROUNDING = 1e-12  # of the body's size: a node so near to the axis is on it


class Elasticity:
    """Linear elasticity of a body.

    Parameters
    ----------
    body : Body
    material : one for the whole body, or {name of a region: material} for all of it
    kinematics : "plane strain" (the default in the plane; per unit thickness), "plane stress", "3d", or
        "axisymmetric": x is the distance from the axis, y along it, forces are those of the whole body of
        revolution; fix x = 0 on the axis
    mean_dilatation : give each cell one dilatation, its mean, which keeps quadrilaterals and hexahedra from
        locking when the material is nearly incompressible (Nagtegaal, Parks & Rice, Comput. Methods Appl.
        Mech. Eng. 4, 1974; the Q1-P0 element with its pressure condensed)

    Raises
    ------
    ValueError
        for kinematics that do not fit the body's dimension, and for regions that are unknown, missing or
        overlap.

    Examples
    --------
    >>> from geometry import Body, rectangle
    >>> body = Body.from_grid(rectangle(width=2.0, height=1.0, columns=4, rows=2))
    >>> elasticity = Elasticity(body, Isotropic(E=1e3, nu=0.3))
    >>> elasticity.stiffness().shape
    (30, 30)
    >>> elasticity.total_force("top", (0.0, -1.0)).sum(axis=0)
    array([ 0., -1.])
    >>> stretched = body.coordinates * (1e-3, 0.0)
    >>> elasticity.stress(stretched)[0].diagonal().round(6)  # with sigma_zz of plane strain
    array([1.346154, 0.576923, 0.576923])
    """

    kinds: tuple[type, ...] = (Isotropic, Anisotropic)  # of material
    dilates_around = False  # whether a mean dilatation is there for bodies of revolution

    def __init__(
        self,
        body: Body,
        material: Material | Mapping[str, Material],
        kinematics: str | None = None,
        mean_dilatation: bool = False,
    ):
        checks.instance(Body, body=body)
        kinematics = kinematics or {2: "plane strain", 3: "3d"}[body.dim]
        check_kinematics(kinematics)
        if (kinematics == "3d") != (body.dim == 3):
            raise ValueError(f"The kinematics {kinematics!r} does not fit a body in {body.dim} dimensions.")
        self.axisymmetric = kinematics == "axisymmetric"
        if self.axisymmetric and body.coordinates[:, 0].min() < -ROUNDING * np.ptp(body.coordinates):
            raise ValueError(
                f"The body reaches to x = {body.coordinates[:, 0].min():g}; in axisymmetry x is the distance "
                "from the axis, so that all of the body must have x >= 0."
            )
        if mean_dilatation and self.axisymmetric and not self.dilates_around:
            raise ValueError("A mean dilatation is not there for axisymmetric bodies; take nu up to 0.45.")
        if mean_dilatation and body.cell not in ("quadrilateral", "hexahedron"):
            raise ValueError(f"A mean dilatation is for quadrilaterals and hexahedra, not {body.cell}s.")
        self.body, self.kinematics, self.mean_dilatation = body, kinematics, mean_dilatation
        self.regions, self.materials, self.material_of = _materials(body, material, self.kinds)
        self.V = body.space

    def system(
        self,
        load: np.ndarray | Callable[[float], np.ndarray],
        support: Support | None = None,
        density: float | Mapping[str, float] | None = None,
        damping: tuple[float, float] | None = None,
    ) -> System:
        """Return what `forms.assemble` returns for forms of one's own: matrices and loads with the supports.

        Parameters
        ----------
        load : (N, dim) nodal forces, or a function of the time (or load parameter) that returns them
        support : default none
        density : mass per volume, for motion
        damping : (alpha, beta) of Rayleigh's damping, for motion

        Raises
        ------
        ValueError
            for loads of another shape, damping without a density, or as the parts refuse what they are given

        Examples
        --------
        >>> from forms import Support
        >>> from geometry import Body, rectangle
        >>> elasticity = Elasticity(Body.from_grid(rectangle(2.0, 1.0, 4, 2)), Isotropic(E=1e3, nu=0.3))
        >>> support = Support(elasticity.body).fix("left", x=0.0)
        >>> system = elasticity.system(elasticity.total_force("top", (0.0, -1.0)), support)
        >>> float(system.load.sum())
        -1.0
        """
        support = Support(self.body) if support is None else support
        checks.instance(Support, support=support)
        mass = None if density is None else self.mass(density)
        C = None
        if damping is not None:
            if density is None:
                raise ValueError("Damping is for motion; give the density too.")
            alpha, beta = checks.vector("damping", damping, 2)
            C = self.damping(alpha, beta, density)
        system = support.apply(self.stiffness(), load, mass, C, stress=self.stress)
        system.axisymmetric, system.elasticity = self.axisymmetric, self
        return system

    def stiffness(self) -> sparse.bsr_array:
        """Return K, (N dim, N dim) in dim x dim blocks: integral of strain(v) . C strain(u)."""
        u, v = ufl.TrialFunction(self.V), ufl.TestFunction(self.V)
        C = np.array([material.matrix(self.kinematics) for material in self.materials])
        dx = self._dx(STIFFNESS_DEGREE[self.body.cell])
        if not self.mean_dilatation:
            strain = self._strain_around if self.axisymmetric else _voigt
            return sparse.bsr_array(
                assembly.matrix(self._over(dx, ufl.inner(self._coefficient(C) * strain(v), strain(u))))
            )
        # The largest bulk modulus that leaves the rest positive semidefinite: Hooke's own if isotropic.
        trace = np.repeat([1.0, 0.0], [self.body.dim, C.shape[1] - self.body.dim])
        bulk = 1 / (np.linalg.inv(C) @ trace @ trace)
        rest = self._coefficient(C - bulk[:, None, None] * np.outer(trace, trace))
        K = assembly.matrix(ufl.inner(rest * _voigt(v), _voigt(u)) * dx)
        return sparse.bsr_array(K + self._volumetric_stiffness(bulk[self.material_of]))

    def mass(self, density: float | Mapping[str, float]) -> sparse.bsr_array:
        """Return M, (N dim, N dim): integral of density v . u, consistent."""
        u, v = ufl.TrialFunction(self.V), ufl.TestFunction(self.V)
        rho = self._coefficient(self._densities(density))
        return sparse.bsr_array(
            assembly.matrix(self._over(self._dx(MASS_DEGREE[self.body.cell]), rho * ufl.inner(v, u)))
        )

    def damping(self, alpha: float, beta: float, density: float | Mapping[str, float]) -> sparse.bsr_array:
        """Return Rayleigh's C = alpha M + beta K, (N dim, N dim) in blocks.

        Parameters
        ----------
        alpha, beta : 1/time and time, not negative, or ValueError is raised
        density : mass per volume, or {region: mass per volume}
        """
        checks.not_negative(alpha=alpha, beta=beta)
        return sparse.bsr_array(alpha * self.mass(density) + beta * self.stiffness())

    def body_force(self, vector: ArrayLike) -> np.ndarray:
        """Return nodal forces (N, dim) of a force per volume, say density times gravity."""
        force = fem.Constant(self.body.mesh, checks.vector("vector, the body force,", vector, self.body.dim))
        return assembly.vector(
            self._over(self._dx(MASS_DEGREE[self.body.cell]), ufl.inner(force, ufl.TestFunction(self.V)))
        )

    def traction(self, name: str | Sequence[str], vector: ArrayLike) -> np.ndarray:
        """Return nodal forces (N, dim) of a force per area (in the plane, per length) on a boundary."""
        force = fem.Constant(self.body.mesh, checks.vector("vector, the traction,", vector, self.body.dim))
        return assembly.vector(self._over(self._ds(name), ufl.inner(force, ufl.TestFunction(self.V))))

    def total_force(self, name: str | Sequence[str], vector: ArrayLike) -> np.ndarray:
        """Return nodal forces (N, dim) of a uniform traction on `name` whose sum is `vector`."""
        total = checks.vector("vector, the total force,", vector, self.body.dim)
        weights = self.traction(name, np.ones(self.body.dim))
        return weights / self.body.total(weights) * total

    def boundary_mass(self, name: str | Sequence[str]) -> sparse.csr_array:
        """Return (N, N), the integral of v u over the boundary `name`, for pressures from nodal forces."""
        u, v = ufl.TrialFunction(self._scalar_space), ufl.TestFunction(self._scalar_space)
        M = sparse.csr_array(assembly.matrix(self._over(self._ds(name), v * u)))
        M.eliminate_zeros()
        return M

    def stress(self, u: np.ndarray) -> np.ndarray:
        """Return the stress of u (N, dim) in the middle of each cell, (cells, 3, 3), with sigma_zz.

        The strain is that of the shape functions at the cell's centre, where bilinear elements are at their
        best.
        """
        cells, dim = self.body.cells, self.body.dim
        gradient = self.gradient(u)
        strain = (gradient + gradient.transpose(0, 2, 1)) / 2
        pairs = [(0, 0), (1, 1), (0, 1)] if dim == 2 else [(0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1)]
        voigt = np.stack([strain[:, i, j] * (1 if i == j else 2) for i, j in pairs], axis=1)
        C = np.array([material.matrix(self.kinematics) for material in self.materials])
        if self.axisymmetric:
            around = (np.asarray(u)[cells, 0] / self.body.coordinates[cells, 0].mean(axis=1)[:, None]).mean(
                axis=1
            )
            voigt, pairs = np.insert(voigt, 2, around, axis=1), [(0, 0), (1, 1), (2, 2), (0, 1)]
        values: np.ndarray = np.einsum("cij,cj->ci", C[self.material_of], voigt)
        stress: np.ndarray = np.zeros((len(cells), 3, 3))
        for (i, j), value in zip(pairs, values.T):
            stress[:, i, j] = stress[:, j, i] = value
        if dim == 2 and not self.axisymmetric:
            rows = np.array([material.out_of_plane(self.kinematics) for material in self.materials])
            stress[:, 2, 2] = np.einsum("cj,cj->c", rows[self.material_of], voigt)
        return stress

    def gradient(self, u: np.ndarray) -> np.ndarray:
        """Return the gradient du_i / dx_j of u (N, dim) in the middle of each cell, (cells, dim, dim)."""
        u = checks.array("u", u, self.body.coordinates.shape)
        return np.asarray(np.einsum("cki,ckj->cij", u[self.body.cells], self._gradients))

    def von_mises(self, u: np.ndarray) -> np.ndarray:
        """Return von Mises' equivalent stress of u (N, dim) in the middle of each cell, (cells,)."""
        stress = self.stress(u)
        mean = np.trace(stress, axis1=1, axis2=2) / 3
        deviator = stress - mean[:, None, None] * np.eye(3)
        return np.sqrt(1.5 * np.einsum("cij,cij->c", deviator, deviator))

    @cached_property
    def _scalar_space(self):
        return fem.functionspace(self.body.mesh, compat.lagrange(self.body.cell))

    @cached_property
    def _gradients(self) -> np.ndarray:
        return shape_gradients(self.body.coordinates[self.body.cells])

    def _volumetric_stiffness(self, bulk: np.ndarray) -> sparse.bsr_array:
        """Return B^T (bulk / volume) B, the stiffness against the mean dilatation of each cell.

        B u, the integral of div u over each cell, comes from a space whose cells share no nodes.
        """
        mesh, cells, dim = self.body.mesh, self.body.cells, self.body.dim
        apart, constant = fem.functionspace(mesh, ("DG", 1, (dim,))), fem.functionspace(mesh, ("DG", 0))
        dx = self._dx(VOLUME_DEGREE)
        divergence = assembly.vector(ufl.div(ufl.TestFunction(apart)) * dx)[apart.dofmap.list]
        volume = fem.assemble_vector(fem.form(ufl.TestFunction(constant) * dx)).array
        columns = cells[:, :, None] * dim + np.arange(dim)
        rows = np.arange(len(cells) + 1) * cells.shape[1] * dim
        shape = (len(cells), len(self.body.coordinates) * dim)
        B = sparse.csr_array((divergence.ravel(), columns.ravel(), rows), shape=shape)
        return sparse.bsr_array(B.T @ (sparse.diags_array(bulk / volume) @ B), blocksize=(dim, dim))

    def _coefficient(self, values: np.ndarray) -> fem.Constant | fem.Function:
        """Turn values, one for each material, into a constant or, for several materials, a cellwise function.

        As data rather than numbers in the form, so that a form is compiled once for all materials.
        """
        mesh = self.body.mesh
        if len(values) == 1:
            return fem.Constant(mesh, values[0])
        cellwise = fem.Function(fem.functionspace(mesh, ("DG", 0, values.shape[1:])))
        cellwise.x.array[:] = values[self.material_of].ravel()
        return cellwise

    def _densities(self, density: float | Mapping[str, float]) -> np.ndarray:
        if isinstance(density, Mapping):
            checks.positive(**{f"density of {name!r}": value for name, value in density.items()})
        else:
            checks.positive(density=density)
        if not isinstance(density, Mapping):
            return np.full(len(self.materials), float(density))
        if set(density) != set(self.regions):
            raise ValueError(
                f"There are densities for {sorted(density)} but materials for {sorted(self.regions)}; "
                "give both for the same regions."
            )
        return np.array([float(density[name]) for name in self.regions])

    def _dx(self, degree: int) -> ufl.Measure:
        return ufl.dx(metadata={"quadrature_degree": degree + AROUND_DEGREE * self.axisymmetric})

    def _ds(self, name: str | Sequence[str]) -> ufl.Measure:
        return boundary_measure(self.body.mesh, self.body.facet_indices(name))

    def _over(self, measure: ufl.Measure, integrand: Any) -> ufl.Form:
        """Integral of an integrand, all around the axis in axisymmetry."""
        if self.axisymmetric:
            integrand = 2 * np.pi * ufl.SpatialCoordinate(self.body.mesh)[0] * integrand
        return integrand * measure

    def _strain_around(self, u: Any) -> Any:
        """Strain rr, zz, around the axis, and rz as engineering shear strain."""
        e = ufl.sym(ufl.grad(u))
        r = ufl.SpatialCoordinate(self.body.mesh)[0]
        return ufl.as_vector([e[0, 0], e[1, 1], u[0] / r, 2 * e[0, 1]])


def _voigt(u):
    """Strain xx, yy, xy or xx, yy, zz, yz, xz, xy, with engineering shear strains."""
    e = ufl.sym(ufl.grad(u))
    if e.ufl_shape == (2, 2):
        return ufl.as_vector([e[0, 0], e[1, 1], 2 * e[0, 1]])
    return ufl.as_vector([e[0, 0], e[1, 1], e[2, 2], 2 * e[1, 2], 2 * e[0, 2], 2 * e[0, 1]])


def _materials(
    body: Body, material: Material | Mapping[str, Material], kinds: tuple[type, ...]
) -> tuple[list[str], list[Material], np.ndarray]:
    """Return names of regions, their materials, and which of them each cell has."""
    for one in material.values() if isinstance(material, Mapping) else [material]:
        if not isinstance(one, kinds):
            raise ValueError(
                f"The material is {material!r}; give Isotropic(E=..., nu=...), Anisotropic(matrix), or "
                "{name of a region: one of these}."
            )
    if not isinstance(material, Mapping):
        return [], [material], np.zeros(len(body.cells), dtype=int)
    unknown = set(material) - set(body.regions)
    if unknown:
        raise ValueError(
            f"There is no region {min(unknown)!r} in this body; its regions are {sorted(body.regions)}."
        )
    times = np.zeros(len(body.cells), dtype=int)
    material_of = np.zeros(len(body.cells), dtype=int)
    for number, name in enumerate(material):
        times[body.regions[name]] += 1
        material_of[body.regions[name]] = number
    if np.any(times != 1):
        raise ValueError(
            f"{np.sum(times == 0)} cells have no material and {np.sum(times > 1)} have several; "
            f"let the regions {sorted(material)} cover each cell once."
        )
    return list(material), list(material.values()), material_of
