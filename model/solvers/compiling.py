"""Says once that the loop is being compiled, which in a first run takes up to a minute in silence."""

import sys
from functools import cache
from typing import Any

from numba.core import event

PACKAGE = "model."


class Announcement(event.Listener):
    """Listens to numba; what is loaded from the disk compiles nothing, and is not announced."""

    said = False

    def on_start(self, event: Any) -> None:
        """Say it, if it is a function of this package that is to be compiled."""
        if not self.said and event.data["dispatcher"].py_func.__module__.startswith(PACKAGE):
            self.said = True
            print(
                "Compiling the contact loop, once for this machine; this takes up to a minute.",
                file=sys.stderr,
                flush=True,
            )

    def on_end(self, event: Any) -> None:
        """Nothing to say."""


@cache
def announce_compilation() -> None:
    """Have it said when something of this package must be compiled; only the first call does anything."""
    event.register("numba:compile", Announcement())
