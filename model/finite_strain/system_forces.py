"""A body of finite strain on its supports: energy, forces and tangents at the system's nodes."""

from typing import Any

import numpy as np
from scipy.sparse import bsr_array, csr_array, diags_array


class SystemForces:
    """Energy, forces and tangents of a body, its platens being one node each and prescribed unknowns still.

    Parameters
    ----------
    elastic : forms.Hyperelasticity
        Of the body, N nodes in d dimensions.
    node_of : (N,) or None
        Node of the system (of R nodes) that each node of the body has become; None for the node itself.
    prescribed : (R, d)
        Which unknowns are prescribed.
    """

    def __init__(self, elastic: Any, node_of: np.ndarray | None, prescribed: np.ndarray):
        self.elastic, self.prescribed = elastic, prescribed
        R, d = prescribed.shape
        self.node_of = None if node_of is None or np.array_equal(node_of, np.arange(R)) else node_of
        self._tie: Any = None
        if self.node_of is not None:
            rows = (np.arange(self.node_of.size)[:, None] * d + np.arange(d)).ravel()
            columns = (self.node_of[:, None] * d + np.arange(d)).ravel()
            self._tie = csr_array((np.ones(rows.size), (rows, columns)), shape=(rows.size, R * d))
        self._free = diags_array(np.where(prescribed.ravel(), 0.0, 1.0)) if prescribed.any() else None

    def expand(self, u: np.ndarray) -> np.ndarray:
        """Return what a field (R, d) is at the body's nodes, (N, d)."""
        return u if self.node_of is None else u[self.node_of]

    def reduce(self, force: np.ndarray) -> np.ndarray:
        """Return what forces (N, d) on the body are on the system, (R, d)."""
        if self._tie is None:
            return force
        return (self._tie.T @ force.ravel()).reshape(self.prescribed.shape)

    def strain_energy(self, u: np.ndarray) -> float:
        """Return the elastic energy at displacement u (R, d)."""
        return float(self.elastic.strain_energy(self.expand(u)))

    def internal_force(self, u: np.ndarray) -> np.ndarray:
        """Return the forces (R, d) that hold u (R, d); at prescribed unknowns those of the supports."""
        return self.reduce(self.elastic.internal_force(self.expand(u)))

    def step_force(self, before: np.ndarray, after: np.ndarray) -> np.ndarray:
        """Return the mean internal force (R, d) of a step."""
        return self.reduce(self.elastic.step_force(self.expand(before), self.expand(after)))

    def rate_force(self, before: np.ndarray, after: np.ndarray) -> np.ndarray:
        """Return the forces (R, d) of the stress C1 - C0 in a step."""
        return self.reduce(self.elastic.rate_force(self.expand(before), self.expand(after)))

    def tangent(self, u: np.ndarray, held: bool = True) -> Any:
        """Return the tangent (R d, R d); `held` leaves prescribed unknowns a lone diagonal entry each."""
        return self._reduced(self.elastic.tangent(self.expand(u)), held)

    def step_tangent(self, before: np.ndarray, after: np.ndarray) -> Any:
        """Return the symmetric part of the tangent of a step (R d, R d)."""
        K = self._reduced(self.elastic.step_tangent(self.expand(before), self.expand(after)), True)
        return bsr_array(0.5 * (K + K.T), blocksize=K.blocksize)

    def stretches(self, u: np.ndarray) -> np.ndarray:
        """Return the mean deformation gradient around each node, (R, d, d), at displacement u (R, d)."""
        F = self.elastic.stretches_at_nodes(self.expand(u))
        if self.node_of is None:
            return np.asarray(F)
        d = F.shape[-1]
        count = np.bincount(self.node_of, minlength=len(self.prescribed))
        total = np.stack(
            [np.bincount(self.node_of, x, minlength=count.size) for x in F.reshape(-1, d * d).T], axis=-1
        )
        return np.asarray((total / np.maximum(count, 1)[:, None]).reshape(-1, d, d))

    def volume_ratio(self, u: np.ndarray) -> float:
        """Return the smallest det F at displacement u (R, d)."""
        return float(self.elastic.volume_ratio(self.expand(u)))

    def check_volume(self, u: np.ndarray, what: str) -> None:
        """Raise ValueError, with the remedy, if a cell is turned inside out at displacement u (R, d)."""
        self.elastic.check_volume(self.expand(u), what)

    def _reduced(self, K: Any, held: bool) -> Any:
        d = self.prescribed.shape[1]
        if self._tie is not None:
            K = bsr_array(self._tie.T @ K.tocsr() @ self._tie, blocksize=(d, d))
        return self.hold(K) if held else K

    def hold(self, K: Any) -> Any:
        """Leave prescribed unknowns a lone diagonal entry > 0 each in K (R d, R d)."""
        if self._free is None:
            return K
        diagonal = np.where(self.prescribed.ravel(), np.abs(K.diagonal()).max(), 0.0)
        return bsr_array(self._free @ K @ self._free + diags_array(diagonal), blocksize=K.blocksize)
