"""Where linear strain stops being true: large strains, and rotations, which it takes for strains."""

import warnings
from pathlib import Path

import numpy as np
from numba import njit

from checks import numbers, refused

STRAIN = 0.05  # Green's strain e + e^2/2 differs from the linear e by 2.5 % there
PACKAGE = str(Path(__file__).parents[1])  # a warning points to the line that called the package
ROTATION = 0.1  # rad; a rotation by t counts as a stretch by t^2/2, 0.5 % there


class BeyondLinear(UserWarning):
    """Strains or rotations are too large for the linear strain that the model is made of."""


def linear_limits(gradient: np.ndarray) -> tuple[float, float]:
    """Return the largest strain and the largest rotation, and warn where linear strain is not true to them.

    Parameters
    ----------
    gradient : (cells, d, d)
        Displacement gradient, as `forms.Elasticity.gradient` gives it.

    Returns
    -------
    strain : float
        Largest principal strain, in size.
    rotation : float
        Largest rotation (rad), that of the body as a whole included.

    Warns
    -----
    BeyondLinear
        With the numbers.

    Examples
    --------
    >>> import numpy as np
    >>> from model import linear_limits
    >>> strain, rotation = linear_limits(np.array([[[0.0, 0.01], [-0.01, 0.0]]]))  # a turn by 0.01 rad
    >>> round(strain, 9), round(rotation, 9)
    (0.0, 0.01)
    """
    found = numbers("gradient", gradient)
    if found.ndim != 3 or found.shape[1] != found.shape[2] or not np.isfinite(found).all():
        raise refused("gradient", "finite numbers of shape (cells, d, d)", gradient)
    return _exceeded(found)[:2]


def _exceeded(gradient: np.ndarray) -> tuple[float, float, bool]:
    """Return largest strain and rotation, and whether they had to be warned of."""
    across = gradient.transpose(0, 2, 1)
    strain = float(np.abs(np.linalg.eigvalsh((gradient + across) / 2)).max())
    spin = (gradient - across) / 2
    rotation = float(np.sqrt((spin**2).sum(axis=(1, 2)) / 2).max())
    beyond = strain > STRAIN or rotation > ROTATION
    if beyond:
        warnings.warn(
            f"The largest strain is {strain:.2g} and the largest rotation {rotation:.2g} rad, but linear "
            f"strain is true only well below {STRAIN} and {ROTATION}: this is the linear model's answer.",
            BeyondLinear,
            skip_file_prefixes=(PACKAGE,),
        )
    return strain, rotation, beyond


class LinearLimits:
    """Looks at one displacement after the other and says once, the first time, that the limits are passed.

    A check costs about as much as one product with the stiffness matrix.

    Parameters
    ----------
    shape_gradients : (cells, k, d)
        Gradients of the shape functions in the middle of each cell.
    cells : (cells, k)
        Nodes of each cell.

    Examples
    --------
    >>> import numpy as np
    >>> limits = LinearLimits(np.array([[[-1.0, -1.0], [1.0, 0.0], [0.0, 1.0]]]), np.array([[0, 1, 2]]))
    >>> limits.check(np.array([[0.0, 0.0], [0.01, 0.0], [0.0, 0.0]]))
    >>> limits.said
    False
    """

    def __init__(self, shape_gradients: np.ndarray, cells: np.ndarray):
        self.shape_gradients, self.cells = shape_gradients, np.asarray(cells)
        self.said = False

    def check(self, u: np.ndarray) -> None:
        """Look at displacements u (N, d) of the nodes; warn (BeyondLinear) where it is the first time."""
        if self.said:
            return
        strain, rotation = _bounds(self.shape_gradients, self.cells, np.ascontiguousarray(u))
        if strain <= STRAIN and rotation <= ROTATION:
            return
        gradient = np.einsum("cki,ckj->cij", u[self.cells], self.shape_gradients)
        self.said = _exceeded(gradient)[2]


@njit(cache=True, error_model="numpy")
def _bounds(shape_gradients, cells, u):
    """Largest Frobenius norm of the strain, which no principal strain exceeds, and largest rotation."""
    d = u.shape[1]
    gradient = np.empty((d, d))
    strain, spin = 0.0, 0.0
    for c in range(cells.shape[0]):
        gradient[:] = 0.0
        for k in range(cells.shape[1]):
            for i in range(d):
                for j in range(d):
                    gradient[i, j] += u[cells[c, k], i] * shape_gradients[c, k, j]
        symmetric, skew = 0.0, 0.0
        for i in range(d):
            for j in range(d):
                symmetric += 0.25 * (gradient[i, j] + gradient[j, i]) ** 2
                skew += 0.125 * (gradient[i, j] - gradient[j, i]) ** 2
        strain, spin = max(strain, symmetric), max(spin, skew)
    return np.sqrt(strain), np.sqrt(spin)
