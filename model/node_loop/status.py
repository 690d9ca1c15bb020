"""What a candidate does."""

from enum import IntEnum


class Status(IntEnum):
    """What a candidate does; arrays of statuses hold these integers, and compiled code knows the names.

    A node in contact without friction slips.

    Example
    -------
    >>> import numpy as np
    >>> status = np.array([0, 2, 1, 1])
    >>> int(np.sum(status == Status.SLIP)), int(np.sum(status != Status.FREE))
    (2, 3)
    """

    FREE = 0
    SLIP = 1
    STICK = 2
