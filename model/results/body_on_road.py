"""A body above a rigid road as a contact problem, and its solution as pressures, fields and forces.

The way there and back: from facets and road to candidates, gaps and normals; from nodal forces to pressure,
traction and fields for ParaView. System and road are whatever answers to the names used here.
"""

import warnings
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from checks import is_road, nearest, not_negative
from model.problem.contact_problem import ContactProblem
from model.problem.linear_limits import LinearLimits
from model.problem.varying_friction import placed
from model.ranks.shared_problem import SharedProblem
from model.results.gathered import gathered_if_shared
from model.results.reactions import Balance, balance
from model.results.road_surface import write_road


class BodyOnRoad:
    """A body whose boundary may touch a road.

    Parameters
    ----------
    system : forms.System
        What `forms.assemble` makes of the user's own forms, or `forms.Elasticity.system` of ready-made ones.
    facets : array of int, str or sequence of str
        Boundary facets that may touch: their indices (`tags.find(2)`), or the names of boundaries of a
        `geometry.Body`. Nodes that a platen shares with them move with the platen and are left out; a platen
        that is part of the boundary itself is a rigid foot, whose lowest node stands for it on a plane.
    road : geometry.Road
        Its `closest` gives gap, normal and nearest point.
    friction : FrictionLaw, float or None
        A law, Coulomb's coefficient, or None for a frictionless road. A coefficient may vary: an array (n,)
        with one value a candidate; {boundary: value}; a list with one value for each of `SeveralRoads`; or a
        function of points (n, dim) of the road, of one that moves as they lie at time 0. It is read where the
        node sticks as a step begins.
    reach : float, optional
        Take for candidates only nodes whose gap is at most this (mm); default all of the boundary.
    interference : bool
        The body is drawn into the road, as in a press fit, and is to be pushed out of it in the first solve.

    Attributes
    ----------
    problem : ContactProblem
    nodes : (n,)
        Candidates, as nodes of the space.
    points : (n, dim)
        Where they are before loading.
    area : (n,)
        Area (in the plane, length) of the boundary that belongs to each.

    Raises
    ------
    ValueError
        If the boundary is unknown or out of reach, or as `ContactProblem`.

    Examples
    --------
    >>> from forms import Elasticity, Isotropic, Support
    >>> from geometry import Body, Plane, rectangle
    >>> from model import solve
    >>> elasticity = Elasticity(Body.from_grid(rectangle(2.0, 1.0, 4, 2)), Isotropic(E=1e3, nu=0.0))
    >>> support = Support(elasticity.body).fix("top", x=0.0, y=-0.01)
    >>> contact = BodyOnRoad(elasticity.system(elasticity.body_force((0.0, 0.0)), support), "bottom", Plane())
    >>> contact.pressure(solve(contact)).round(9)
    array([10., 10., 10., 10., 10.])
    """

    def __init__(
        self,
        system: Any,
        facets: Any,
        road: Any,
        friction: Any = None,
        reach: float | None = None,
        interference: bool = False,
    ):
        if not hasattr(system, "candidates"):
            raise ValueError(
                f"The system is of type {type(system).__name__}; give what forms.assemble(...) or "
                "elasticity.system(load, support) returns."
            )
        is_road(road)
        if reach is not None:
            not_negative(reach=reach)
        nodes, area = system.candidates(facets, road)
        points = system.points[nodes]
        gap, normal, _ = nearest(road_at(road), points)
        near = np.full(nodes.size, True) if reach is None else gap <= reach
        exchange = system.exchanges[0] if system.exchanges else None
        if exchange is not None:
            near &= system.node_of[nodes] < exchange.owned
        if not (near.any() if exchange is None else exchange.any(near.any())):
            raise ValueError(
                f"No node of {facets!r} is within {reach} of the road, "
                f"the nearest is {gap.min(initial=np.inf):g} away; "
                "give a larger reach or bring body and road together."
            )
        self.system, self.road = system, road
        self.nodes, self.points, self.area = nodes[near], points[near], area[near]
        of_system, places = (system.A, system.load, system.coordinates), system.node_of[self.nodes]
        law = placed(friction, system, self.nodes, road)
        arrays = (*of_system, places, normal[near], gap[near], law)
        more = {
            "prolongations": system.prolongations,
            "interference": interference,
            "turning": system.turning,
        }
        if exchange is None:
            self.problem = ContactProblem(*arrays, **more)
        else:
            self.problem = SharedProblem(*arrays, **more, exchanges=system.exchanges, ids=system.ids)

    @property
    def elasticity(self) -> Any:
        """The ready-made forms (`forms.Elasticity`) that made the system, or None."""
        return self.system.elasticity

    @property
    def mesh(self) -> Any:
        """The dolfinx mesh; with `cells`, what `model.Series` and `model.write_xdmf` ask of a body."""
        return self.system.mesh

    @property
    def cells(self) -> np.ndarray:
        """Nodes (cells, k) of each cell."""
        return np.asarray(self.system.cells)

    @cached_property
    def limits(self) -> LinearLimits:
        """Checks whether linear strain is true to a displacement, and warns once if not."""
        return LinearLimits(self.system.shape_gradients, self.system.cells)

    def check_strain(self, solution: Any) -> None:
        """Warn (BeyondLinear), once, where strains or rotations are beyond what linear strain is true to."""
        if self.system.elastic is None:
            self.limits.check(self.displacement(solution))

    def pressure(self, solution: Any) -> np.ndarray:
        """Return the pressure (n,) at the candidates, lumped: nodal force over area (MPa).

        Warns
        -----
        BeyondLinear
            Where strains or rotations are beyond what linear strain is true to and no solve has said so.
        """
        self.check_strain(self._own(solution))
        return self._normal_force(solution) / self.area

    def traction(self, solution: Any) -> np.ndarray:
        """Return the traction (n, dim) of the road on the body at the candidates, lumped (MPa)."""
        return np.asarray(self._own(solution).contact_force / self.area[:, None])

    def displacement(self, solution: Any) -> np.ndarray:
        """Return the displacement of all nodes of the space, (N, dim).

        Raises
        ------
        TypeError, ValueError
            If it is no solution, or that of a body with another number of nodes.
        """
        return np.asarray(self.system.expand(self._own(solution).displacement))

    def function(self, solution: Any) -> Any:
        """Return the displacement as a dolfinx Function in the user's own space."""
        return self.system.function(self._own(solution).displacement)

    def fields(self, solution: Any) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
        """Return the fields of nodes and of cells for `model.write_xdmf` and `model.Series`.

        At the nodes displacement, contact_pressure, contact_traction, gap (distance to the road) and status
        (0 free, 1 slip, 2 stick); in the cells stress and, where it has all three normal components,
        von_mises. Stress is left out where the system does not know it: see `stress` of `forms.assemble`.

        Parameters
        ----------
        solution : Solution, or a State of motion
        """
        u = self.displacement(solution)
        nodes = {
            "displacement": u,
            "contact_pressure": np.zeros(len(u)),
            "contact_traction": np.zeros(u.shape),
            "gap": road_at(self.road, getattr(solution, "time", None) or 0.0).closest(self.system.points + u)[
                0
            ],
            "status": np.zeros(len(u)),
        }
        at = self.nodes
        nodes["contact_pressure"][at] = self.pressure(solution)
        nodes["contact_traction"][at] = self.traction(solution)
        nodes["gap"][at], nodes["status"][at] = solution.gap, solution.status
        if self.system.stress is None:
            return nodes, {}
        cells = {"stress": self.system.stress(u)}
        if cells["stress"].shape[1:] == (3, 3):
            cells["von_mises"] = von_mises(cells["stress"])
        return nodes, cells

    def reactions(self, solution: Any, about: Any = None, load: np.ndarray | None = None) -> Balance:
        """Return the forces of supports and platens, and the sheet in which all forces on the body balance.

        Loads, reactions, contact, springs to the ground, damping and inertia, each with its sum and its
        moment about a point. In motion, inertia is M a: the sheet closes for schemes in equilibrium at the
        end of the step, as Newmark's is, and says by how much others are not.

        Parameters
        ----------
        solution : Solution, or a State of motion
        about : (d,), optional
            Point of the moments; default the origin.
        load : (N, d), optional
            Forces on the nodes of the space, where the solution is of loads that were given as arrays.

        Raises
        ------
        ValueError
            If the load is another one than the solution's.

        Examples
        --------
        >>> from forms import Elasticity, Isotropic, Support
        >>> from geometry import Body, Plane, rectangle
        >>> from model import solve
        >>> body = Body.from_grid(rectangle(2.0, 1.0, 4, 2))
        >>> elasticity = Elasticity(body, Isotropic(E=1e3, nu=0.0))
        >>> support = Support(body).fix("top", x=0.0, y=-0.01)
        >>> system = elasticity.system(elasticity.body_force((0.0, 0.0)), support)
        >>> contact = BodyOnRoad(system, "bottom", Plane())
        >>> sheet = contact.reactions(solve(contact), about=(1.0, 0.0))
        >>> sheet.force["reactions"].round(9) + 0.0, sheet.at(body.nodes("top"))[0].round(9) + 0.0
        (array([  0., -20.]), array([  0., -20.]))
        """
        return balance(self, solution, about, load)

    def write(self, path: str | Path, solution: Any) -> None:
        """Write the fields of one solution to NAME.xdmf and NAME.h5, and the road to NAME_road.xdmf and .h5.

        Warns if no stress is among the fields.
        """
        from model.results.xdmf import write_xdmf

        if self.system.stress is None:
            warnings.warn(
                f"{path} is written without stress, which these forms do not tell; "
                "give forms.assemble(..., stress=sigma) to have it.",
                stacklevel=2,
            )
        body: Any = self
        nodes, cells = self.fields(solution)
        around = self.system.points + nodes["displacement"]
        whole = gathered_if_shared(self)
        if whole is not None:
            around = np.concatenate(whole.comm.allgather(around))
            body, (nodes, cells) = whole.body, whole.fields(nodes, cells)
            if whole.comm.rank:
                return
        write_xdmf(path, body, nodes, cells)
        path = Path(path)
        write_road(
            path.with_name(f"{path.stem}_road.xdmf"),
            road_at(self.road, getattr(solution, "time", 0.0)),
            around,
        )

    def _own(self, solution: Any) -> Any:
        """Return a solution of this body and these candidates, or refuse it."""
        if not (hasattr(solution, "displacement") and hasattr(solution, "contact_force")):
            raise TypeError(
                f"The solution is a {type(solution).__name__}; give what solve(contact) returns, or a State "
                "of motion."
            )
        nodes, candidates = len(solution.displacement), len(solution.contact_force)
        if (nodes, candidates) != (len(self.system.fixed), len(self.nodes)):
            raise ValueError(
                f"The solution is of {nodes} nodes and {candidates} candidates, but this body has "
                f"{len(self.system.fixed)} and {len(self.nodes)}; give a solution of this contact."
            )
        return solution

    def _normal_force(self, solution: Any) -> np.ndarray:
        """Pressure forces (n,); in motion, of the normals where the candidates are now."""
        if hasattr(solution, "pressure_force"):
            return np.asarray(solution.pressure_force)
        at = self.points + self.displacement(solution)[self.nodes]
        normal = road_at(self.road, solution.time).closest(at)[1]
        return np.maximum(np.einsum("ca,ca->c", normal, solution.contact_force), 0.0)


def road_at(road: Any, time: float = 0.0) -> Any:
    """Return a road as it is at a time: a moving one where it is then, another one itself."""
    return road.at(time) if hasattr(road, "at") else road


def von_mises(stress: np.ndarray) -> np.ndarray:
    """Return von Mises' equivalent stress (cells,) of stresses (cells, 3, 3).

    Examples
    --------
    >>> float(von_mises(np.diag([2.0, 0.0, 0.0])[None])[0])
    2.0
    """
    deviator = stress - np.trace(stress, axis1=1, axis2=2)[:, None, None] / 3 * np.eye(3)
    return np.asarray(np.sqrt(1.5 * np.einsum("cij,cij->c", deviator, deviator)))
