"""Rigid modes: motions that A does not resist, and whether the road can."""

from copy import copy
from functools import lru_cache
from typing import Any

import numpy as np
from numba import njit
from scipy.linalg import qr
from scipy.sparse import bsr_array, csr_array
from scipy.sparse.csgraph import connected_components

from model.node_loop.block_arithmetic import add_scaled
from model.node_loop.blocks import FUSED, block_matrix, flat
from model.node_loop.contact_sweep import frames
from model.node_loop.node_loop import along_road
from model.node_loop.status import Status
from model.one_rank import ONE_RANK
from model.problem.nonnegative import nearest_admissible, nonnegative_forces

BALANCE = 1e-9  # of the load: what least squares leave of a balanced one is below it by a factor of ten
LANDINGS = 100  # nodes that may arrive one after the other; the solver goes on from anywhere
ROUNDS = 50  # in which edges of friction cones join; 17 were the most seen
FREE = 1e-13  # of the energy that a motion would cost if every node moved alone
LEFT = 1e-8  # of a node's motion: pressed nodes that see less of a mode leave it, by more than rounding
TINY = 1e-300  # lets a motion that moves nothing be factorised, and changes no number
SEEN = 1e-10  # of the largest work on any mode: a mode on which unit forces do less is not resisted


def rigid_motions(
    coordinates: np.ndarray, ranks: Any = ONE_RANK, turning: np.ndarray | None = None
) -> np.ndarray:
    """Translations and small rotations about the centre, scaled to the body's size.

    (N, d, 3) in 2-D, (N, d, 6) in 3-D. Nodes that are angles times a length `turning` (N,) > 0 do not
    translate.
    """
    N, d = coordinates.shape
    x = centred(coordinates, ranks)
    pairs = [(0, 1)] if d == 2 else [(0, 1), (1, 2), (2, 0)]
    motions = np.zeros((N, d, d + len(pairs)))
    for a in range(d):
        motions[:, a, a] = 1.0
    for k, (a, b) in enumerate(pairs):
        motions[:, a, d + k] = -x[:, b]
        motions[:, b, d + k] = x[:, a]
    if turning is not None and turning.any():
        size = centre_and_size(coordinates)[1]
        motions[turning > 0] = 0.0
        for k in range(len(pairs)):
            motions[:, (k + 2) % 3 if d == 3 else 0, d + k] += turning / size
    return motions


def centred(coordinates: np.ndarray, ranks: Any = ONE_RANK) -> np.ndarray:
    """Return points (N, d), which ranks may share, from their mean, scaled to the size 1."""
    centre, size = centre_and_size(coordinates, ranks)
    return (coordinates - centre) / size


def centre_and_size(coordinates: np.ndarray, ranks: Any = ONE_RANK) -> tuple[np.ndarray, float]:
    """Return the mean (d,) of points (N, d), which ranks may share, and how far they are from it at most."""
    own = ranks.own(coordinates)
    centre = ranks.sum(own.sum(axis=0)) / ranks.sum(len(own))
    return centre, ranks.max(float(np.abs(coordinates - centre).max(initial=0.0))) or 1.0


def coupled(A: bsr_array) -> csr_array:
    """Return which nodes of A are coupled, as a graph."""
    nodes = A.shape[1] // A.blocksize[1]
    graph = (np.ones(A.indices.size, dtype=np.int8), A.indices, A.indptr)
    return csr_array(graph, shape=(A.indptr.size - 1, nodes))


def bodies(A: bsr_array) -> np.ndarray:
    """Tell which of the bodies that A holds each node belongs to, (N,); -1 for a node that stands alone."""
    # what is coupled is so both ways: "strong" finds the same as "weak", which would transpose the graph
    label = connected_components(coupled(A), connection="strong")[1]
    size, first = np.bincount(label), np.zeros(label.max() + 1, dtype=np.int64)
    first[label[::-1]] = np.arange(label.size)[::-1]
    sets = np.flatnonzero(size > 1)
    number = np.full(size.size, -1)
    number[sets[np.argsort(first[sets])]] = np.arange(sets.size)
    return number[label]


def parts(A: bsr_array, chosen: np.ndarray) -> np.ndarray:
    """Tell which connected part of the chosen nodes (N,) of A each node belongs to, (N,); -1 outside."""
    label = np.full(chosen.size, -1)
    label[chosen] = connected_components(coupled(A)[chosen][:, chosen], directed=False)[1]
    return label


def motions_of_each_body(
    coordinates: np.ndarray, body: np.ndarray, turning: np.ndarray | None = None
) -> np.ndarray:
    """Rigid motions of every body by itself, as columns (N d, 3 or 6 a body)."""
    motions, columns = _own_motions(coordinates, body, turning), [np.zeros((coordinates.size, 0))]
    for number in np.flatnonzero(np.bincount(body[body >= 0])):
        here = (body == number)[:, None, None]
        columns.append(np.where(here, motions, 0.0).reshape(coordinates.size, -1))
    return np.hstack(columns)


def _own_motions(coordinates: np.ndarray, body: np.ndarray, turning: np.ndarray | None) -> np.ndarray:
    """Rigid motions (N, d, 3 or 6) of the body that each node belongs to."""
    N, d = coordinates.shape
    motions = np.zeros((N, d, 3 * d - 3))
    for number in np.flatnonzero(np.bincount(body[body >= 0])):
        here = body == number
        motions[here] = rigid_motions(coordinates[here], turning=None if turning is None else turning[here])
    return motions


def unheld_motions(
    A: bsr_array,
    coordinates: np.ndarray,
    body: np.ndarray,
    turning: np.ndarray | None = None,
    least: float = FREE,
) -> np.ndarray:
    """Rigid motions of the bodies (N,) that cost no energy in A, orthonormal columns (N d, m).

    A body has 3 or 6 at most. A motion counts as free where its energy is below a part `least` of what it
    would cost if every node moved alone; 1e-13 is above rounding, and below any real support, which resists
    at least at one node.
    """
    motions, (N, d) = _own_motions(coordinates, body, turning), coordinates.shape
    energy, alone = energies(d)(block_matrix(A), motions, body, body.max(initial=-1) + 1)
    columns = [np.zeros((N * d, 0))]
    for number, (cost, scale) in enumerate(zip(energy, alone)):
        free = motions.reshape(N * d, -1) @ free_amplitudes(cost, scale, least)
        free.reshape(N, d, -1)[body != number] = 0.0
        columns.append(np.linalg.qr(free)[0])
    return np.hstack(columns)


@lru_cache
def energies(d: int) -> Any:
    """Compile (A, motions (N, d, m), body (N,), bodies), for the m = 3 d - 3 motions of each body.

    Returns their energies (bodies, m, m) in A, and what these would be if every node moved alone.
    """
    m = 3 * d - 3

    @njit(cache=True, error_model="numpy", fastmath=FUSED)
    def compute(A, motions, body, bodies):
        energy, alone, force = np.zeros((bodies, m, m)), np.zeros((bodies, m, m)), np.zeros(d * m)
        all_moved, work, work_alone = flat(motions), flat(energy), flat(alone)
        for i in range(body.size):
            if body[i] < 0:
                continue
            force[:] = 0.0
            for k in range(A.indptr[i], A.indptr[i + 1]):
                moved = np.uint64(A.indices[k]) * np.uint64(d * m)
                for a in range(d):
                    for b in range(d):
                        of_b = moved + np.uint64(b * m)
                        add_scaled(force, np.uint64(a * m), A.data[k, a, b], all_moved, of_b, m)
                if A.indices[k] != i:
                    continue
                for a in range(d):
                    of_a = moved + np.uint64(a * m)
                    for x in range(m):
                        row, w = np.uint64((body[i] * m + x) * m), motions[i, a, x] * A.data[k, a, a]
                        add_scaled(work_alone, row, w, all_moved, of_a, m)
            for a in range(d):
                for x in range(m):
                    row, w = np.uint64((body[i] * m + x) * m), motions[i, a, x]
                    add_scaled(work, row, w, force, np.uint64(a * m), m)
        return energy, alone

    return compute


def free_amplitudes(energy: np.ndarray, scale: np.ndarray, least: float = FREE) -> np.ndarray:
    """Amplitudes (k, m) of motions whose energy (k, k) is a part below `least` of what it might be."""
    lower = np.linalg.cholesky(scale + TINY * np.eye(len(scale)))
    inner = np.linalg.solve(lower, np.linalg.solve(lower, energy).T)
    values, vectors = np.linalg.eigh(0.5 * (inner + inner.T))
    return np.asarray(np.linalg.solve(lower.T, vectors[:, values < least]))


class RigidModes:
    """Rigid modes of the bodies in A, and their equilibrium with forces of the road.

    Every motion r with A r = 0 must be balanced by forces of the road, sum f_i . r_i = -b . r, with f_i in
    the friction cones (Farkas' lemma: either there are such forces, or an admissible motion on which the
    load does work). In 3-D the cones are replaced by pyramids of eight edges around them: a load just outside
    the cones is left for the solver to find out.

    Parameters
    ----------
    A : bsr_array (N d, N d)
    coordinates : (N, d)
    nodes : (n,)
        Candidates.
    turning : (N,), optional
        As for `ContactProblem`.

    Attributes
    ----------
    modes : (N d, m)
        Orthonormal.
    bearing : (k,)
        Candidates, no more than modes, whose forces may balance the load that was judged last; without
        friction where there are such.
    """

    def __init__(
        self, A: bsr_array, coordinates: np.ndarray, nodes: np.ndarray, turning: np.ndarray | None = None
    ):
        self.coordinates, self.nodes, self._body = coordinates, nodes, bodies(A)
        self.turning = turning
        self.modes = unheld_motions(A, coordinates, self._body, turning)
        self.count = self.modes.shape[1]
        self.bearing = np.zeros(0, dtype=np.int64)

    def weakly_held(self, A: bsr_array, least: float) -> np.ndarray:
        """The modes, and rigid motions with them that cost little energy in A, (N d, m); see above."""
        return unheld_motions(A, self.coordinates, self._body, self.turning, least)

    def at(self, nodes: np.ndarray) -> np.ndarray:
        """The modes (k, d, m) at nodes (k,)."""
        N, d = self.coordinates.shape
        return self.modes.reshape(N, d, -1)[nodes]

    def of_coarser_mesh(self, kept: np.ndarray, nodes: np.ndarray) -> "RigidModes":
        """The modes of a mesh that keeps nodes (k,) of this one, its candidates (n,) numbered among them.

        Looked for in a Galerkin product they may be missed: its rounding passes for stiffness.
        """
        coarser = copy(self)
        coarser.coordinates, coarser.nodes, coarser._body = self.coordinates[kept], nodes, self._body[kept]
        coarser.turning = None if self.turning is None else self.turning[kept]
        coarser.modes = np.linalg.qr(self.at(kept).reshape(coarser.coordinates.size, self.count))[0]
        return coarser

    def part_of(self, u: np.ndarray) -> np.ndarray:
        """The rigid part (N, d) of a displacement (N, d)."""
        return (self.modes @ (self.modes.T @ u.ravel())).reshape(u.shape)

    def nearest(self, work: np.ndarray, way: np.ndarray) -> np.ndarray:
        """The least motion (N, d) whose parts, `work` (k, m) of the modes, come nearest to a way (k,)."""
        amplitudes = np.linalg.lstsq(work, way, rcond=SEEN)[0]
        return (self.modes @ amplitudes).reshape(self.coordinates.shape)

    def require_balance(self, b: np.ndarray, normal: np.ndarray, mu: Any, tolerance: float) -> None:
        """Refuse a load (N, d) that the road, with normals (n, d), cannot balance on the modes.

        Raises
        ------
        ValueError
            Naming the motion, and the force, if more than `tolerance` of the load is missing.
        """
        if not self.bears(b, normal, mu, tolerance):
            left, _ = self._unbalanced(b, self._work(normal, 0.0), tolerance)  # friction turns no motion
            motion = self.modes @ left
            force = motion @ b.ravel() / np.linalg.norm(motion.reshape(b.shape), axis=1).max()
            raise ValueError(
                f"The load drives the body into {self.in_words(left)} that neither supports nor the "
                f"road can stop, with a force of {force:.3g}; load it towards the road or fix it."
            )

    def bears(self, b: np.ndarray, normal: np.ndarray, mu: Any, tolerance: float) -> bool:
        """Tell whether the road may balance a load (N, d) on the modes, and find who is `bearing` it."""
        self.bearing = np.zeros(0, dtype=np.int64)
        return (
            self.count == 0
            or self._balanced(b, normal, 0.0, tolerance)
            or (bool(np.any(mu)) and self._balanced(b, normal, mu, tolerance))
        )

    def held_by_friction(self, b: np.ndarray, normal: np.ndarray) -> str:
        """Say into which motion the load (N, d) would drive the body without friction; "" if into none."""
        left, _ = self._unbalanced(b, self._work(normal, 0.0), BALANCE) if self.count else (np.zeros(0), None)
        return self.in_words(left) if left.any() else ""

    def _balanced(self, b: np.ndarray, normal: np.ndarray, mu: Any, tolerance: float) -> bool:
        """Tell whether forces within the friction cones balance a load (N, d) on the modes.

        The cones of space have more edges than can be listed: those that oppose the motion which is left join
        round by round, until nothing is left or none of them opposes it.
        """
        work, number = self._work(normal, mu), np.arange(self.nodes.size)
        number = np.tile(number, len(work) // max(number.size, 1))
        for _ in range(ROUNDS):
            left, force = self._unbalanced(b, work, tolerance)
            if not left.any():
                self.bearing = np.unique(number[force > 0.0])
                return True
            along = along_road(np.einsum("cdm,m->cd", self.at(self.nodes), left), normal)
            size = np.linalg.norm(along, axis=1, keepdims=True)
            against = along / np.where(size > 0.0, size, 1.0)
            steepest = normal - np.reshape(mu, (-1, 1)) * against
            more = np.einsum("cd,cdm->cm", steepest, self.at(self.nodes))
            opposes = more @ left < -SEEN * np.linalg.norm(more, axis=1)
            if not opposes.any():
                return False
            work = np.concatenate([work, more[opposes]])
            number = np.concatenate([number, np.flatnonzero(opposes)])
        return True

    def landing(self, b: np.ndarray, normal: np.ndarray, mu: Any, gap: np.ndarray) -> tuple[np.ndarray, str]:
        """The motion (N, d) by which the load (N, d) would bring the body to rest, were it rigid.

        The body goes the way that the nodes on the road leave it, until the next arrives (gradient
        projection, J. B. Rosen, J. SIAM 8 (1960) 181). Where only friction could hold the body it may go on
        for ever: the motion is then returned in words as well.
        """
        amplitudes, height = np.zeros(self.count), float(gap.max(initial=0.0))
        if height <= 0.0:
            return np.zeros_like(b), ""
        work, rise = self._work(normal, mu), self._work(normal, 0.0)
        for _ in range(LANDINGS):
            near = np.tile(gap <= SEEN * height, len(work) // gap.size)
            left, _ = self._unbalanced(b, work[near], BALANCE)
            speed = rise @ left
            time = float(arrivals(gap, speed, np.abs(speed).max()).min())
            if time == np.inf:
                away = self.in_words(left) if left.any() else ""
                return (self.modes @ amplitudes).reshape(b.shape), away
            amplitudes += time * left
            gap = gap + time * speed
        return (self.modes @ amplitudes).reshape(b.shape), ""

    def landing_on_springs(
        self, b: np.ndarray, normal: np.ndarray, gap: np.ndarray, springs: np.ndarray
    ) -> np.ndarray:
        """The motion (N, d) by which a load (N, d) would bring the body, were it rigid, to rest on springs.

        Candidates are held by springs (n, d, d), and by the road without friction; zero where a mode is not.
        """
        at = self.at(self.nodes)
        resistance = np.einsum("cam,cab,cbk->mk", at, springs, at)
        sizes, axes = np.linalg.eigh(resistance)
        if not sizes[0] > SEEN * sizes[-1]:
            return np.zeros_like(b)
        modes = axes / np.sqrt(sizes)  # each as stiff as the others
        work = self._work(normal, 0.0) @ modes
        way = modes.T @ self.modes.T @ b.ravel()
        scale = max(float(np.abs(gap).max()), float(np.abs(work @ way).max()))
        amplitudes = modes @ nearest_admissible(way, work, gap, scale)  # rounded first: it stays rigid
        return (self.modes @ amplitudes).reshape(b.shape)

    def driven(
        self, b: np.ndarray, normal: np.ndarray, mu: Any, near: np.ndarray, slip: np.ndarray
    ) -> np.ndarray:
        """The motion (m,) into which a load (N, d) of size 1 drives the body that the nodes `near` (n,) hold.

        Zero where they balance the load. Friction opposes a node's `slip` (n, d), unless it is zero.
        """
        edges, size = _cone_edges(normal, mu), np.linalg.norm(slip, axis=1, keepdims=True)
        against = normal - np.reshape(mu, (-1, 1)) * slip / np.where(size > 0.0, size, 1.0)
        edges = np.where(size > 0.0, against, edges)
        work = np.einsum("ecd,cdm->ecm", edges, self.at(self.nodes)).reshape(-1, self.count)
        return self._unbalanced(b, work[np.tile(near, len(work) // near.size)], BALANCE)[0]

    def holding(self, b: np.ndarray, normal: np.ndarray, near: np.ndarray) -> np.ndarray:
        """Pressures (n,) of the nodes `near` (n,) that balance a load (N, d) best."""
        pressure, load = np.zeros(near.size), self.modes.T @ b.ravel()
        size = np.linalg.norm(load)
        if near.any() and size > 0.0:
            work = self._work(normal, 0.0)[near]
            pressure[near] = size * nonnegative_forces(work, load / size)[0]
        return pressure

    def loose(self, frame: np.ndarray, status: np.ndarray, pressure: np.ndarray) -> np.ndarray:
        """Amplitudes (m, z) of the modes that leave in place all nodes that press on the road.

        Parameters
        ----------
        frame : (n, d, d)
        status, pressure : (n,)
            Nodes that slip may move along the road, nodes that stick may not.
        """
        if not self.count:
            return np.zeros((0, 0))
        pressed = pressure > SEEN * pressure.max(initial=0.0)
        at = self.at(self.nodes)
        sticks = pressed & (status == Status.STICK)
        held = np.concatenate(
            [
                np.einsum("ca,cam->cm", frame[pressed, 0], at[pressed]),
                at[sticks].reshape(-1, self.count),
                np.zeros((self.count, self.count)),
            ]
        )
        _, sizes, directions = np.linalg.svd(held)
        return directions[sizes < LEFT * np.abs(at).max()].T

    def _unbalanced(self, b: np.ndarray, work: np.ndarray, tolerance: float) -> tuple[np.ndarray, np.ndarray]:
        """What forces that do such work (k, m) on the modes leave of a load (N, d) at best, (m,).

        It is the motion that leads nowhere into the road into which the load drives the body with the
        greatest force, for a load of size 1; zero where it is below `tolerance`. The sizes (k,) of these
        forces, of which no more than m are not zero, are returned as well.
        """
        load, size, force = self.modes.T @ b.ravel(), np.linalg.norm(b), np.zeros(len(work))
        if not np.linalg.norm(load) > tolerance * size:
            return np.zeros(self.count), force
        left = load / size
        if len(work):
            force, left = nonnegative_forces(work, left)
        return left if np.linalg.norm(left) > tolerance else np.zeros(self.count), force

    def _work(self, normal: np.ndarray, mu: Any) -> np.ndarray:
        """Work (e n, m) of unit forces along the edges of the friction cones on the modes."""
        edges = _cone_edges(normal, mu)
        return np.einsum("ecd,cdm->ecm", edges, self.at(self.nodes)).reshape(-1, self.count)

    def in_words(self, amplitudes: np.ndarray) -> str:
        """Say what a rigid motion is, of the body that it moves most."""
        motion = (self.modes @ amplitudes).reshape(self.coordinates.shape)
        size = np.linalg.norm(motion, axis=1)
        here = self._body == self._body[np.argmax(size)]
        here &= np.ones(len(here), dtype=bool) if self.turning is None else self.turning == 0.0
        x, v = self.coordinates[here], motion[here]
        centre, mean = x.mean(axis=0), v.mean(axis=0)
        d = x.shape[1]
        away, turning = np.zeros((len(x), 3)), np.zeros((len(x), 3))
        away[:, :d], turning[:, :d] = x - centre, v - mean
        spread = np.sum(away**2) * np.eye(3) - away.T @ away
        spin = np.linalg.pinv(spread, rcond=SEEN) @ np.cross(away, turning).sum(axis=0)
        # v = mean + spin x (x - centre)
        if np.abs(turning).max() < 1e-3 * np.linalg.norm(mean):  # three digits are printed
            return f"a translation along {_vector(mean / np.linalg.norm(mean))}"
        through = centre + np.cross(spin, np.append(mean, [0.0] * (3 - d)))[:d] / (spin @ spin)
        along = "" if d == 2 else f" along {_vector(spin / np.linalg.norm(spin))}"
        return f"a rotation about {'' if d == 2 else 'an axis through '}{_vector(through)}{along}"


def arrivals(gap: np.ndarray, speed: np.ndarray, fastest: float) -> np.ndarray:
    """When nodes (n,) of a body that moves no faster come to the road; inf for those that do not."""
    falls = speed < -SEEN * fastest
    return np.where(falls, np.maximum(gap, 0.0) / np.where(falls, -speed, 1.0), np.inf)


def _vector(x: np.ndarray) -> str:
    """Components of a vector, what is rounding beside the others as 0."""
    x = np.where(np.abs(x) < 1e-12 * np.abs(x).max(), 0.0, x)
    return "(" + ", ".join(f"{component:.3g}" for component in x) + ")"


def determinate_unknowns(modes: np.ndarray) -> np.ndarray:
    """As many rows of modes (N d, m) as there are independent ones: statically determinate supports.

    QR with column pivoting of the transpose, Businger and Golub, Numer. Math. 7 (1965).
    """
    if modes.shape[1] == 0:
        return np.zeros(0, dtype=np.int64)
    alike = np.round(modes.T / np.abs(modes).max(), 9)  # of nodes alike the first is taken, not any
    triangle, order = qr(alike, mode="r", pivoting=True)
    sizes = np.abs(triangle.diagonal())
    return order[: sizes.size][sizes > SEEN * sizes[0]].astype(np.int64)


def _cone_edges(normal: np.ndarray, mu: Any) -> np.ndarray:
    """Edges (e, n, d) of the friction cones of coefficients mu, one or (n,)."""
    frame = frames(normal)
    if not np.any(mu):
        return frame[None, :, 0]
    if normal.shape[1] == 2:
        tangents = [frame[:, 1], -frame[:, 1]]
    else:
        angles = np.arange(8) * np.pi / 4
        tangents = [np.cos(t) * frame[:, 1] + np.sin(t) * frame[:, 2] for t in angles]
    return np.stack([frame[:, 0] + np.reshape(mu, (-1, 1)) * tangent for tangent in tangents])


@njit(cache=True, error_model="numpy")
def null_space(G, largest):
    """Orthonormal amplitudes (m, z) of modes that vanish at the given components G (l, m)."""
    m = G.shape[1]
    padded = np.zeros((max(G.shape[0], m), m))
    padded[: G.shape[0]] = G
    _, sizes, directions = np.linalg.svd(padded)
    rank = 0
    while rank < m and sizes[rank] > 1e-10 * largest:
        rank += 1
    return directions[rank:].T.copy()


@njit(cache=True, error_model="numpy")
def free_modes(G, held):
    """Orthonormal columns of what modes G (l, m) do where they are not `held` (l,), those at rest."""
    nothing = np.zeros((np.count_nonzero(~held), 0))
    if G.shape[1] == 0:
        return nothing
    Z = null_space(G[held], np.abs(G).max())
    if Z.shape[1] == 0:
        return nothing
    N, sizes, _ = np.linalg.svd(G[~held] @ Z, full_matrices=False)
    return N[:, sizes > 1e-10 * np.abs(G).max()].copy()
