"""Pictures that one lesson or study needs, in the look of `model.figures`."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from model.figures.figures import LOOKS


def panels_of_runs(
    runs: Mapping[str, Any],
    rows: Sequence[tuple[str, Callable[[Any], np.ndarray], np.ndarray, tuple[float, float] | None]],
    fine: np.ndarray,
) -> Figure:
    """Draw a column of panels for each run: quantities over time, the closed form behind them in grey.

    Parameters
    ----------
    runs : dict of History
        By title.
    rows : sequence of (label with unit, quantity of a run, closed form at the times `fine`, limits or None)
    fine : ndarray, shape (m,)
        Times of the closed form (s).
    """
    size = (2.5 * len(runs), 2.2 * len(rows))
    figure, axes = plt.subplots(
        len(rows), len(runs), figsize=size, sharex=True, sharey="row", layout="constrained", squeeze=False
    )
    for line, (label, quantity, exact, limits) in zip(axes, rows):
        for panel, run, look in zip(line, runs.values(), LOOKS):
            panel.plot(fine, exact, color="0.75", linewidth=3.5)
            panel.plot(run["time"], quantity(run), color=look["color"], linewidth=1)
            panel.grid(color="0.9", linewidth=0.6)
        line[0].set(ylabel=label, ylim=limits)
    for panel, title in zip(axes[0], runs):
        panel.set_title(title, fontsize="medium")
    for panel in axes[-1]:
        panel.set_xlabel("t (s)")
    return figure
