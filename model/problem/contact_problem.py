"""The discrete contact problem.

What the forms and the geometry hand to the contact loop, and what can be saved for other solvers.
"""

import zlib
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np
from scipy.sparse import bsr_array, csr_array, issparse

from checks import finite_numbers, node_numbers
from model.atomic_file import write_aside
from model.node_loop.friction_laws import FrictionLaw, as_law
from model.tolerances import ON_ROAD

UNIT = 1e-9  # by how much a unit vector may be off: what a file of ten digits leaves
# What reading a damaged archive may end in.
DAMAGE: tuple[type[Exception], ...] = (ArithmeticError, AttributeError, BadZipFile, EOFError, LookupError)
DAMAGE += (MemoryError, OSError, RuntimeError, SyntaxError, TypeError, ValueError, zlib.error)


@dataclass(frozen=True)
class ContactProblem:
    """Find u with A u = b + contact forces, non-penetration and a friction law at every candidate node.

    Frozen: what varies from step to step is given to `ContactSolver.solve` and comes back in its Solution; a
    problem with other values is `dataclasses.replace(problem, gap=...)`.

    Units are the user's own, as long as they agree (N, mm and MPa, say). N nodes, n candidates, d = 2 or 3.

    Parameters
    ----------
    A : sparse (N d, N d)
        Symmetric matrix, K in statics; a prescribed unknown keeps a row and column with a single diagonal
        entry. Stored as `bsr_array`.
    b : (N, d) or (N d,)
        Nodal forces; diagonal entry times prescribed value at a prescribed unknown.
    coordinates : (N, d)
        Node positions, used for reports and to see which rigid motions are left to the contact.
    contact_nodes : (n,)
        Candidates, in any order, each once.
    normal : (n, d)
        Unit normals, from the road into the body.
    gap : (n,)
        Distance to the road along the normal at zero displacement, >= 0 (but see `interference`).
    friction : FrictionLaw, float, array (n,), callable of places, or None
        A law, Coulomb's coefficient, the same at all candidates or not, or None for a frictionless road; kept
        as FrictionLaw or None.
    interference : bool
        Take negative gaps for a body drawn into the road, as in a press fit, that is to be pushed out of it.
    tangential_reference : (n, d), optional
        Displacement at which a node sticks; only its tangential part counts. Default zero.
    turning : (N,), optional
        Of nodes that hold small angles of a rigid part, in the plane as their first component, the length by
        which these are multiplied; 0 at others. Tells which motions are rigid.
    prolongations : sequence of sparse, optional
        Nested meshes, finest first: prolongations[0] is (N, N_1), [1] is (N_1, N_2). Needed by geometric
        multigrid only.

    Raises
    ------
    ValueError
        If shapes do not agree, a value is not finite, normals are not unit vectors, there are no candidates,
        or a candidate starts below the road.

    Examples
    --------
    >>> import numpy as np
    >>> from scipy.sparse import eye_array
    >>> from model import ContactProblem, ContactSolver
    >>> problem = ContactProblem(  # two nodes on springs of 100 N/mm, 0.1 and 0.3 mm above a road
    ...     A=100.0 * eye_array(4),
    ...     b=np.array([[0.0, -20.0], [3.0, -40.0]]),
    ...     coordinates=np.array([[0.0, 0.1], [1.0, 0.3]]),
    ...     contact_nodes=np.array([0, 1]),
    ...     normal=np.array([[0.0, 1.0], [0.0, 1.0]]),
    ...     gap=np.array([0.1, 0.3]),
    ...     friction=0.5,
    ... )
    >>> solution = ContactSolver(problem).solve()
    >>> solution.pressure_force  # 20 - 100 x 0.1 and 40 - 100 x 0.3
    array([10., 10.])
    """

    A: Any
    b: np.ndarray
    coordinates: np.ndarray
    contact_nodes: np.ndarray
    normal: np.ndarray
    gap: np.ndarray
    friction: Any = None
    tangential_reference: np.ndarray | None = None
    prolongations: Any = ()
    interference: bool = False
    turning: np.ndarray | None = None
    dim: int = field(init=False)
    exchanges = ()  # many ranks share a `SharedProblem` only

    def __post_init__(self) -> None:
        """Check at the door, so that the loop need not."""
        put = partial(object.__setattr__, self)  # the last to change anything
        put("coordinates", finite_numbers("coordinates", np.atleast_2d(self.coordinates)))
        N, d = self.coordinates.shape
        put("dim", d)
        if d not in (2, 3):
            raise ValueError(f"coordinates has {d} columns, but bodies have 2 or 3 dimensions.")
        if not issparse(self.A) or self.A.shape != (N * d, N * d):
            raise ValueError(
                f"A must be a sparse ({N * d}, {N * d}) matrix for {N} nodes in {d}-D, "
                f"but is {_describe(self.A)}."
            )
        put("A", bsr_array(self.A, blocksize=(d, d)))
        self.A.sort_indices()
        finite_numbers("A", self.A.data)
        put("b", shaped("b", self.b, (N, d)))
        put("contact_nodes", _different_nodes(self.contact_nodes, N))
        n = self.contact_nodes.size
        if n == 0 and not self.exchanges:
            raise ValueError(
                "contact_nodes is empty, but a contact problem needs at least one candidate node."
            )
        put("normal", shaped("normal", self.normal, (n, d)))
        lengths = np.linalg.norm(self.normal, axis=1)
        wrong = lengths[np.abs(lengths - 1.0) > UNIT]
        if wrong.size:
            raise ValueError(f"normal must hold unit vectors, but one has length {wrong[0]:g}.")
        put("gap", self.checked_gap(self.gap))
        put("friction", as_law(self.friction))
        if self.friction is not None and not self.friction.by_place:
            self.friction.nodes(np.zeros(n))  # refuses what does not fit
        reference = np.zeros((n, d)) if self.tangential_reference is None else self.tangential_reference
        put("tangential_reference", shaped("tangential_reference", reference, (n, d)))
        put("prolongations", _nested(self.prolongations, N))

    @property
    def friction_coefficient(self) -> Any:
        """Coefficient of friction at rest, one or (n,) as it is before loading; 0 without friction."""
        if not isinstance(self.friction, FrictionLaw):
            return 0.0
        mu = self.friction.coefficient
        if not callable(mu):
            return mu
        foot = self.coordinates[self.contact_nodes] - self.gap[:, None] * self.normal
        return self.friction.nodes(np.zeros(len(foot)), foot)[:, 1]

    def checked_gap(self, gap: np.ndarray) -> np.ndarray:
        """Return `gap` (n,) with rounding errors below zero cut off.

        Refuse nodes that truly start below the road.

        Raises
        ------
        ValueError
            If a gap is not finite, or negative by more than rounding.
        """
        gap = shaped("gap", gap, (self.contact_nodes.size,))
        rounding = ON_ROAD * length_scale(self.coordinates)
        if self.interference:
            return np.where(np.abs(gap) < rounding, 0.0, gap)
        if gap.min(initial=0.0) < -rounding:
            node = self.contact_nodes[np.argmin(gap)]
            name = f"The node at {self.coordinates[node]}" if self.exchanges else f"Node {node}"
            raise ValueError(
                f"{name} starts {-gap.min():g} below the road; "
                "move the body or the road so that every gap is >= 0, or say interference=True if it shall "
                "be pushed out, as in a press fit."
            )
        return np.maximum(gap, 0.0)

    def save(self, path: str | Path, solution: Any = None) -> None:
        """Write the problem, and the solution if given, to one `.npz` file that any other solver can read.

        Keys: indptr, indices, data (scalar CSR of A, unknowns interleaved), load, coordinates, contact_nodes,
        normal, gap, friction_coefficient, tangential_reference, and with a solution displacement (N, d) and
        contact_force (n, d).

        Parameters
        ----------
        path : str or Path
            The file, replaced only when the new one is whole.
        solution : Solution, optional
            What `solve` returned.
        """
        A = self.A.tocsr()
        arrays = {
            "indptr": A.indptr,
            "indices": A.indices,
            "data": A.data,
            "load": self.b.ravel(),
            "coordinates": self.coordinates,
            "contact_nodes": self.contact_nodes,
            "normal": self.normal,
            "gap": self.gap,
            "friction_coefficient": np.asarray(self.friction_coefficient, dtype=np.float64),
            "tangential_reference": self.tangential_reference,
        }
        if solution is not None:
            arrays |= {"displacement": solution.displacement, "contact_force": solution.contact_force}
        with write_aside(path) as aside, open(aside, "wb") as file:
            np.savez_compressed(file, **arrays)

    @classmethod
    def load(cls, path: str | Path) -> "ContactProblem":
        """Read what `save` wrote; the friction law is Coulomb's, and nothing in the file is executed.

        Raises
        ------
        ValueError
            If the file is not a problem saved by `save`.
        FileNotFoundError
            If there is no such file.
        """
        try:
            with np.load(path, allow_pickle=False) as file:
                A = csr_array((file["data"], file["indices"], file["indptr"]))
                mu = file["friction_coefficient"]
                names = ("coordinates", "contact_nodes", "normal", "gap", "tangential_reference")
                arrays = {"b": file["load"]} | {name: file[name] for name in names}
        except FileNotFoundError:
            raise
        except DAMAGE as error:
            raise ValueError(
                f"{path} is not a contact problem saved by ContactProblem.save: {error}."
            ) from None
        into = bool(np.any(arrays["gap"] < 0))
        return cls(A=A, friction=mu if np.any(mu > 0.0) else None, interference=into, **arrays)


def length_scale(coordinates: np.ndarray) -> float:
    """Return a length that rounding errors of positions (N, d) can be measured by."""
    if not coordinates.size:  # those of a rank that has none
        return 0.0
    return float(np.abs(coordinates).max() + max(np.ptp(x) for x in coordinates.T))


def _different_nodes(nodes: Any, N: int) -> np.ndarray:
    """Return the numbers of some of N nodes, (n,), or refuse them."""
    nodes = node_numbers(nodes)
    if nodes.min(initial=0) < 0 or nodes.max(initial=-1) >= N or np.unique(nodes).size < nodes.size:
        raise ValueError(f"contact_nodes must name different nodes from 0 to {N - 1}, each once.")
    return nodes


def _nested(prolongations: Any, N: int) -> tuple[csr_array, ...]:
    """Return prolongations between meshes of which the finest has N nodes, or refuse them."""
    matrices = tuple(csr_array(P) for P in prolongations)
    for level, (P, rows) in enumerate(zip(matrices, [N, *(P.shape[1] for P in matrices)])):
        if P.shape[0] != rows:
            raise ValueError(
                f"prolongations[{level}] has {P.shape[0]} rows, but the finer mesh has {rows} nodes."
            )
    return matrices


def _describe(A: Any) -> str:
    return f"a {type(A).__name__} of shape {getattr(A, 'shape', None)}"


def shaped(name: str, values: Any, shape: tuple[int, ...]) -> np.ndarray:
    """Return the values, in that shape or flat, as finite numbers in that shape, or refuse them."""
    values = finite_numbers(name, values)
    turned = min(values.ndim, len(shape)) > 1 and values.shape != shape
    if turned or values.size != np.prod(shape):
        raise ValueError(f"{name} has shape {values.shape}, but {shape} is needed.")
    return values.reshape(shape)
