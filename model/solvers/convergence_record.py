"""What a solve records of itself, when it ends, and what it says when it does not converge."""

from collections.abc import Callable
from dataclasses import dataclass, field
from time import perf_counter
from typing import Any

import numpy as np
from tqdm import tqdm

from model.one_rank import ONE_RANK

IDLE = 100  # residual tests without progress that are enough
ASTRAY = 1e-5  # residual beyond which a displacement is not short of digits but wrong; 1e-7 were seen


class NotConverged(RuntimeError):
    """The solve ended above its tolerance.

    `residual`, `history`, `sweeps` and `cycles` say how far it came; `everybody`, whether all ranks met it.
    """

    def __init__(self, message: str, record: "Record"):
        super().__init__(message)
        self.everybody = record.ranks is not ONE_RANK
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
    causes : callable
        From the history to what may have gone wrong, for the message of NotConverged.
    floor : callable
        Residual that the rounding of the present displacement may leave.
    part : float
        Of the first residual, at which the solve may end as well.
    ranks : OneRank or geometry.exchange.Exchange
        Who solve together, and end together.

    Attributes
    ----------
    patience, fall : int, float
        Residual tests without progress that are enough, and the part of the last good residual that is
        progress; fewer, and less, for a correction that is exact.
    soon : int
        Tests without progress after which it is looked whether what is left is rounding; 0 for a correction
        that is exact.
    rounded : bool
        The solve has come as far as the digits of the displacement let it.
    """

    tolerance: float
    limit: int
    sweeps: Callable[[], int]
    progress: bool = True
    causes: Callable[[list[float]], list[str]] = lambda history: []
    floor: Callable[[], float] = lambda: 0.0
    part: float = 0.0
    history: list[float] = field(default_factory=list)
    cycles: int = 0
    began: float = field(default_factory=perf_counter)
    idle: int = 0
    patience: int = IDLE
    fall: float = 0.999
    soon: int = IDLE
    rounded: bool = False
    ranks: Any = ONE_RANK

    def __post_init__(self) -> None:
        """Open the bar, unseen for two seconds and wherever the output is not a terminal."""
        self.best = self.mark = min(self.history, default=np.inf)
        self.earlier = len(self.history)  # tests of the parts of the displacement that went before
        self.bar = tqdm(
            desc="contact", unit=" tests", delay=2, leave=False, disable=None if self.progress else True
        )

    def finished(self, residual: float) -> bool:
        """Note a residual; True when it is below the tolerance, or rounding lets it fall no further.

        Raises
        ------
        NotConverged
            If the residual is not a number, the limit is reached, or it has not fallen for `patience` tests.
        """
        self.history.append(residual)
        if len(self.history) == 1:
            self.tolerance = max(self.tolerance, self.part * residual)
        self.idle += 1
        self.best = min(self.best, residual)
        if residual < self.fall * self.mark:
            self.mark, self.idle = residual, 0
        self.bar.update()
        self.bar.set_postfix_str(f"residual {residual:.1e}", refresh=False)
        if residual <= self.tolerance:
            self.bar.close()
            return True
        if not np.isfinite(residual):
            self.give_up("the numbers overflowed: scale the units or check the matrix")
        if len(self.history) > self.limit:
            self.give_up(f"the limit of {self.limit} residual tests was reached")
        tests = len(self.history) - self.earlier
        if tests > 1 and self.idle < tests and self.idle >= self.soon:
            floor = self.floor()
            near = residual <= min(10.0 * floor, ASTRAY) or self.idle >= self.patience
            if near and floor >= 0.1 * self.tolerance:
                self.bar.close()
                self.rounded = True
                return True
        if self.idle >= self.patience:
            self.give_up(
                f"the residual has not fallen below {self.fall:g} of itself in {self.patience} tests"
            )
        return False

    def give_up(self, why: str) -> None:
        """Raise NotConverged with the residual, the counts, the reason and its likely causes."""
        self.bar.close()
        causes = self.causes(self.history)
        likely = "; likeliest causes: " + "; ".join(f"({k}) {c}" for k, c in enumerate(causes, 1))
        raise NotConverged(
            f"No convergence: {why}; natural residual {self.history[-1]:.2e} (best {self.best:.2e}) "
            f"against tolerance {self.tolerance:.1e} after {self.sweeps()} sweeps and {self.cycles} cycles"
            f"{likely if causes else ''}.",
            self,
        )
