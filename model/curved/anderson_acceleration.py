"""Anderson's extrapolation of a fixed-point iteration x <- g(x) that converges slowly, or overshoots.

Source: D. G. Anderson, J. ACM 12 (1965); H. F. Walker and P. Ni, SIAM J. Numer. Anal. 49 (2011).
"""

from typing import Any

import numpy as np

from model.one_rank import ONE_RANK

# Of twelve scenes on round and wavy roads, with friction and without, the worst takes 19 iterations where 6
# or 10 are combined, 22 where 3 are. GROWTH and CLOSER are guards: none tells 1.2 from 5, or 0.1 from 0.6.
MEMORY = 6  # iterations that are combined
GROWTH = 2.0  # a step so many times larger than the last ends the trust in them
DEPENDENT = 1e-8  # square root of rounding: steps whose differences add no more say nothing new
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
        self._steps: list[np.ndarray] = []
        self._images: list[np.ndarray] = []
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
        if self._steps and size > GROWTH * self._last:
            if len(self._steps) > 1:
                self.trusted = CLOSER * self._last
            self.forget()
        self._last = size
        self._steps = [*self._steps[1 - MEMORY :], step]
        self._images = [*self._images[1 - MEMORY :], image]
        if len(self._steps) == 1 or size >= self.trusted:
            return image
        changes = np.stack([(step - s).ravel() for s in self._steps[:-1]] + [step.ravel()], axis=1)
        changes = self.ranks.tall(changes)
        weights = np.linalg.lstsq(changes[:, :-1], changes[:, -1], rcond=DEPENDENT)[0]
        return image - sum(w * (image - i) for w, i in zip(weights, self._images[:-1], strict=True))
