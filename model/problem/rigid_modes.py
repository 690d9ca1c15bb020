"""Rigid motions: which of them nothing but the contact resists, and whether the contact can."""

import numpy as np
from scipy.optimize import nnls
from scipy.sparse import bsr_array, csr_array
from scipy.sparse.csgraph import connected_components

from model.node_loop.contact_sweep import frames


def rigid_motions(coordinates: np.ndarray) -> np.ndarray:
    """Translations and small rotations about the centre, scaled to the body's size.

    (N, d, 3) in 2-D, (N, d, 6) in 3-D.
    """
    N, d = coordinates.shape
    x = coordinates - coordinates.mean(axis=0)
    x = x / (np.abs(x).max() or 1.0)
    pairs = [(0, 1)] if d == 2 else [(0, 1), (1, 2), (2, 0)]
    motions = np.zeros((N, d, d + len(pairs)))
    for a in range(d):
        motions[:, a, a] = 1.0
    for k, (a, b) in enumerate(pairs):
        motions[:, a, d + k] = -x[:, b]
        motions[:, b, d + k] = x[:, a]
    return motions


def bodies(A: bsr_array) -> np.ndarray:
    """Tell which of the bodies that A holds each node belongs to, (N,); -1 for a node that stands alone."""
    N = A.indptr.size - 1
    graph = csr_array((np.ones(A.indices.size, dtype=np.int8), A.indices, A.indptr), shape=(N, N))
    _, label = connected_components(graph, directed=False)
    label[np.bincount(label)[label] == 1] = -1
    return np.unique(label, return_inverse=True)[1] - int(label.min() < 0)


def motions_of_each_body(coordinates: np.ndarray, body: np.ndarray) -> np.ndarray:
    """Rigid motions of every body by itself, as columns (N d, 3 or 6 a body)."""
    N, d = coordinates.shape
    columns = [np.zeros((N * d, 0))]
    for here in _each(body):
        motions = np.zeros((N, d, 3 * d - 3))
        motions[here] = rigid_motions(coordinates[here])
        columns.append(motions.reshape(N * d, -1))
    return np.hstack(columns)


def _each(body: np.ndarray) -> list[np.ndarray]:
    """Masks (k,) of the members of each body that has any."""
    return [body == number for number in np.unique(body[body >= 0])]


def unheld_motions(A: bsr_array, coordinates: np.ndarray, body: np.ndarray) -> np.ndarray:
    """Rigid motions of the bodies (N,) that cost no energy in A, columns (N d, m) with m <= 3 or 6 a body.

    A motion counts as free where its energy is below 1e-13 of what it would cost if every node moved alone:
    above rounding, and below any real support, which resists at least at one node.
    """
    motions = motions_of_each_body(coordinates, body)
    energy = motions.T @ (A @ motions)
    scale = motions.T @ (A.diagonal()[:, None] * motions)
    lower = np.linalg.cholesky(scale + 1e-300 * np.eye(scale.shape[0]))
    inner = np.linalg.solve(lower, np.linalg.solve(lower, energy).T)
    values, vectors = np.linalg.eigh(0.5 * (inner + inner.T))
    return motions @ np.linalg.solve(lower.T, vectors[:, values < 1e-13])


class Hold:
    """What holds a body against its loads: the road, where A alone does not.

    Every rigid motion r with A r = 0 must be balanced by forces of the road, sum f_i . r_i = -b . r, with f_i
    in the friction cones. (In 3-D the cones are replaced by pyramids of eight edges around them: a load just
    outside the cones is left for the solver to find out.)

    Parameters
    ----------
    A : bsr_array (N d, N d)
    coordinates : (N, d)
    nodes : (n,)
        Candidates.
    normal : (n, d)
    mu : float
        Coefficient of friction.

    Attributes
    ----------
    motions : (N d, m)
        Rigid motions that A does not resist.

    Raises
    ------
    ValueError
        Saying which motion nothing resists.
    """

    def __init__(
        self, A: bsr_array, coordinates: np.ndarray, nodes: np.ndarray, normal: np.ndarray, mu: float
    ):
        body = bodies(A)
        self.motions, self._count = unheld_motions(A, coordinates, body), nodes.size
        if self.motions.shape[1] == 0:
            return
        d = coordinates.shape[1]
        motions = self.motions = np.linalg.qr(self.motions)[0]
        at_nodes = motions.reshape(-1, d, motions.shape[1])[nodes]
        self._powers = np.einsum("ecd,cdm->mec", _cone_edges(normal, mu), at_nodes).reshape(
            motions.shape[1], -1
        )
        directions, sizes, _ = np.linalg.svd(self._powers)
        resisted = int(np.sum(sizes > 1e-10 * sizes.max(initial=1e-300)))
        if resisted < motions.shape[1]:
            motion = (motions @ directions[:, resisted]).reshape(-1, d)
            raise ValueError(
                f"Neither supports nor the road resist {_in_words(motion)}; "
                "fix the body against it or give the road friction."
            )
        self._spread = np.concatenate(
            [
                here[spread_candidates(coordinates[nodes[here]], d)]
                for here in map(np.flatnonzero, _each(body[nodes]))
            ]
        )

    def nodes(self, b: np.ndarray) -> np.ndarray:
        """Find candidates that can hold the body against its load b (N, d).

        Returns
        -------
        (k,) numbers of a few candidates, far apart, that balance the load; none where A holds the body.

        Raises
        ------
        ValueError
            If nothing can hold the body against this load.
        """
        if self.motions.shape[1] == 0:
            return np.zeros(0, dtype=np.int64)
        wanted = -(self.motions.T @ b.ravel())
        if not np.any(wanted):
            return self._spread
        forces, missing = nnls(
            self._powers, wanted / np.linalg.norm(wanted), maxiter=100 * self._powers.shape[1]
        )
        if missing > 1e-7:
            motion = (self.motions @ -wanted).reshape(b.shape)
            raise ValueError(
                f"The load drives the body into {_in_words(motion)} that neither supports nor the road can "
                "stop; load it towards the road or fix it."
            )
        return np.union1d(self._spread, np.flatnonzero(forces.reshape(-1, self._count).any(axis=0)))


def nodes_that_hold(
    A: bsr_array, b: np.ndarray, coordinates: np.ndarray, nodes: np.ndarray, normal: np.ndarray, mu: float
) -> np.ndarray:
    """Find candidates that can hold the body against its load, as `Hold` does."""
    return Hold(A, coordinates, nodes, normal, mu).nodes(b)


def _cone_edges(normal: np.ndarray, mu: float) -> np.ndarray:
    """Edges (e, n, d) of the friction cones."""
    frame = frames(normal)
    if mu == 0.0:
        return frame[None, :, 0]
    if normal.shape[1] == 2:
        tangents = [frame[:, 1], -frame[:, 1]]
    else:
        angles = np.arange(8) * np.pi / 4
        outside = 1.0 / np.cos(np.pi / 8)
        tangents = [outside * (np.cos(t) * frame[:, 1] + np.sin(t) * frame[:, 2]) for t in angles]
    return np.stack([frame[:, 0] + mu * tangent for tangent in tangents])


def _in_words(motion: np.ndarray) -> str:
    """Say what a rigid motion (N, d) mostly is."""
    mean = motion.mean(axis=0)
    if np.linalg.norm(mean) > 0.5 * np.sqrt(np.mean(np.sum(motion**2, axis=1))):
        return "a translation along (" + ", ".join(f"{x:.3g}" for x in mean / np.linalg.norm(mean)) + ")"
    return "a rotation"


def spread_candidates(points: np.ndarray, count: int) -> np.ndarray:
    """Numbers of `count` of the points (n, d), far from each other; fewer where there are fewer points."""
    distance = np.linalg.norm(points - points.mean(axis=0), axis=1)
    chosen: list[int] = []
    while len(chosen) < min(count, points.shape[0]):
        chosen.append(int(np.argmax(distance)))
        away = np.linalg.norm(points - points[chosen[-1]], axis=1)
        distance = away if len(chosen) == 1 else np.minimum(distance, away)
    return np.unique(chosen)
