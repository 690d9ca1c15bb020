"""Least squares with variables that are not negative.

Source: C. L. Lawson and R. J. Hanson, Solving Least Squares Problems (1974), chapter 23; as `nnls` of scipy,
of which version 1.15 (Debian 13) may end before it has found the least.
"""

import numpy as np

LEAST = 1e-13  # of the load: who would take less than that from what is left takes rounding


def nonnegative_forces(work: np.ndarray, load: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return forces (k,) >= 0 for which |load + work^T forces| is least, and what is left of the load (m,).

    No more than m of the forces are not zero.

    Parameters
    ----------
    work : (k, m)
    load : (m,)

    Examples
    --------
    >>> nonnegative_forces(np.array([[1.0, 0.0], [0.0, 1.0]]), np.array([-2.0, 3.0]))
    (array([2., 0.]), array([0., 3.]))
    """
    forces, chosen, left = np.zeros(len(work)), np.zeros(len(work), dtype=bool), load.copy()
    size = np.linalg.norm(work, axis=1)
    size[size == 0.0] = 1.0
    directions = work / size[:, None]
    while np.count_nonzero(chosen) < min(work.shape):  # so many independent ones leave nothing
        takes = np.where(chosen, -np.inf, -(directions @ left))
        new = int(np.argmax(takes))
        if takes[new] <= LEAST * np.linalg.norm(load):
            break
        chosen[new] = True
        now, trial = forces.copy(), _unbounded(directions, load, chosen)
        while trial[chosen].min(initial=np.inf) <= 0.0:
            falls = chosen & (trial <= 0.0)
            parts = now[falls] / np.maximum(now[falls] - trial[falls], np.finfo(float).tiny)
            now += parts.min() * (trial - now)
            chosen[np.flatnonzero(falls)[np.argmin(parts)]] = False
            chosen &= now > 0.0
            now[~chosen] = 0.0
            trial = _unbounded(directions, load, chosen)
        after = load + directions.T @ trial
        if not np.linalg.norm(after) < np.linalg.norm(left):
            break
        forces, left = trial, after
    return forces / size, left


def nearest_admissible(way: np.ndarray, work: np.ndarray, gap: np.ndarray, scale: float) -> np.ndarray:
    """Return the q (m,) nearest to `way` with gap + work q >= 0, `scale` being the size of the gaps.

    Least distance programming, C. L. Lawson and R. J. Hanson, Solving Least Squares Problems (1974), ch. 23.

    Parameters
    ----------
    way : (m,)
    work : (k, m)
    gap : (k,)
    scale : float

    Examples
    --------
    >>> nearest_admissible(np.array([2.0, -3.0]), np.eye(2), np.array([0.0, 1.0]), 1.0)
    array([ 2., -1.])
    """
    need = -(gap + work @ way) / scale
    some = need > -4.0
    if not (need > 0.0).any():
        return way
    unit = scale / np.abs(work).max()
    rows = np.column_stack([work[some] * unit / scale, need[some]])
    target = np.zeros(rows.shape[1])
    target[-1] = 1.0
    r = nonnegative_forces(rows, -target)[1]
    if -r[-1] < 1e-12:
        return way
    return way + unit * (r[:-1] / -r[-1])


def _unbounded(directions: np.ndarray, load: np.ndarray, chosen: np.ndarray) -> np.ndarray:
    """Forces (k,) of those chosen for which |load + directions^T forces| is least, of whatever sign."""
    forces = np.zeros(len(directions))
    forces[chosen] = np.linalg.lstsq(directions[chosen].T, -load, rcond=None)[0]
    return forces
