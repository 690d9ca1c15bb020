"""The sentence with which something that makes no sense is refused."""

from collections.abc import Callable
from typing import Any


def refusal(action: Callable, *arguments: Any) -> str:
    """Return what an action says as it refuses its arguments; if it accepts them, that is an AssertionError.

    >>> refusal(int, "ten")
    "invalid literal for int() with base 10: 'ten'"
    """
    try:
        action(*arguments)
    except (RuntimeError, ValueError) as error:
        return str(error)
    raise AssertionError(f"{arguments} must be refused.")
