"""Weak forms of finite rotation and finite strain: total Lagrangian, assembled into node-blocked arrays.

With F = I + grad u and C = F^T F, the internal force is the derivative of the energy, integral of psi(C).
In a step of time from u0 to u1 the force is integral of (F0 + F1)/2 S : grad v with the step stress

    S = mean of S(C0 + t dC) at two Gauss points t + 2 (psi(C1) - psi(C0) - S : dC/2) / (dC : dC + tiny) dC,

so that it does exactly the work psi(C1) - psi(C0), and has no moment about any point. For St. Venant and
Kirchhoff's material it is that of Simo and Tarnow, Z. angew. Math. Phys. 43 (1992) 757; the correction is
that of O. Gonzalez, Comput. Methods Appl. Mech. Engrg. 190 (2000) 1763.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from copy import copy
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sparse

from checks import finite, named
from forms.elasticity import AROUND_DEGREE, Elasticity
from forms.facets import boundary_measure
from forms.strain_energies import ZERO, StrainEnergy, strain_energy
from forms.system import System
from geometry import Body, compat  # noqa: F401  # compat comes before dolfinx

import basix  # isort: skip
import ufl  # isort: skip
from dolfinx import fem  # isort: skip
from dolfinx import mesh as dolfinx_mesh  # isort: skip

# Two Gauss points along each side of a quadrilateral or hexahedron; F is constant in a simplex.
QUADRATURE_DEGREE = {"triangle": 1, "tetrahedron": 1, "quadrilateral": 2, "hexahedron": 2}
CENTRE = 1
# Lets the compiler take logarithms of several points at once, to 4 units in the last place instead of 1:
# residuals, most of them logarithms, cost half.
COMPILED = {"cffi_extra_compile_args": ["-O3", "-ffast-math", "-g0"]}
# Keeps the step stress smooth where nothing deforms: a switch makes Newton stall, and 1e-8 magnifies the
# rounding of psi until it stalls as well. What the two points miss where dC : dC is less than this is 1.4e-11
# of the energy in the worst step of a bouncing ring.
SMOOTH = 1e-6
SAME_HEIGHT = (
    1e-9  # of the body's size: nodes that a straight cut has left so near each other are in its plane
)
POINTS = (0.5 - 0.5 / np.sqrt(3), 0.5 + 0.5 / np.sqrt(3))


class Inverted(ValueError):
    """A cell is turned inside out."""


class Pressure(NamedTuple):
    """A pressure that follows a boundary.

    Attributes
    ----------
    name : str
    facets : (f,)
    value : UFL
    origin : fem.Constant
        Where the volume is measured from, (dim,).
    planes : list of (m,)
        For each axis the nodes of the rim that are held along it: the origin is at their height.
    """

    name: str
    facets: np.ndarray
    value: Any
    origin: Any
    planes: list[np.ndarray]


class Hyperelasticity(Elasticity):
    """Hyperelasticity of a body that may turn and deform by any amount.

    Loads and mass are those of `Elasticity`.

    Parameters
    ----------
    body : Body
    energy : StrainEnergy, or a function psi(C) in UFL of the 3 x 3 matrix C, or {name of a region: energy}
    mean_dilatation : bool
        Give each cell one dilatation, so that rubber does not lock: the volumetric energy is taken at the
        middle of the cell (in plane strain that is its mean dilatation exactly).
    pressure : {name of a boundary: pressure}
        That follows the boundary as it moves, > 0 towards the body (force per area). Its energy, - pressure
        times the volume that the boundary encloses, counts as elastic energy. `FiniteContact` lays it on in
        proportion along its load path; in motion it is there from the start.
    kinematics : str
        As for `Elasticity`: "plane strain" (the default in the plane), "axisymmetric" or "3d".

    Raises
    ------
    ValueError
        As `Elasticity`, for an energy that minds rotations or has negative moduli, and, from `system`, for a
        pressure on a boundary that is not closed and whose rim is not fixed.

    Examples
    --------
    >>> from forms import Hyperelasticity, NeoHookean
    >>> from geometry import Body, rectangle
    >>> body = Body.from_grid(rectangle(1.0, 1.0, 4, 4))
    >>> rubber = Hyperelasticity(body, NeoHookean(E=1e6, nu=0.45))
    >>> turned = body.coordinates @ np.array([[0.0, 1.0], [-1.0, 0.0]]) - body.coordinates
    >>> bool(np.abs(rubber.internal_force(turned)).max() < 1e-12 * 1e6)
    True
    """

    kinds = (StrainEnergy,)
    dilates_around = True

    def __init__(
        self,
        body: Body,
        energy: StrainEnergy | Callable[[Any], Any] | Mapping[str, Any],
        mean_dilatation: bool = False,
        pressure: Mapping[str, float] | None = None,
        kinematics: str | None = None,
    ):
        if kinematics == "plane stress":
            raise ValueError("Plane stress is there for linear strain only; take a thin body in space.")
        given: Any = (
            {name: strain_energy(psi) for name, psi in energy.items()}
            if isinstance(energy, Mapping)
            else strain_energy(energy)
        )
        super().__init__(body, given, kinematics, mean_dilatation)
        self.energies: list[StrainEnergy] = self.materials  # type: ignore[assignment]
        self._start, self._end = fem.Function(self.V), fem.Function(self.V)
        self._matrices: dict[str, Any] = {}
        self._cells = np.arange(len(self.body.cells), dtype=np.int32)
        self._part = fem.Constant(body.mesh, 1.0)
        self._pressures: list[Pressure] = []
        for name, value in named("pressure", pressure).items():
            finite(**{f"pressure on {name!r}": value})
            acting, none = self._part * fem.Constant(body.mesh, float(value)), np.empty(0, dtype=int)
            origin = fem.Constant(body.mesh, np.zeros(body.dim))
            facets = body.facet_indices(name)
            self._pressures.append(Pressure(name, facets, acting, origin, [none] * body.dim))

    def lay_on(self, part: float) -> None:
        """Let this part of the pressures act, 1 for all."""
        self._part.value = np.float64(part)  # type: ignore[assignment]

    def around(self, nodes: np.ndarray) -> Hyperelasticity:
        """Return the same of the cells at some nodes only: forces and tangents there are the body's."""
        part = copy(self)
        for made in ("_forms", "_rules", "_point_gradients", "_mean_gradients"):
            part.__dict__.pop(made, None)
        part._matrices = {}
        part._cells = np.flatnonzero(np.isin(self.body.cells, nodes).any(axis=1)).astype(np.int32)
        return part

    def system(self, *arguments: Any, **options: Any) -> System:
        """Return the system with loads and supports, as `Elasticity.system` does, at rest."""
        system = super().system(*arguments, **options)
        support = options.get("support", arguments[1] if len(arguments) > 1 else None)
        if support is not None and (support.springs.any() or support.dashpots.any()):
            raise ValueError("Springs and dashpots to the ground are there for linear strain only.")
        self._check_rims(system)
        if system.turning is not None:
            raise ValueError("Platens tilt by small angles, for linear strain only; leave tilt out.")
        system.elastic = self
        return system

    def _check_rims(self, system: System) -> None:
        """Refuse a pressure on a boundary whose rim may move: it has no energy.

        A rim may move in a plane, as that of a half does where it is cut: volumes are measured from there.
        """
        X, held = self.body.coordinates, system.fixed[system.node_of]
        u = np.random.default_rng(1).uniform(-0.01, 0.01, X.shape) * np.ptp(X)
        in_plane = np.where(held, 0.0, u)
        for pressure in self._pressures:
            rim = self._has_no_energy(pressure, u).any(axis=1)
            for axis in range(self.axisymmetric, self.body.dim):  # volumes are measured from the axis
                nodes = np.flatnonzero(rim & held[:, axis])
                if nodes.size and np.ptp(X[nodes, axis]) < SAME_HEIGHT * np.ptp(X):
                    pressure.planes[axis] = nodes
            if (self._has_no_energy(pressure, in_plane) & ~held).any():
                raise ValueError(
                    f"The pressure acts on {pressure.name!r}, whose rim may move, so that it has no energy; "
                    "fix the rim's nodes, or hold them in a plane where the body is cut, or name a boundary "
                    "that closes."
                )

    def _has_no_energy(self, pressure: Pressure, u: np.ndarray) -> np.ndarray:
        """Tell at which unknowns (N, dim) a pressure's force at u (N, dim) is not the slope of its energy."""
        self._put(u)
        v, ds = ufl.TestFunction(self.V), boundary_measure(self.body.mesh, pressure.facets)
        n = self._turned_normal(self._stretch(self._end))
        direct = self._over(ds, pressure.value * ufl.inner(n, v))
        energy = ufl.derivative(self._pressure_energy(pressure), self._end, v)
        found, wanted = (
            fem.assemble_vector(fem.form(form)).array.reshape(u.shape) for form in (energy, direct)
        )
        return np.asarray(np.abs(found - wanted) > 1e-9 * np.abs(wanted).max())

    def stiffness(self) -> sparse.bsr_array:
        """Return the tangent at rest, (N dim, N dim) in dim x dim blocks, without pressure."""
        part = float(self._part.value)
        self.lay_on(0.0)
        K = self.tangent(np.zeros_like(self.body.coordinates)).copy()
        self.lay_on(part)
        return K

    def strain_energy(self, u: np.ndarray) -> float:
        """Return the elastic energy at displacement u (N, dim)."""
        self._put(u)
        return float(np.real(sum(fem.assemble_scalar(form) for form in self._forms["energy"])))

    def internal_force(self, u: np.ndarray) -> np.ndarray:
        """Return the nodal forces (N, dim) that hold the displacement u (N, dim)."""
        self._put(u)
        return self._vector_of("force")

    def tangent(self, u: np.ndarray) -> sparse.bsr_array:
        """Return the derivative of the internal force, (N dim, N dim); the next call overwrites it."""
        self._put(u)
        return self._matrix_of("tangent")

    def step_force(self, before: np.ndarray, after: np.ndarray) -> np.ndarray:
        """Return the mean internal force (N, dim) of a step from one displacement (N, dim) to another.

        It does the work by which the elastic energy changes, and has neither sum nor moment.
        """
        self._put(after, before)
        return self._vector_of("step force")

    def step_tangent(self, before: np.ndarray, after: np.ndarray) -> sparse.bsr_array:
        """Return its derivative by `after`, (N dim, N dim), not symmetric; the next call overwrites it."""
        self._put(after, before)
        return self._matrix_of("step tangent")

    def rate_force(self, before: np.ndarray, after: np.ndarray) -> np.ndarray:
        """Return the nodal forces (N, dim) of the stress C1 - C0 in a step, as of a viscosity of 1.

        It has neither sum nor moment, and does work wherever the body deforms.
        """
        self._put(after, before)
        return self._vector_of("rate force")

    def volume_ratio(self, u: np.ndarray) -> float:
        """Return the smallest det F at displacement u (N, dim), over all points that the forms look at."""
        d, smallest = self.body.dim, np.inf
        for gradient, around in self._point_gradients:
            F = (gradient @ u).reshape(-1, d, d) + np.eye(d)
            J = _determinant(F)
            if self.axisymmetric:
                J *= 1.0 + around @ u[:, 0]
            smallest = min(smallest, float(J.min()))
        return smallest

    def stretches_at_nodes(self, u: np.ndarray) -> np.ndarray:
        """Return the mean of F over the cells around each node, (N, dim, dim), at displacement u (N, dim)."""
        d = self.body.dim
        H = (self._mean_gradients @ u).reshape(-1, d, d)
        return np.asarray(H.swapaxes(1, 2) + np.eye(d))

    def check_volume(self, u: np.ndarray, what: str) -> None:
        """Raise Inverted, with the remedy, if a cell is turned inside out at displacement u (N, dim)."""
        smallest = self.volume_ratio(u)
        if smallest > 0.0:
            return
        if all(energy.bears_compression for energy in self.energies):
            raise Inverted(
                f"{what} has a cell turned inside out (det F = {smallest:.3g}); move it there in steps."
            )
        raise Inverted(
            f"{what} has a cell turned inside out (det F = {smallest:.3g}), which St. Venant and Kirchhoff's "
            "material does not resist; NeoHookean, with the same E and nu, bears compression."
        )

    def stress(self, u: np.ndarray) -> np.ndarray:
        """Return Cauchy's stress at the middle of each cell, (cells, 3, 3), in dolfinx's order."""
        self._put(u)
        cells = np.arange(len(self.body.cells), dtype=np.int32)
        values = np.zeros((len(cells), 3, 3))
        for number, expression in enumerate(self._stresses):
            here = cells[self.material_of == number]
            values[here] = np.asarray(expression.eval(self.body.mesh, here)).reshape(-1, 3, 3)
        return values

    def _put(self, u: np.ndarray, before: np.ndarray | None = None) -> None:
        """Set the displacements; forms see gradients only, so a common translation is rounding saved."""
        # where a pressure's rim is fixed, it is fixed in space; the axis is there always
        shift: Any = 0.0 if self._pressures else np.array([0.0, 1.0]) if self.axisymmetric else 1.0
        self._end.x.array[:] = (np.asarray(u) - shift * u[0]).ravel()
        if before is not None:
            self._start.x.array[:] = (np.asarray(before) - shift * before[0]).ravel()
        for pressure in self._pressures:
            for axis, nodes in enumerate(pressure.planes):
                if nodes.size:
                    pressure.origin.value[axis] = (self.body.coordinates + u)[nodes, axis].mean()

    @cached_property
    def _forms(self) -> dict[str, list[Any]]:
        """Compiled forms by name, one a quadrature rule or pressure, each made when it is first asked for."""
        v, du = ufl.TestFunction(self.V), ufl.TrialFunction(self.V)
        F0, F1 = self._stretch(self._start), self._stretch(self._end)
        C0, C1 = _right_cauchy_green(F0), _right_cauchy_green(F1)
        mesh, acting, rows = self.body.mesh, self._acting, F0.ufl_shape[0]

        def within(integrand: Callable[[Any], Any]) -> list[Any]:
            return [sum(self._over(dx, integrand(psi)) for psi, dx in rule) for rule in self._rules]

        def along(S: Any) -> Any:
            return ufl.inner(0.5 * (F0 + F1) * _in_the_body(S, rows), self._gradient(v))

        def pressed(*stretches: Any) -> list[Any]:  # by the mean of these deformations' normals
            n = sum(map(self._turned_normal, stretches[1:]), self._turned_normal(stretches[0]))
            along_n = ufl.inner(n / len(stretches), v)
            return [self._over(boundary_measure(mesh, one.facets), one.value * along_n) for one in acting]

        def by(forms: list[Any], direction: Any) -> list[Any]:
            return [ufl.derivative(form, self._end, direction) for form in forms]

        def energy() -> list[Any]:
            return within(lambda psi: psi(C1)) + [self._pressure_energy(pressure) for pressure in acting]

        def force() -> list[Any]:
            return by(within(lambda psi: psi(C1)), v) + pressed(F1)

        def step_force() -> list[Any]:  # that of pressure is of degree dim - 1 along the way: two points do
            between = [F0 + float(t) * (F1 - F0) for t in POINTS]
            return within(lambda psi: along(_step_stress(psi, C0, C1))) + pressed(*between)

        made = {
            "energy": energy,
            "force": force,
            "tangent": lambda: by(force(), du),
            "step force": step_force,
            "step tangent": lambda: by(step_force(), du),
            "rate force": lambda: within(lambda psi: along(C1 - C0)),
        }
        return _Forms(made)

    @property
    def _acting(self) -> list[Pressure]:
        """The pressures on facets of these cells."""
        mesh, dim = self.body.mesh, self.body.dim
        if len(self._cells) == len(self.body.cells) or not self._pressures:
            return self._pressures
        mesh.topology.create_connectivity(dim - 1, dim)
        cell_of = mesh.topology.connectivity(dim - 1, dim)
        found = []
        for pressure in self._pressures:
            here = np.array([cell_of.links(facet)[0] for facet in pressure.facets])
            found.append(pressure._replace(facets=pressure.facets[np.isin(here, self._cells)]))
        return [pressure for pressure in found if pressure.facets.size]

    def _pressure_energy(self, pressure: Pressure) -> Any:
        """Return - p times the volume within facets: p/d times the integral of n . x, n out of the body."""
        F, x = self._stretch(self._end), ufl.SpatialCoordinate(self.body.mesh) + self._end
        outwards = pressure.value / F.ufl_shape[0] * ufl.inner(self._turned_normal(F), x - pressure.origin)
        return self._over(boundary_measure(self.body.mesh, pressure.facets), outwards)

    def _stretch(self, u: Any) -> Any:
        """F, 2 x 2 in plane strain."""
        H = self._gradient(u)
        return ufl.Identity(H.ufl_shape[0]) + H

    def _gradient(self, u: Any) -> Any:
        """Gradient of u; around the axis of a body of revolution that is u_r / r."""
        if not self.axisymmetric:
            return ufl.grad(u)
        return _in_space(ufl.grad(u), u[0] / ufl.SpatialCoordinate(self.body.mesh)[0])

    def _turned_normal(self, F: Any) -> Any:
        """Normal out of the body, turned by F and as long as areas have become larger."""
        n, A = ufl.FacetNormal(self.body.mesh), _cofactor(F)
        return ufl.as_vector([sum(A[i, j] * n[j] for j in range(len(n))) for i in range(len(n))])

    @cached_property
    def _rules(self) -> list[list[tuple[Callable[[Any], Any], ufl.Measure]]]:
        """For each quadrature rule the energy densities, each with where it is integrated.

        FFCx 0.11 mixes up its tables where one form has two rules, so each rule has a form of its own.
        """
        mesh, cells = self.body.mesh, self._cells
        tags = dolfinx_mesh.meshtags(mesh, self.body.dim, cells, self.material_of[cells].astype(np.int32))
        constants = [
            {name: fem.Constant(mesh, value) for name, value in energy.parameters.items()}
            for energy in self.energies
        ]

        def rule(degree: int, *names: str) -> list[tuple[Callable[[Any], Any], ufl.Measure]]:
            dx = ufl.Measure("dx", mesh, subdomain_data=tags, metadata={"quadrature_degree": degree})
            found: list[Any] = []
            for number, (energy, values) in enumerate(zip(self.energies, constants)):
                parts = [getattr(energy, name) for name in names if getattr(type(energy), name) is not ZERO]
                if parts:
                    psi = lambda C, parts=parts, values=values: sum(part(C, values) for part in parts)  # noqa: E731
                    found.append((psi, dx(number)))
            return found

        if not self.mean_dilatation:
            return [rule(self._degree, "density", "volumetric")]
        return [found for found in (rule(self._degree, "density"), rule(CENTRE, "volumetric")) if found]

    @property
    def _degree(self) -> int:
        return QUADRATURE_DEGREE[self.body.cell] + AROUND_DEGREE * self.axisymmetric

    @cached_property
    def _point_gradients(self) -> list[tuple[sparse.csr_array, Any]]:
        """From a field (N, dim) to its transposed gradients at a rule's points, (cells points dim, N).

        Each with what takes displacements from the axis to u_r / r there, (cells points, N).
        """
        kind, cells = basix.CellType[self.body.cell], self.body.cells[self._cells]
        element = basix.create_element(basix.ElementFamily.P, kind, 1, basix.LagrangeVariant.equispaced)
        corners = self.body.coordinates[cells]
        found = []
        for degree in {self._degree} | ({CENTRE} if self.mean_dilatation else set()):
            points = np.asarray(basix.make_quadrature(kind, degree)[0])
            table: Any = element.tabulate(1, points)
            reference: np.ndarray = np.moveaxis(table[1:, :, :, 0], 0, -1)
            jacobian = np.einsum("cki,qkj->cqij", corners, reference)
            gradients = np.einsum("qkj,cqji->cqik", reference, np.linalg.inv(jacobian))
            rows, corners_of = gradients[..., 0].size, np.broadcast_to(cells[:, None, None], gradients.shape)
            starts = np.arange(rows + 1) * gradients.shape[-1]
            shape = rows, len(self.body.coordinates)
            gradient = sparse.csr_array((gradients.ravel(), corners_of.ravel(), starts), shape=shape)
            around = None
            if self.axisymmetric:
                values = table[0, :, :, 0]
                ratios = values / (corners[:, :, 0] @ values.T)[:, :, None]
                at, of = np.arange(rows // 2 + 1) * values.shape[1], corners_of[:, :, 0].ravel()
                around = sparse.csr_array((ratios.ravel(), of, at), shape=(rows // 2, shape[1]))
            found.append((gradient, around))
        return found

    @cached_property
    def _mean_gradients(self) -> sparse.csr_array:
        """From a field (N, dim) to the means of its transposed gradients around each node, (N dim, N)."""
        gradient, cells, d = self._point_gradients[0][0], self.body.cells[self._cells], self.body.dim
        N, points = len(self.body.coordinates), gradient.shape[0] // (d * len(cells))
        nodes = np.repeat(cells[:, None], points, axis=1)  # of each point's cell
        rows = (nodes[..., None] * d + np.arange(d)).swapaxes(2, 3).ravel()
        columns = np.repeat(np.arange(gradient.shape[0]), cells.shape[1])
        around = np.maximum(np.bincount(nodes.ravel(), minlength=N), 1)
        mean = sparse.csr_array((1.0 / around[rows // d], (rows, columns)), shape=(N * d, gradient.shape[0]))
        return sparse.csr_array(mean @ gradient)

    @cached_property
    def _stresses(self) -> list[Any]:
        """Cauchy's stress in the middle of a cell, for each material."""
        F = self._stretch(self._end)
        C, J = _right_cauchy_green(F), ufl.det(F)
        G = _in_space(F)
        kind = basix.CellType[self.body.cell]
        middle = basix.geometry(kind).mean(axis=0)[None, :]
        return [fem.Expression(G * _stress(energy, C) * G.T / J, middle) for energy in self.energies]

    def _vector_of(self, name: str) -> np.ndarray:
        total = np.zeros(self._end.x.array.size)
        for form in self._forms[name]:
            fem.assemble_vector(total, form)
        return total.reshape(-1, self.body.dim)

    def _matrix_of(self, name: str) -> sparse.bsr_array:
        forms = self._forms[name]
        if name not in self._matrices:
            A = fem.create_matrix(forms[0])
            self._matrices[name] = A, sparse.bsr_array(A.to_scipy())
        A, view = self._matrices[name]
        A.set_value(0.0)
        for form in forms:
            fem.assemble_matrix(A, form)
        if self.body.mesh.comm.size > 1:  # alone it costs as much as the assembly of a small mesh
            A.scatter_reverse()
        view.data[...] = A.data.reshape(view.data.shape)
        return view


class _Forms(dict):
    """Forms compiled when they are first asked for: a scene pays for what it uses."""

    def __init__(self, makers: Mapping[str, Callable[[], list[Any]]]):
        super().__init__()
        self._makers = makers

    def __missing__(self, name: str) -> Any:
        self[name] = [fem.form(form, jit_options=COMPILED) for form in self._makers[name]()]
        return self[name]


def _cofactor(F: Any) -> Any:
    """Return det(F) F^-T, which turns areas along."""
    if F.ufl_shape == (2, 2):
        return ufl.as_matrix([[F[1, 1], -F[1, 0]], [-F[0, 1], F[0, 0]]])
    return ufl.det(F) * ufl.inv(F).T


def _in_space(A: Any, last: float = 1.0) -> Any:
    """Return a 2 x 2 matrix as one of space, `last` being out of the plane."""
    if A.ufl_shape == (3, 3):
        return A
    return ufl.as_matrix([[A[0, 0], A[0, 1], 0], [A[1, 0], A[1, 1], 0], [0, 0, last]])


def _in_the_body(A: Any, dim: int) -> Any:
    return A if dim == 3 else ufl.as_matrix([[A[i, j] for j in range(dim)] for i in range(dim)])


def _right_cauchy_green(F: Any) -> Any:
    return _in_space(F.T * F)


def _stress(psi: Callable[[Any], Any], C: Any) -> Any:
    """Return the second Piola-Kirchhoff stress 2 dpsi/dC (3, 3)."""
    at = ufl.variable(C)
    return 2 * ufl.sym(ufl.diff(psi(at), at))


def _step_stress(psi: Callable[[Any], Any], C0: Any, C1: Any) -> Any:
    """Return the step stress (3, 3) of the head of this file."""
    dC = C1 - C0
    mean = 0.5 * sum((_stress(psi, C0 + t * dC) for t in POINTS[1:]), _stress(psi, C0 + POINTS[0] * dC))
    missing = psi(C1) - psi(C0) - 0.5 * ufl.inner(mean, dC)
    return mean + 2 * missing / (ufl.inner(dC, dC) + SMOOTH) * dC


def _determinant(F: np.ndarray) -> np.ndarray:
    """Return det of (..., d, d) for d = 2 or 3; quicker than numpy's on many small ones."""
    if F.shape[-1] == 2:
        return F[..., 0, 0] * F[..., 1, 1] - F[..., 0, 1] * F[..., 1, 0]
    return np.einsum("...i,...i->...", F[..., 0], np.cross(F[..., 1], F[..., 2]))
