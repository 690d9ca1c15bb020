"""Where linear strain stops being true: large strains, and rotations, which it takes for strains."""

import warnings

import numpy as np

STRAIN = 0.05
ROTATION = 0.1  # rad; a rotation by t counts as a stretch by t^2/2


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
    """
    across = gradient.transpose(0, 2, 1)
    strain = float(np.abs(np.linalg.eigvalsh((gradient + across) / 2)).max())
    spin = (gradient - across) / 2
    rotation = float(np.sqrt((spin**2).sum(axis=(1, 2)) / 2).max())
    if strain > STRAIN or rotation > ROTATION:
        warnings.warn(
            f"The largest strain is {strain:.2g} and the largest rotation {rotation:.2g} rad, but linear "
            f"strain is true only well below {STRAIN} and {ROTATION}: this is the linear model's answer.",
            BeyondLinear,
            stacklevel=3,
        )
    return strain, rotation
