"""Rigid modes of bodies that many ranks share, and whether the road can resist them."""

from itertools import product

import numpy as np
from scipy.sparse.csgraph import connected_components

from model.problem.rigid_modes import RigidModes, coupled, free_amplitudes, rigid_motions
from model.ranks.shared_problem import SharedProblem


class SampledModes(RigidModes):
    """Rigid modes at some nodes: the candidates come first, the others tell how the bodies move.

    Parameters
    ----------
    coordinates : (k, d)
    body : (k,)
        Which body each belongs to.
    modes : (k d, m)
        Of all nodes orthonormal, of these linearly independent.
    candidates : int
    """

    def __init__(self, coordinates: np.ndarray, body: np.ndarray, modes: np.ndarray, candidates: int):
        self.coordinates, self.nodes, self._body = coordinates, np.arange(candidates), body
        self.turning, self.modes, self.count = None, modes, modes.shape[1]

    def load_of(self, drive: np.ndarray) -> np.ndarray:
        """Return the least load (k, d) on these nodes that does the work (m,) on the modes."""
        load = self.modes @ np.linalg.lstsq(self.modes.T @ self.modes, drive)[0]
        return np.asarray(load.reshape(self.coordinates.shape))


class SharedRigidModes:
    """Rigid modes of a shared problem, of which the first rank asks whether the road balances a load.

    They are not carried apart from displacements, as `RigidModes` on one rank are: of such modes it has none.

    Parameters
    ----------
    problem : SharedProblem
    """

    count = 0

    def __init__(self, problem: SharedProblem):
        ranks, owned = problem.exchanges[0], problem.exchanges[0].owned
        self.ranks = ranks
        body = bodies(problem)
        self.modes = unheld_motions(problem, body)
        if self.modes.shape[2] == 0:
            return
        nodes, own = problem.contact_nodes, body[:owned]
        d = problem.coordinates.shape[1]
        sides = np.array([side for side in product((-1.0, 0.0, 1.0), repeat=d) if any(side)])
        members = [np.flatnonzero(own == number) for number in np.unique(own[own >= 0])]
        points = [problem.coordinates[here] for here in members]
        extremes = [here[[np.argmax(x @ side) for side in sides]] for here, x in zip(members, points)]
        candidates, others = (
            [ranks.stacked(x[chosen]) for x in (problem.coordinates, body, self.modes)]
            for chosen in (nodes, np.concatenate([nodes[:0], *extremes]))
        )
        coordinates, numbers, modes = (np.concatenate(x) for x in zip(candidates, others))
        modes = modes.reshape(-1, self.modes.shape[2])
        self.sampled = SampledModes(coordinates, numbers, modes, len(candidates[0]))

    def require_balance(self, b: np.ndarray, normal: np.ndarray, mu: np.ndarray, tolerance: float) -> None:
        """Refuse a load (owned, d) as `RigidModes.require_balance` does, mu (n,); collective."""
        if self.modes.shape[2] == 0:
            return
        ranks, trouble = self.ranks, ""
        drive = ranks.sum(np.einsum("nam,na->m", self.modes[: ranks.owned], b))
        load, size = self.sampled.load_of(drive), np.sqrt(ranks.dot(b, b))
        normal, mu, part = ranks.stacked(normal), ranks.stacked(mu), np.linalg.norm(load)
        if ranks.before(1) == 0 and part > 0.0:
            try:
                self.sampled.require_balance(load, normal, mu, tolerance * size / part)
            except ValueError as error:
                trouble = str(error)
        ranks.agree(trouble)

    def bears(self, b: np.ndarray, normal: np.ndarray, mu: np.ndarray, tolerance: float) -> bool:
        """Leave it to be found out."""
        return True

    def part_of(self, u: np.ndarray) -> np.ndarray:
        """Return what of a displacement is carried apart: nothing."""
        return np.zeros_like(u)

    def loose(self, frame: np.ndarray, status: np.ndarray, pressure: np.ndarray) -> np.ndarray:
        """Return no modes, whatever may be loose."""
        return np.zeros((0, 0))


def bodies(problem: SharedProblem) -> np.ndarray:
    """Number of the body that each node held here belongs to, (N,); -1 for one that stands alone; collective.

    A body has the least of its nodes' numbers: ranks ask for those of their copies until none falls.
    """
    exchange, N, A = problem.exchanges[0], len(problem.coordinates), problem.A
    label = connected_components(coupled(A), directed=False)[1]
    number = np.where(np.bincount(label)[label] == 1, -1, problem.ids[0]).astype(np.int64)
    exchange.update(number)
    falls = True
    while exchange.any(falls):
        least = np.full(N, np.iinfo(np.int64).max)
        np.minimum.at(least, label, number)
        falls = bool(np.any(least[label] < number))
        number = least[label]
        exchange.update(number)
    return number


def unheld_motions(problem: SharedProblem, body: np.ndarray) -> np.ndarray:
    """Rigid motions (N, d, m), orthonormal, that cost no energy, as those of one rank; collective."""
    ranks, d = problem.exchanges[0], problem.coordinates.shape[1]
    numbers = np.unique(ranks.stacked(np.unique(body[body >= 0])))
    motions = rigid_motions(problem.coordinates, ranks)
    if not np.all(body == numbers[:1]):
        motions = np.concatenate([motions * (body == k)[:, None, None] for k in numbers], axis=2)
    columns = motions.reshape(-1, motions.shape[2])
    own, diagonal = columns[: ranks.owned * d], problem.A.diagonal()[: ranks.owned * d]
    energy = ranks.sum(own.T @ (problem.A @ columns)[: len(own)])
    free = free_amplitudes(energy, ranks.sum(own.T @ (diagonal[:, None] * own)))
    gram = ranks.sum((own @ free).T @ (own @ free))
    return np.asarray(motions @ np.linalg.solve(np.linalg.cholesky(gram), free.T).T)
