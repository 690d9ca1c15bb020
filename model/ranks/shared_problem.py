"""The discrete contact problem of which each rank holds some rows."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.sparse import bsr_array

from model.node_loop.friction_laws import as_law
from model.problem.contact_problem import length_scale, shaped


@dataclass(frozen=True)
class SharedProblem:
    """As `ContactProblem`, of the nodes that one rank owns and those of others that it sees (ghosts).

    Parameters
    ----------
    A : sparse (N d, N d)
        Only the rows of the owned nodes count; they come first.
    b : (N, d)
        Likewise.
    coordinates : (N, d)
    contact_nodes : (n,)
        Candidates that this rank owns; none on some ranks, but not on all.
    normal, gap, friction, interference
        As for `ContactProblem`.
    prolongations : sequence of sparse
        Between the nodes held here, finest first.
    exchanges, ids : sequences
        Of each mesh, finest first: the exchange of values (`geometry.exchange.Exchange`), and the numbers
        (N,) of the nodes that all ranks agree on.

    Raises
    ------
    ValueError
        If a candidate starts below the road, values are not finite, or shapes do not agree; on all ranks.
    """

    A: Any
    b: np.ndarray
    coordinates: np.ndarray
    contact_nodes: np.ndarray
    normal: np.ndarray
    gap: np.ndarray
    friction: Any
    prolongations: Any
    exchanges: Any
    ids: Any
    interference: bool = False

    def __post_init__(self) -> None:
        """Check at the door, and tell every rank what is wrong on one."""
        exchange, (N, d), n = self.exchanges[0], self.coordinates.shape, self.contact_nodes.size
        trouble = ""
        try:
            A, rows = bsr_array(self.A, blocksize=(d, d)), exchange.owned
            whole, count = A.indptr[: rows + 1], A.indptr[rows]
            A = bsr_array((A.data[:count], A.indices[:count], whole), shape=(rows * d, A.shape[1]))
            A.sort_indices()
            object.__setattr__(self, "A", A)
            object.__setattr__(self, "b", shaped("b", self.b, (N, d))[: exchange.owned])
            object.__setattr__(self, "normal", shaped("normal", self.normal, (n, d)))
            object.__setattr__(self, "gap", self.checked_gap(self.gap))
            object.__setattr__(self, "friction", as_law(self.friction))
        except ValueError as error:
            trouble = str(error)
        exchange.agree(trouble)
        if exchange.sum(n) == 0:
            raise ValueError("No rank has a candidate, but a contact problem needs at least one.")

    @property
    def tangential_reference(self) -> np.ndarray:
        """Displacement (n, d) at which nodes stick at first: none."""
        return np.zeros(self.normal.shape)

    def checked_gap(self, gap: np.ndarray) -> np.ndarray:
        """Return `gap` (n,) with rounding errors below zero cut off, or refuse it (ValueError)."""
        gap = shaped("gap", gap, (self.contact_nodes.size,))
        if self.interference:
            return np.where(np.abs(gap) < 1e-12 * length_scale(self.coordinates), 0.0, gap)
        if gap.size and gap.min() < -1e-12 * length_scale(self.coordinates):
            where = self.coordinates[self.contact_nodes[np.argmin(gap)]]
            raise ValueError(
                f"The node at {where} starts {-gap.min():g} below the road; "
                "move the body or the road so that every gap is >= 0, or say interference=True if it shall "
                "be pushed out, as in a press fit."
            )
        return np.maximum(gap, 0.0)
