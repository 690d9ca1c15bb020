"""Seconds spent in what is decorated, or within `with`."""

from contextlib import ContextDecorator
from time import perf_counter
from typing import Any, Self


class Stopwatch(ContextDecorator):
    """Adds up seconds; calls within calls count once.

    >>> watch = Stopwatch()
    >>> @watch
    ... def work(depth):
    ...     return work(depth - 1) if depth else "done"
    >>> work(3), watch.seconds > 0.0
    ('done', True)

    Attributes
    ----------
    seconds : float
        So far.
    """

    def __init__(self) -> None:
        self.seconds, self._depth, self._began = 0.0, 0, 0.0

    def __enter__(self) -> Self:
        """Start, unless it runs already."""
        if not self._depth:
            self._began = perf_counter()
        self._depth += 1
        return self

    def __exit__(self, *error: Any) -> None:
        """Stop when the outermost call ends."""
        self._depth -= 1
        if not self._depth:
            self.seconds += perf_counter() - self._began
