"""A string under tension above a road: its matrix, its load, the closed form, and its files."""

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy import sparse

from geometry import Plane
from model import ContactProblem, write_road, write_xdmf


class String(NamedTuple):
    """A string of n nodes, held at both ends.

    Attributes
    ----------
    K : (n, n)
        Stiffness (N/m).
    b, lower : (n,)
        Load (N), and displacement on the road (m).
    x, exact : (n,)
        Places along the string, and the displacement in closed form (m).
    """

    K: np.ndarray
    b: np.ndarray
    lower: np.ndarray
    x: np.ndarray
    exact: np.ndarray


def string(n: int, T: float = 1.0, q: float = 2.0, d: float = 0.2, L: float = 2.0) -> String:
    """Set up a string of n nodes under tension T (N) and load q (N/m), d above a road, L long (m).

    A string that is not pressed is a parabola, which comes down on the road without a kink.

    >>> string(3).K[0].tolist()
    [4.0, -2.0, 0.0]
    """
    h = L / (n + 1)
    x = h * np.arange(1, n + 1)
    K = (T / h) * (2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))
    down = np.maximum(np.sqrt(2 * T * d / q) - np.minimum(x, L - x), 0.0)
    return String(K, np.full(n, -q * h), np.full(n, -d), x, -d + q / (2 * T) * down**2)


def contact_problem(cord: String, prolongations: Any = ()) -> ContactProblem:
    """Give every node of a string a second unknown, along the road, that a single diagonal entry holds.

    >>> from model import solve
    >>> cord = string(3, d=0.5)
    >>> bool(np.allclose(solve(contact_problem(cord)).displacement[:, 1], [-0.5, -0.5, -0.5]))
    True
    """
    n, aside, up = len(cord.b), np.array([1.0, 0.0]), np.array([0.0, 1.0])
    A = sparse.csr_array(np.kron(cord.K, np.diag(up)) + np.kron(np.eye(n), np.diag(aside)))
    load, places, normals = np.outer(cord.b, up), np.outer(cord.x, aside), np.tile(up, (n, 1))
    return ContactProblem(A, load, places, np.arange(n), normals, -cord.lower, prolongations=prolongations)


def write_string(path: Path, cord: String, solution: Any) -> None:
    """Write a string's displacement, contact_pressure (N/m), gap and status, and its road, for ParaView."""
    h = cord.x[0]
    write_line(path, cord.x, solution, solution.pressure_force / h, cord.lower[0], (0.0, cord.x[-1] + h))


def write_line(
    path: Path,
    x: np.ndarray,
    solution: Any,
    pressure: np.ndarray,
    road: float = 0.0,
    ends: tuple[float, ...] = (),
) -> None:
    """Write a chain of nodes at (x, 0) and the plane road below it, with fields as those of bodies.

    Parameters
    ----------
    path : Path
        NAME.xdmf; the road goes to NAME_road.xdmf.
    x : (n,)
        In rising order.
    solution : Solution
        Of all n nodes, each of which may touch.
    pressure : (n,)
        Force of the road over the length of a node.
    road : float
        Height of the road.
    ends : sequence of float
        Places of held nodes that the solution does not have.
    """
    from model.results.xdmf import FacetMesh

    held = np.zeros((len(ends), 2))
    places = np.concatenate([np.stack([x, 0 * x], axis=1), held])
    places[len(x) :, 0] = ends
    order = np.argsort(places[:, 0], kind="stable")
    mesh = FacetMesh(places, np.stack([order[:-1], order[1:]], axis=1))
    u = np.concatenate([solution.displacement, held])
    fields = {
        "displacement": u,
        "contact_pressure": np.append(pressure, np.zeros(len(ends))),
        "contact_force": np.concatenate([solution.contact_force, held]),
        "gap": np.append(solution.gap, np.full(len(ends), -road)),
        "status": np.append(solution.status, np.zeros(len(ends))),
    }
    write_xdmf(path, mesh, {name: values[mesh.order] for name, values in fields.items()})
    write_road(path.with_name(f"{path.stem}_road.xdmf"), Plane((0.0, road), (0.0, 1.0)), places + u)
