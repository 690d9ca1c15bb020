"""How a script ends when something goes wrong: in one sentence where the error is an expected one."""

import sys
from pathlib import Path
from typing import Any

PACKAGES = {"model", "forms", "geometry"}  # whose errors are sentences
EXPECTED = (ValueError, OSError, ImportError)


def end_in_one_sentence(kind: type[BaseException], error: BaseException, trace: Any) -> None:
    """Tell an expected error in one sentence on stderr, and any other as Python does.

    For `sys.excepthook`. The exit code is 1, or 130 after Ctrl-C; `python -X dev` shows the traceback all the same.
    """
    ours = any(base.__module__.split(".")[0] in PACKAGES for base in kind.__mro__)
    if issubclass(kind, KeyboardInterrupt):
        print("\nInterrupted; the files written so far are whole.", file=sys.stderr)
        raise SystemExit(130)
    if (ours or issubclass(kind, EXPECTED)) and not sys.flags.dev_mode:
        print(f"{Path(sys.argv[0]).stem}: {error}", file=sys.stderr)
        raise SystemExit(1)
    sys.__excepthook__(kind, error, trace)
