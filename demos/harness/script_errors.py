"""How a script ends when something goes wrong: in one sentence where the error is an expected one."""

import signal
import sys
from collections.abc import Callable
from pathlib import Path
from traceback import walk_stack
from types import FrameType
from typing import Any

PACKAGES = {"model", "forms", "geometry"}  # whose errors are sentences
EXPECTED = (ValueError, OSError, ImportError)
SOON = 0.05  # s
UNREADY = "numba.core.serialize"  # compiled code calls it, and takes for granted that it returns


def end_in_one_sentence() -> Callable[[], None]:
    """Tell errors on stderr, an expected one in one sentence, any other as Python does; return what undoes it.

    The exit code is 1, or 130 after Ctrl-C; `python -X dev` shows the traceback all the same.
    """
    hooks, handlers = (sys.excepthook, sys.unraisablehook), {}
    sys.excepthook = _tell
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        sys.unraisablehook = _not_lost
        handlers = {number: signal.signal(number, _interrupt) for number in (signal.SIGINT, signal.SIGALRM)}

    def undo() -> None:
        if sys.excepthook is _tell:
            sys.excepthook, sys.unraisablehook = hooks
            if handlers:
                signal.setitimer(signal.ITIMER_REAL, 0.0)  # nobody will listen
            for number, handler in handlers.items():
                signal.signal(number, handler)

    return undo


def _tell(kind: type[BaseException], error: BaseException, trace: Any) -> None:
    """Tell an error; for `sys.excepthook`."""
    ours = any(base.__module__.split(".")[0] in PACKAGES for base in kind.__mro__)
    if issubclass(kind, KeyboardInterrupt):
        print("\nInterrupted; the files written so far are whole.", file=sys.stderr)
        raise SystemExit(130)
    if (ours or issubclass(kind, EXPECTED)) and not sys.flags.dev_mode:
        print(f"{Path(sys.argv[0]).stem}: {error}", file=sys.stderr)
        raise SystemExit(1)
    sys.__excepthook__(kind, error, trace)


def _interrupt(_number: int, frame: FrameType | None) -> None:
    """Raise KeyboardInterrupt, but not where compiled code would end in a segmentation fault by it."""
    if any(inner.f_globals.get("__name__") == UNREADY for inner, _ in walk_stack(frame)):
        signal.setitimer(signal.ITIMER_REAL, SOON)
    else:
        raise KeyboardInterrupt


def _not_lost(lost: Any) -> None:
    """Ask again after a Ctrl-C that a destructor or a callback has swallowed; for `sys.unraisablehook`."""
    if issubclass(lost.exc_type, KeyboardInterrupt):
        signal.setitimer(signal.ITIMER_REAL, SOON)
    else:
        sys.__unraisablehook__(lost)
