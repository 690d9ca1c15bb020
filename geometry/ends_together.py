"""An error on one rank ends all ranks, with one sentence where all ranks have met the same."""

import sys
from time import sleep
from typing import Any

PAUSE = 1.0  # seconds that the others leave to rank 0 to say it


def end_together(comm: Any) -> None:
    """See to it that an exception which nobody catches ends all ranks of a communicator.

    What `Exchange.agree` raises, and whatever else says that it is `everybody`'s, rank 0 says in a sentence;
    of any other error the rank that met it shows all. So does Ctrl-C end all.
    """
    shown: Any = sys.excepthook
    if getattr(shown, "ends_all", False):
        return

    def hook(kind: Any, error: Any, trace: Any) -> None:
        if getattr(error, "everybody", False) or issubclass(kind, KeyboardInterrupt):
            if comm.rank == 0:
                print(f"{kind.__name__}: {error}".rstrip(": "), file=sys.stderr, flush=True)
            else:
                sleep(PAUSE)
        else:
            shown(kind, error, trace)
            sys.stderr.flush()
        comm.Abort(1)

    hook.ends_all = True  # type: ignore[attr-defined]
    sys.excepthook = hook
