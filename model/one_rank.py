"""What a rank does with numbers that many ranks share, where there is one rank: nothing."""

from typing import Any

import numpy as np


class OneRank:
    """Stands where `geometry.exchange.Exchange` stands on many ranks, and costs nothing.

    Examples
    --------
    >>> ONE_RANK.sum(2.0), ONE_RANK.any(True)
    (2.0, True)
    """

    def sum(self, value: Any) -> Any:
        """Return the sum over all ranks of a number or an array."""
        return value

    def max(self, value: float) -> float:
        """Return the largest value of all ranks."""
        return value

    def any(self, value: bool) -> bool:
        """Tell whether the value is true on any rank."""
        return value

    def agree(self, trouble: str) -> None:
        """Raise a ValueError if there is trouble."""
        if trouble:
            raise ValueError(trouble)

    def dot(self, x: np.ndarray, y: np.ndarray) -> float:
        """Return the inner product of x and y (N, d)."""
        return float(np.vdot(x, y))

    def stacked(self, rows: np.ndarray) -> np.ndarray:
        """Return the rows (m, ...) of all ranks, one rank's after the other's."""
        return rows

    def before(self, count: int) -> int:
        """Return the sum of what the ranks before this one count."""
        return 0

    def tall(self, rows: np.ndarray) -> np.ndarray:
        """Return rows (m, k) whose least squares problems are those of all ranks' rows."""
        return rows

    def first(self, value: Any) -> Any:
        """Return the value of the first rank."""
        return value

    def own(self, values: np.ndarray) -> np.ndarray:
        """Return what of nodal values (N, ...) belongs to nodes of this rank: each node's once."""
        return values

    def update(self, values: np.ndarray) -> None:
        """Give copies (N, ...) of other ranks' nodes their owners' values."""

    def add(self, values: np.ndarray) -> None:
        """Add to owners' values (N, ...) those of copies on other ranks."""


ONE_RANK = OneRank()
