"""The discrete contact problem of which each rank holds some rows."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.sparse import bsr_array

from model.problem.contact_problem import ContactProblem


@dataclass(frozen=True)
class SharedProblem(ContactProblem):
    """As `ContactProblem`, of the nodes that one rank owns and those of others that it sees (ghosts).

    Parameters
    ----------
    A : sparse (N d, N d)
        Only the rows of the owned nodes count; they come first.
    b : (N, d)
        Likewise.
    contact_nodes : (n,)
        Candidates that this rank owns; none on some ranks, but not on all.
    prolongations : sequence of sparse
        Between the nodes held here, finest first.
    exchanges, ids : sequences
        Of each mesh, finest first: the exchange of values (`geometry.exchange.Exchange`), and the numbers
        (N,) of the nodes that all ranks agree on.

    Raises
    ------
    ValueError
        As for `ContactProblem`; on all ranks.
    """

    exchanges: Any = ()
    ids: Any = ()

    def __post_init__(self) -> None:
        """Check at the door, and tell every rank what is wrong on one."""
        ranks, trouble = self.exchanges[0], ""
        try:
            super().__post_init__()
            ends = np.minimum(self.A.indptr, self.A.indptr[ranks.owned])
            own = (self.A.data[: ends[-1]], self.A.indices[: ends[-1]], ends)
            object.__setattr__(self, "A", bsr_array(own, shape=self.A.shape))
        except ValueError as error:
            trouble = str(error)
        ranks.agree(trouble)
        if ranks.sum(self.contact_nodes.size) == 0:
            raise ValueError("No rank has a candidate, but a contact problem needs at least one.")
