"""What a solve records of itself, when it ends, and what it says when it does not converge."""

from collections.abc import Callable
from dataclasses import dataclass, field
from time import perf_counter

import numpy as np
from tqdm import tqdm


class NotConverged(RuntimeError):
    """The solve ended above its tolerance.

    `residual`, `history`, `sweeps` and `cycles` say how far it came.
    """

    def __init__(self, message: str, record: "Record"):
        super().__init__(message)
        self.residual = record.history[-1]
        self.history = np.array(record.history)
        self.sweeps, self.cycles = record.sweeps(), record.cycles


@dataclass
class Record:
    """Residual history and counts of one solve, its stopping test, and its progress bar.

    Parameters
    ----------
    tolerance : float
        Natural residual at which the solve ends.
    limit : int
        Residual tests before giving up.
    sweeps : callable
        Number of sweeps so far.
    progress : bool
        Show a bar on a terminal when the solve takes over two seconds.
    """

    tolerance: float
    limit: int
    sweeps: Callable[[], int]
    progress: bool = True
    history: list[float] = field(default_factory=list)
    cycles: int = 0
    began: float = field(default_factory=perf_counter)

    def __post_init__(self) -> None:
        """Open the bar, unseen for two seconds and wherever the output is not a terminal."""
        self.bar = tqdm(
            desc="contact", unit=" tests", delay=2, leave=False, disable=None if self.progress else True
        )

    def finished(self, residual: float) -> bool:
        """Note a residual; True when it is below the tolerance.

        Raises
        ------
        NotConverged
            If the residual is not a number, the limit is reached, or nothing has moved for a long time.
        """
        self.history.append(residual)
        self.bar.update()
        self.bar.set_postfix_str(f"residual {residual:.1e}", refresh=False)
        if residual <= self.tolerance:
            self.bar.close()
            return True
        if not np.isfinite(residual):
            self.give_up("the numbers overflowed: scale the units or check the matrix")
        if len(self.history) > self.limit:
            self.give_up(f"the limit of {self.limit} residual tests was reached")
        return False

    def give_up(self, why: str) -> None:
        """Raise NotConverged with the residual, the counts and the reason."""
        self.bar.close()
        raise NotConverged(
            f"No convergence: {why}; natural residual {self.history[-1]:.2e} "
            f"(best {np.nanmin(self.history):.2e}) against tolerance {self.tolerance:.1e} "
            f"after {self.sweeps()} sweeps and {self.cycles} cycles.",
            self,
        )
