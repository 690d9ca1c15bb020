"""Exchange of nodal values between the ranks that share a mesh."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from geometry.ends_together import end_together


class Exchange:
    """Values at the nodes one rank holds: those it owns, then copies of others' (its ghosts).

    Parameters
    ----------
    comm : MPI communicator
    shared : sequence of (rank, send (k,), receive (m,))
        For each neighbour the nodes owned here that it holds too, and those held here that it owns, in an
        order both agree on.
    owned : int
        Nodes 0, ..., owned - 1 are this rank's own.

    Examples
    --------
    >>> from mpi4py import MPI
    >>> alone = Exchange(MPI.COMM_SELF, [], owned=3)
    >>> alone.dot(np.ones((3, 2)), np.ones((3, 2)))
    6.0
    """

    def __init__(self, comm: Any, shared: Sequence[tuple[int, np.ndarray, np.ndarray]], owned: int):
        self.comm, self.shared, self.owned = comm, list(shared), owned
        if comm.size > 1:
            end_together(comm)

    def update(self, u: np.ndarray) -> None:
        """Give the ghosts in u (N, ...) the values of their owners; collective."""
        received = self._swap(
            [u[send] for _, send, _ in self.shared],
            [np.empty((receive.size, *u.shape[1:]), u.dtype) for _, _, receive in self.shared],
        )
        for (_, _, receive), values in zip(self.shared, received):
            u[receive] = values

    def add(self, r: np.ndarray) -> None:
        """Add to the owners' values in r (N, ...) those of all ghosts, and clear the ghosts; collective."""
        received = self._swap(
            [r[receive] for _, _, receive in self.shared],
            [np.empty((send.size, *r.shape[1:]), r.dtype) for _, send, _ in self.shared],
        )
        for (_, send, receive), values in zip(self.shared, received):
            r[send] += values
            r[receive] = 0

    def _swap(self, sends: list[np.ndarray], receives: list[np.ndarray]) -> list[np.ndarray]:
        """Send to and receive from each neighbour."""
        requests = [self.comm.Irecv(values, rank) for (rank, _, _), values in zip(self.shared, receives)]
        requests += [self.comm.Isend(values, rank) for (rank, _, _), values in zip(self.shared, sends)]
        for request in requests:
            request.Wait()
        return receives

    def among(self, nodes: np.ndarray) -> tuple[Exchange, np.ndarray]:
        """Return an exchange at some owned nodes (k,) alone, and their copies held here (m,); collective."""
        mark = np.zeros(self.owned + sum(receive.size for _, _, receive in self.shared), dtype=bool)
        mark[nodes] = True
        self.update(mark)
        shared = [(rank, send[mark[send]], receive[mark[receive]]) for rank, send, receive in self.shared]
        shared = [(rank, send, receive) for rank, send, receive in shared if send.size + receive.size]
        return Exchange(self.comm, shared, self.owned), self.owned + np.flatnonzero(mark[self.owned :])

    def sum(self, value: Any) -> Any:
        """Return the sum over all ranks of a number or an array of numbers; collective."""
        mine = np.array(value, order="C")
        total = np.empty_like(mine)
        self.comm.Allreduce(mine, total)
        return total if total.ndim else total.item()

    def max(self, value: float) -> float:
        """Return the largest value of all ranks; collective."""
        return float(self.comm.allreduce(value, op=max))

    def dot(self, x: np.ndarray, y: np.ndarray) -> float:
        """Return the inner product of x and y (N, d), each node counted once; collective."""
        return float(self.sum(float(np.vdot(x[: self.owned], y[: self.owned]))))

    def any(self, value: bool) -> bool:
        """Tell whether the value is true on any rank; collective."""
        return float(self.sum(float(value))) > 0.0

    def agree(self, trouble: str) -> None:
        """Raise a ValueError on every rank if any is in trouble; collective."""
        said = next((s for s in self.comm.allgather(trouble) if s), "")
        if said:
            error: Any = ValueError(said)
            error.everybody = True
            raise error

    def stacked(self, rows: np.ndarray) -> np.ndarray:
        """Return the rows (m, ...) of all ranks, one rank's after the other's; collective."""
        return np.concatenate(self.comm.allgather(rows))

    def before(self, count: int) -> int:
        """Return the sum of what the ranks before this one count; collective."""
        return sum(self.comm.allgather(count)[: self.comm.rank])

    def tall(self, rows: np.ndarray) -> np.ndarray:
        """Return rows (m, k) whose least squares problems are those of all ranks' rows; collective.

        By QR on each rank (J. Demmel, L. Grigori, M. Hoemmen, J. Langou, SIAM J. Sci. Comput. 34 (2012)).
        """
        return self.stacked(np.linalg.qr(rows, mode="r"))

    def first(self, value: Any) -> Any:
        """Return the value of the first rank; collective."""
        return self.comm.bcast(value)

    def own(self, values: np.ndarray) -> np.ndarray:
        """Return what of nodal values (N, ...) belongs to nodes of this rank."""
        return values[: self.owned]
