"""A body above a rigid road as a contact problem, and the solution as what scenes look at.

The way there and back: from boundary and road to candidates, gaps and normals; from nodal forces to pressure,
traction and fields for ParaView. Body, forms and road are whatever answers to the names used here.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from model.node_loop.friction_laws import FrictionLaw
from model.problem.contact_problem import ContactProblem
from model.results.linear_limits import linear_limits
from model.solvers.contact_solver import Solution


class BodyOnRoad:
    """A body whose boundary may touch a road.

    >>> system = Support(body).platen("top").apply(elasticity.stiffness(), load)  # doctest: +SKIP
    >>> pressed = BodyOnRoad(elasticity, system, Plane(), "arc", friction=0.5)  # doctest: +SKIP
    >>> solution = solve(pressed.problem)  # doctest: +SKIP
    >>> pressed.pressure(solution)  # doctest: +SKIP

    Parameters
    ----------
    elasticity : forms.Elasticity
        Of the body.
    system : forms.System
        Matrix and load after the supports, of N nodes in `dim` dimensions.
    road : geometry.Road
        Its `closest` gives gap, normal and nearest point.
    boundary : str or sequence of str
        Boundary of the body that may touch, or several of them (of several bodies, say); nodes that a platen
        shares with it move with the platen and are left out.
    friction : FrictionLaw, float or None
        A law, Coulomb's coefficient, or None for a frictionless road.
    reach : float, optional
        Take for candidates only nodes whose gap is at most this (mm); default all of the boundary.

    Attributes
    ----------
    problem : ContactProblem
    nodes : (n,)
        Candidates, as nodes of the body.
    points : (n, dim)
        Where they are before loading.
    area : (n,)
        Area (in the plane, length) of the boundary that belongs to each.

    Raises
    ------
    ValueError
        If the boundary is unknown or out of reach, or as `ContactProblem`.
    """

    def __init__(
        self,
        elasticity: Any,
        system: Any,
        road: Any,
        boundary: str | Sequence[str],
        friction: FrictionLaw | float | None = None,
        reach: float | None = None,
    ):
        body = elasticity.body
        names = [boundary] if isinstance(boundary, str) else list(boundary)
        nodes = np.unique(np.concatenate([body.nodes(name) for name in names]))
        tied = np.bincount(system.node_of)[system.node_of[nodes]] > 1
        nodes = nodes[~tied]
        gap, normal, _ = road.closest(body.coordinates[nodes])
        near = np.full(nodes.size, True) if reach is None else gap <= reach
        if not near.any():
            raise ValueError(
                f"No node of {boundary!r} is within {reach} of the road, the nearest is {gap.min():g} away; "
                "give a larger reach or bring body and road together."
            )
        self.elasticity, self.system, self.road = elasticity, system, road
        self.nodes, self.points = nodes[near], body.coordinates[nodes[near]]
        self.area = sum(elasticity.boundary_mass(name).sum(axis=1) for name in names)[self.nodes]
        self.problem = ContactProblem(
            system.A,
            system.load,
            system.coordinates,
            system.node_of[self.nodes],
            normal[near],
            gap[near],
            friction,
            prolongations=system.prolongations,
        )

    def pressure(self, solution: Solution) -> np.ndarray:
        """Return the pressure (n,) at the candidates, lumped: nodal force over area (MPa).

        Warns
        -----
        BeyondLinear
            Where strains or rotations are beyond what linear strain is true to, with the numbers.
        """
        linear_limits(self.elasticity.gradient(self.displacement(solution)))
        return solution.pressure_force / self.area

    def traction(self, solution: Solution) -> np.ndarray:
        """Return the traction (n, dim) of the road on the body at the candidates, lumped (MPa)."""
        return solution.contact_force / self.area[:, None]

    def displacement(self, solution: Solution) -> np.ndarray:
        """Return the displacement of all nodes of the body, (nodes of the body, dim)."""
        return np.asarray(self.system.expand(solution.displacement))

    def fields(self, solution: Solution) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
        """Return the fields of nodes and of cells for `model.results.xdmf`.

        At the nodes displacement, contact_pressure, contact_traction, gap (distance to the road) and status
        (0 free, 1 slip, 2 stick); in the cells stress and von_mises.
        """
        body = self.elasticity.body
        u = self.displacement(solution)
        nodes = {
            "displacement": u,
            "contact_pressure": np.zeros(len(u)),
            "contact_traction": np.zeros(u.shape),
            "gap": self.road.closest(body.coordinates + u)[0],
            "status": np.zeros(len(u)),
        }
        at = self.nodes
        nodes["contact_pressure"][at] = self.pressure(solution)
        nodes["contact_traction"][at] = self.traction(solution)
        nodes["gap"][at], nodes["status"][at] = solution.gap, solution.status
        return nodes, {"stress": self.elasticity.stress(u), "von_mises": self.elasticity.von_mises(u)}

    def write(self, path: str | Path, solution: Solution) -> None:
        """Write the fields of one solution to NAME.xdmf and NAME.h5."""
        from model.results.xdmf import write_xdmf

        write_xdmf(path, self.elasticity.body, *self.fields(solution))
