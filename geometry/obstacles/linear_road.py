"""Roads through samples of their height: straight from sample to sample, corners and all.

At the corners. The point of a road nearest to a node above a peak is the peak, for a whole wedge of
nodes; nearest to a node *below* a hollow it is the deepest point, for a whole wedge too. There the normal
points from the nearest point to the node or back, and turns steadily from the one slope's to the other's.
A node that lies on a corner to within rounding gets the mean of the normals of the slopes that meet
there. `model.quasistatics.curved_contact` looks at the road from a little below each node that touches,
so that it finds the force on a node in a hollow within the wedge that both slopes can give. As
everywhere, nodes are kept above the road and nothing else: a peak between two nodes enters the body.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from scipy.spatial import Delaunay, QhullError

from checks import numbers
from geometry.obstacles.plane import check_points

BEYOND = 100.0  # how many of its lengths a profile goes on, flat, beyond either end
TINY = 1e-14  # of the size of the numbers: whatever is nearer to a corner than this is on it


class LinearRoad:
    """A road through samples: a chain of segments over x, or Delaunay's triangles over (x, y).

    A profile goes on flat beyond its ends; a surface ends at its rim, so let it reach beyond the body.

    Parameters
    ----------
    positions : (m,) for a profile, (m, 2) for a surface; in any order and irregularly spaced
    heights : (m,)

    Raises
    ------
    ValueError
        for samples that are not finite, that share a position, or that are too few or in a line; the
        sentence names the first.

    Examples
    --------
    >>> import numpy as np
    >>> from geometry import LinearRoad
    >>> step = LinearRoad(np.array([-1.0, 0.0, 1.0]), np.array([0.0, 0.0, 1.0]))
    >>> step.closest(np.array([[-0.5, 0.2]]))[0]
    array([0.2])
    """

    def __init__(self, positions: np.ndarray, heights: np.ndarray):
        positions, heights = checked_samples(positions, heights)
        self.dim = positions.shape[1] + 1
        samples = np.column_stack([positions, heights])
        if self.dim == 2:
            samples = samples[np.argsort(samples[:, 0])]
            length = np.ptp(samples[:, 0])
            ends = samples[[0, -1]] + [[-BEYOND * length, 0], [BEYOND * length, 0]]
            numbers = np.arange(len(samples) + 1)
            facets = np.stack([numbers, numbers + 1], axis=1)
            bins = None
            points = np.concatenate([ends[:1], samples, ends[1:]])
        else:
            points, facets = samples, _triangles(positions)
            bins = _sort_into_bins(points, facets)
        tiny = TINY * (np.abs(samples).max() + np.ptp(samples, axis=0).max())
        self._surface = Surface(points, facets, _normals(points, facets), bins, tiny)

    def closest(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return gap (n,), normal (n, dim) and closest point (n, dim) for points (n, dim)."""
        points = check_points(self, self.dim, points)
        gap, normal, foot = np.empty(len(points)), np.empty(points.shape), np.empty(points.shape)
        search = nearest_on_chain if self.dim == 2 else nearest_on_triangles
        search(self._surface, points, gap, normal, foot)
        return gap, normal, foot


class Bins(NamedTuple):
    """Facets by the squares of a grid over (x, y): those of square k are facets[start[k]:start[k + 1]].

    `heights` (2,) are the lowest and the highest of the samples.
    """

    low: np.ndarray
    size: np.ndarray
    squares: np.ndarray
    start: np.ndarray
    facets: np.ndarray
    heights: np.ndarray


class Surface(NamedTuple):
    """What the search needs: vertices (m, dim), facets and their unit normals (f, dim), bins, and zero."""

    points: np.ndarray
    facets: np.ndarray
    normals: np.ndarray
    bins: Bins | None
    tiny: float


def checked_samples(positions: np.ndarray, heights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return positions (m, dim - 1) and heights (m,), or raise the ValueError that says what is wrong."""
    positions, heights = numbers("positions", positions), numbers("heights", heights).ravel()
    positions = positions[:, None] if positions.ndim == 1 else positions
    if positions.ndim != 2 or positions.shape[1] not in (1, 2) or len(positions) != len(heights):
        raise ValueError(
            f"The road's positions have shape {positions.shape} and its heights {heights.shape}; "
            "(m,) or (m, 2) and (m,) are needed."
        )
    if len(heights) < positions.shape[1] + 1:
        raise ValueError(f"The road has {len(heights)} samples; it needs {positions.shape[1] + 1} or more.")
    bad = ~(np.isfinite(positions).all(axis=1) & np.isfinite(heights))
    if bad.any():
        first = int(np.argmax(bad))
        raise ValueError(
            f"Sample {first} of the road, height {heights[first]} at {positions[first]}, is not finite; "
            "leave out such samples."
        )
    order = np.lexsort(positions.T)
    same = np.flatnonzero((positions[order][1:] == positions[order][:-1]).all(axis=1))
    if same.size:
        one, other = sorted(order[same[0] : same[0] + 2])
        raise ValueError(
            f"Samples {one} and {other} of the road are both at {positions[one]}; leave one out, for "
            "a road has one height at each position."
        )
    return positions, heights


def _triangles(positions: np.ndarray) -> np.ndarray:
    try:
        facets = np.ascontiguousarray(Delaunay(positions - positions.mean(axis=0)).simplices, dtype=np.int64)
    except QhullError:
        raise ValueError(
            f"The {len(positions)} samples of the road lie in a line; a surface needs more."
        ) from None
    corner = positions[facets]
    edges = np.roll(corner, -1, axis=1) - corner
    twice_area = np.abs(edges[:, 0, 0] * edges[:, 1, 1] - edges[:, 0, 1] * edges[:, 1, 0])
    flat = twice_area < 1e-9 * np.sum(edges**2, axis=2).max(
        axis=1
    )  # rounding makes such between samples in a line along the rim
    return facets[~flat]


def _normals(points: np.ndarray, facets: np.ndarray) -> np.ndarray:
    corner = points[facets]
    if points.shape[1] == 2:
        along = corner[:, 1] - corner[:, 0]
        normal = np.stack([-along[:, 1], along[:, 0]], axis=1)
    else:
        normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
        normal *= np.sign(normal[:, 2:])
    return normal / np.linalg.norm(normal, axis=1, keepdims=True)


def _sort_into_bins(points: np.ndarray, facets: np.ndarray) -> Bins:
    """Lay about as many squares as there are facets over the road."""
    across = points[:, :2]
    low, length = across.min(axis=0), np.ptp(across, axis=0)
    edge = np.sqrt(length.prod() / len(facets))
    count = np.maximum((length / edge).astype(np.int64), 1)
    size = length / count
    corner = across[facets]
    first, last = (
        np.clip(((end - low) / size).astype(np.int64), 0, count - 1)
        for end in (corner.min(axis=1), corner.max(axis=1))
    )
    spans = last - first + 1
    owner = np.repeat(np.arange(len(facets)), spans.prod(axis=1))
    place = np.arange(len(owner)) - np.repeat(
        np.cumsum(spans.prod(axis=1)) - spans.prod(axis=1), spans.prod(axis=1)
    )
    i, j = first[owner, 0] + place // spans[owner, 1], first[owner, 1] + place % spans[owner, 1]
    square = i * count[1] + j
    start = np.concatenate([[0], np.cumsum(np.bincount(square, minlength=count.prod()))])
    heights = np.array([points[:, 2].min(), points[:, 2].max()])
    return Bins(low, size, count, start, owner[np.argsort(square, kind="stable")], heights)


@njit(cache=True, error_model="numpy")
def nearest_on_chain(surface, points, gap, normal, foot):
    """Fill gap (n,), normal and foot (n, 2), from below each point as far as something may be nearer."""
    x = surface.points[:, 0]
    last = surface.facets.shape[0] - 1
    trial, mean, best = np.empty(2), np.empty(2), np.empty(2)
    for n in range(points.shape[0]):
        p = points[n]
        best[0] = np.inf
        right = min(max(np.searchsorted(x, p[0]) - 1, 0), last)
        left = right - 1
        while right <= last and x[right] - p[0] <= best[0]:
            consider(surface, right, p, trial, foot[n], mean, best)
            right += 1
        while left >= 0 and p[0] - x[left + 1] <= best[0]:
            consider(surface, left, p, trial, foot[n], mean, best)
            left -= 1
        gap[n] = signed_gap(surface, p, foot[n], mean, best, normal[n])


@njit(cache=True, error_model="numpy")
def nearest_on_triangles(surface, points, gap, normal, foot):
    """Fill gap (n,), normal and foot (n, 3), ring by ring of squares, as far as something may be nearer.

    A point far above has the road nearly below it: what is aside is farther by the height as well.
    """
    bins = surface.bins
    trial, mean, best = np.empty(3), np.empty(3), np.empty(2)
    visited = np.full(surface.facets.shape[0], -1)
    for n in range(points.shape[0]):
        p = points[n]
        best[0] = np.inf
        i0 = min(max(int((p[0] - bins.low[0]) / bins.size[0]), 0), bins.squares[0] - 1)
        j0 = min(max(int((p[1] - bins.low[1]) / bins.size[1]), 0), bins.squares[1] - 1)
        ring = 0
        off = max(p[2] - bins.heights[1], bins.heights[0] - p[2], 0.0)
        while (
            ring <= max(bins.squares[0], bins.squares[1])
            and np.hypot(max(ring - 1, 0) * min(bins.size[0], bins.size[1]), off) <= best[0]
        ):
            for i in range(max(i0 - ring, 0), min(i0 + ring, bins.squares[0] - 1) + 1):
                on_side = abs(i - i0) == ring
                for j in range(j0 - ring, j0 + ring + 1, 1 if on_side or ring == 0 else 2 * ring):
                    if not 0 <= j < bins.squares[1]:
                        continue
                    square = i * bins.squares[1] + j
                    for k in range(bins.start[square], bins.start[square + 1]):
                        f = bins.facets[k]
                        if visited[f] != n:
                            visited[f] = n
                            consider(surface, f, p, trial, foot[n], mean, best)
            ring += 1
        gap[n] = signed_gap(surface, p, foot[n], mean, best, normal[n])


@njit(cache=True, error_model="numpy")
def consider(surface, f, p, trial, foot, mean, best):
    """Keep facet `f` if it is the nearest to p so far.

    `best` holds distance and facet, `mean` the sum of the normals that meet at `foot`.
    Normals of triangles that meet at a corner count by their angles there, so that the sum tells above from
    below (Baerentzen and Aanaes, IEEE Trans. Vis. Comput. Graph. 11, 2005).
    """
    points, corners = surface.points, surface.facets[f]
    weight = 1.0
    if p.size == 2:
        closest_on_segment(points[corners[0]], points[corners[1]], p, trial)
    else:
        closest_on_triangle(points[corners[0]], points[corners[1]], points[corners[2]], p, trial)
        for v in range(3):
            if apart(trial, points[corners[v]]) <= surface.tiny:
                weight = angle(points[corners[v]], points[corners[(v + 1) % 3]], points[corners[(v + 2) % 3]])
    distance = apart(p, trial)
    same_foot = best[0] < np.inf and apart(trial, foot) <= surface.tiny
    if distance < best[0]:
        best[0], best[1] = distance, f
    elif not same_foot:
        return
    for a in range(p.size):
        foot[a] = trial[a]
        mean[a] = weight * surface.normals[f, a] + (mean[a] if same_foot else 0.0)


@njit(cache=True, error_model="numpy")
def signed_gap(surface, p, foot, mean, best, normal):
    """Write the normal at `foot`, the point nearest to p, and return the gap."""
    f = int(best[1])
    flat, corner = surface.normals[f], surface.points[surface.facets[f, 0]]
    height = dot(flat, corner, p)  # above the facet's plane
    beside, length, side = 0.0, 0.0, 0.0
    for a in range(p.size):
        beside += (p[a] - height * flat[a] - foot[a]) ** 2
        length += mean[a] ** 2
        side += mean[a] * (p[a] - foot[a])
    on_corner = best[0] <= surface.tiny
    if not on_corner and np.sqrt(beside) <= surface.tiny:
        normal[:] = flat
        return height
    sign = 1.0 if side >= 0.0 else -1.0
    for a in range(p.size):
        normal[a] = mean[a] / np.sqrt(length) if on_corner else sign * (p[a] - foot[a]) / best[0]
    return dot(normal, foot, p)


@njit(cache=True, error_model="numpy")
def dot(direction, a, b):
    """Scalar product of `direction` with the way from a to b."""
    s = 0.0
    for k in range(a.size):
        s += direction[k] * (b[k] - a[k])
    return s


@njit(cache=True, error_model="numpy")
def apart(a, b):
    """Distance between two points."""
    s = 0.0
    for k in range(a.size):
        s += (b[k] - a[k]) ** 2
    return np.sqrt(s)


@njit(cache=True, error_model="numpy")
def angle(a, b, c):
    """Angle at `a` of the triangle a, b, c."""
    ab, ac, bc = apart(a, b), apart(a, c), apart(b, c)
    return np.arccos(min(max((ab * ab + ac * ac - bc * bc) / (2 * ab * ac), -1.0), 1.0))


@njit(cache=True, error_model="numpy")
def closest_on_segment(a, b, p, foot):
    """Write the point of the segment from a to b that is nearest to p."""
    along, length = 0.0, 0.0
    for k in range(p.size):
        along += (p[k] - a[k]) * (b[k] - a[k])
        length += (b[k] - a[k]) ** 2
    t = min(max(along / length, 0.0), 1.0)
    for k in range(p.size):
        foot[k] = b[k] if t == 1.0 else a[k] + t * (b[k] - a[k])


@njit(cache=True, error_model="numpy")
def closest_on_triangle(a, b, c, p, foot):
    """Write the point of a triangle nearest to p (Ericson, Real-Time Collision Detection, 2005, 5.1.5)."""
    d1, d2, d3, d4, d5, d6 = (
        0.0,
        0.0,
        0.0,
        0.0,
        0.0,
        0.0,
    )  # of the edges ab and ac with the ways to p from a, from b, from c
    for k in range(3):
        ab, ac = b[k] - a[k], c[k] - a[k]
        d1 += ab * (p[k] - a[k])
        d2 += ac * (p[k] - a[k])
        d3 += ab * (p[k] - b[k])
        d4 += ac * (p[k] - b[k])
        d5 += ab * (p[k] - c[k])
        d6 += ac * (p[k] - c[k])
    at_a, at_b, at_c = d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2
    v, w = 0.0, 0.0
    if d1 <= 0.0 and d2 <= 0.0:
        v, w = 0.0, 0.0
    elif d3 >= 0.0 and d4 <= d3:
        v = 1.0
    elif d6 >= 0.0 and d5 <= d6:
        w = 1.0
    elif at_c <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        v = d1 / (d1 - d3)
    elif at_b <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        w = d2 / (d2 - d6)
    elif at_a <= 0.0 and d4 >= d3 and d5 >= d6:
        w = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        v = 1.0 - w
    else:
        v, w = at_b / (at_a + at_b + at_c), at_c / (at_a + at_b + at_c)
    for k in range(3):
        foot[k] = b[k] if v == 1.0 else c[k] if w == 1.0 else a[k] + v * (b[k] - a[k]) + w * (c[k] - a[k])
