"""Anderson's extrapolation of a fixed-point iteration x <- g(x) that converges slowly, or overshoots.

Source: D. G. Anderson, J. ACM 12 (1965); H. F. Walker and P. Ni, SIAM J. Numer. Anal. 49 (2011).
"""

from typing import Any

import numpy as np

from model.one_rank import ONE_RANK

# Of twelve scenes on round and wavy roads, with friction and without, the worst takes 19 iterations where 6
# or 10 are combined, 22 where 3 are. GROWTH and CLOSER are guards: none tells 1.2 from 5, or 0.1 from 0.6.
MEMORY = 5  # changes from one iteration to the next that are combined
GROWTH = 2.0  # a step so many times larger than the last ends the trust in them
DEPENDENT = 1e-12  # of changes of length 1, the square: those that add no more say nothing new
CLOSER = 0.3  # and they are trusted again when steps have come down to this part of the last good one


class Anderson:
    """Combines the last iterations so that their steps cancel as far as they can.

    Parameters
    ----------
    trusted : float
        Largest component of a step g(x) - x from which on the iteration is smooth enough to combine.
    ranks : OneRank or geometry.exchange.Exchange
        Who shares the components; the same is combined on all.
    """

    def __init__(self, trusted: float, ranks: Any = ONE_RANK):
        self.trusted, self.ranks = trusted, ranks
        self.forget()

    def forget(self) -> None:
        """Begin anew: what is iterated has changed."""
        self._steps: list[np.ndarray] = []  # changes of the step, each of length 1
        self._images: list[np.ndarray] = []  # and of the image
        self._before: tuple[np.ndarray, np.ndarray] | None = None
        self._last = np.inf

    def combine(self, step: np.ndarray, image: np.ndarray) -> np.ndarray:
        """Return where to go on from.

        Parameters
        ----------
        step : array
            What g changed, or that part of it which is to vanish.
        image : array
            g(x).
        """
        size = self.ranks.max(np.abs(step).max(initial=0.0))
        if self._before is not None and size > GROWTH * self._last:
            if self._steps:
                self.trusted = CLOSER * self._last
            self.forget()
        if self._before is not None:
            self._learn(step - self._before[0], image - self._before[1])
        self._before, self._last = (step, image), size
        if not self._steps or size >= self.trusted:
            return image
        changes = np.array(self._steps)
        squares, ways = np.linalg.eigh(self.ranks.sum(changes @ changes.T))
        ways = ways[:, squares > DEPENDENT * squares[-1]]
        wanted = self.ranks.sum(changes @ step.ravel())
        weights = ways @ ((ways.T @ wanted) / squares[-ways.shape[1] :])
        return image - (weights @ np.array(self._images)).reshape(image.shape)

    def _learn(self, step: np.ndarray, image: np.ndarray) -> None:
        """Keep what changed from the last iteration to this one."""
        length = float(np.sqrt(self.ranks.sum(float(np.vdot(step, step)))))
        if length > 0.0:
            self._steps = [*self._steps[1 - MEMORY :], step.ravel() / length]
            self._images = [*self._images[1 - MEMORY :], image.ravel() / length]
