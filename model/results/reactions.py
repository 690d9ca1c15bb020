"""What holds a body: reactions of supports and platens, and the sheet in which all forces balance."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from checks import vector
from model.one_rank import ONE_RANK

CLOSED = 1e-6  # of the largest force, far above any tolerance: beyond it the load is not the solution's


@dataclass
class Balance:
    """All forces on a body and their moments about a point, by kind; their sum is zero.

    The kinds are "loads", "reactions" (of prescribed displacements and platens), "contact", "ground" (springs
    and Robin terms) and, in motion, "damping" and "inertia".

    Attributes
    ----------
    about : (d,)
        The point.
    force : {kind: (d,)}
    moment : {kind: (1,) in the plane, (3,) in space}
    nodes : (h,)
        Nodes of the space that supports or platens hold.
    nodal : (h, d)
        Their force on each.
    points : (h, d)
        Where they are before loading; as strain is linear, moments are of forces there.
    ranks : OneRank or geometry.exchange.Exchange
        Who shares the body: nodes are then those of this rank, sums those of all.

    Examples
    --------
    >>> from forms import Elasticity, Isotropic, Support
    >>> from geometry import Body, Plane, rectangle
    >>> from model import BodyOnRoad, solve
    >>> elasticity = Elasticity(Body.from_grid(rectangle(2.0, 1.0, 4, 2)), Isotropic(E=1e3, nu=0.0))
    >>> support = Support(elasticity.body).fix("top", x=0.0, y=-0.01)
    >>> system = elasticity.system(elasticity.body_force((0.0, 0.0)), support)
    >>> contact = BodyOnRoad(system, "bottom", Plane())
    >>> sheet = contact.reactions(solve(contact))
    >>> float(sheet.force["contact"][1].round(9)), float(sheet.force["reactions"][1].round(9))
    (20.0, -20.0)
    """

    about: np.ndarray
    force: dict[str, np.ndarray]
    moment: dict[str, np.ndarray]
    nodes: np.ndarray
    nodal: np.ndarray
    points: np.ndarray
    ranks: Any = field(default=ONE_RANK, repr=False)

    @property
    def remainder(self) -> float:
        """Sum of all forces over the largest of them: zero but for rounding and the solver's tolerance."""
        largest = max(np.abs(force).max() for force in self.force.values())
        return float(np.abs(sum(self.force.values())).max() / (largest or 1.0))

    def at(self, nodes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the force (d,) and the moment about the point of the supports at some nodes of the space.

        Parameters
        ----------
        nodes : array of int
            Say, `body.nodes("top")`; those that nothing holds count for nothing.
        """
        here = np.isin(self.nodes, nodes)
        turn = moment(self.points[here] - self.about, self.nodal[here])
        return self.ranks.sum(self.nodal[here].sum(axis=0)), self.ranks.sum(turn)

    def __str__(self) -> str:
        """Return the sheet as a table, a line a kind."""
        total = {"sum": (sum(self.force.values()), sum(self.moment.values()))}
        lines = {kind: (self.force[kind], self.moment[kind]) for kind in self.force} | total
        rows = [f"{'':>10} force, and moment about {tuple(self.about.tolist())}"]
        for kind, (force, turn) in lines.items():
            values = np.concatenate([force, turn]).tolist()
            rows.append(f"{kind:>10} " + " ".join(f"{value:13.6g}" for value in values))
        return "\n".join(rows)


def moment(arm: np.ndarray, force: np.ndarray) -> np.ndarray:
    """Return the sum of the moments, (1,) or (3,), of forces (n, d) at the ends of arms (n, d).

    Examples
    --------
    >>> moment(np.array([[2.0, 0.0]]), np.array([[0.0, 3.0]]))
    array([6.])
    """
    return np.atleast_1d(np.cross(_in_space(arm), _in_space(force)).sum(axis=0)[2 * (arm.shape[1] == 2) :])


def _in_space(vectors: np.ndarray) -> np.ndarray:
    return np.pad(vectors, ((0, 0), (0, 3 - vectors.shape[1])))


def balance(contact: Any, solution: Any, about: Any = None, load: np.ndarray | None = None) -> Balance:
    """Return the sheet of a solution or a state of motion of a BodyOnRoad; see `BodyOnRoad.reactions`."""
    system, dim = contact.system, contact.points.shape[1]
    about = np.zeros(dim) if about is None else vector("about", about, dim)
    if system.elastic is not None:
        raise ValueError("The sheet of forces is there for linear strain only.")
    loads = system.nodal_load(getattr(solution, "time", None), load)
    sharing = system.sharing
    ranks = ONE_RANK if sharing is None else sharing.exchange
    motion = {"A": system.whole(solution.displacement)}
    for name, rate in (("C", "velocity"), ("M", "acceleration")):
        if hasattr(solution, rate) and getattr(system, name) is not None:
            motion[name] = system.whole(getattr(solution, rate))
    touching = np.zeros(loads.shape)
    touching[contact.nodes] = solution.contact_force
    nodes, nodal = system.reactions(motion, loads + touching)
    held = np.zeros(loads.shape)
    held[nodes] = nodal
    own = slice(None) if sharing is None else sharing.own
    arm = (system.points - about)[own]
    sheet = {"loads": loads[own], "reactions": held[own], "contact": touching[own]}
    force = {kind: ranks.sum(values.sum(axis=0)) for kind, values in sheet.items()}
    turn = {kind: ranks.sum(moment(arm, values)) for kind, values in sheet.items()}
    for name, kind in {"A": "ground", "C": "damping", "M": "inertia"}.items():
        if name in motion:
            whole = -ranks.sum(system.resultant(name, motion[name], about))
            force[kind], turn[kind] = whole[:dim], whole[dim:]
    found = Balance(about, force, turn, nodes, nodal, system.points[nodes], ranks)
    if not hasattr(solution, "mean_force") and found.remainder > max(CLOSED, 100 * solution.residual):
        raise ValueError(
            f"The forces do not balance by {found.remainder:.1g} of the largest, as if the load had been "
            "another one; give the nodal forces of this solution as load=..., or solve by time."
        )
    return found
