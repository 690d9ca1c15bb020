"""Figures and films of bodies in motion, in the look of `model.figures`."""

from collections.abc import Iterable, Mapping, Sequence
from itertools import cycle
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure

from .figures import COLOUR_MAP, LOOKS, OUTLINE
from .files import write_aside
from .history import History


def bounce_figure(
    body: Any, snapshots: Mapping[float, np.ndarray], history: History, point: str, title: str = ""
) -> Figure:
    """Draw snapshots of a plane body above the histories of a point (figures 8 and 9 of the paper).

    Parameters
    ----------
    body : Body
        With `coordinates` (N, 2) and `cells` (n, k) in dolfinx's order.
    snapshots : dict of (N, 2)
        Displacements by time (s).
    history : History
        It has followed the point.
    point : str
        Name of the point; a dot in the snapshots.
    title : str
        Above the axes.
    """
    figure = plt.figure(figsize=(10, 5.6), layout="constrained")
    halves: Any = figure.subfigures(2, 1, height_ratios=[1, 1.9])
    top, bottom = halves
    axes = top.subplots()
    node = history.points[point]
    for time, displacement in snapshots.items():
        x = body.coordinates + displacement
        polygons = x[body.cells][:, OUTLINE[body.cells.shape[1]]]
        axes.add_collection(
            PolyCollection(list(polygons), facecolor="white", edgecolor="0.3", linewidth=0.25)
        )
        axes.plot(*x[node], "o", color=LOOKS[2]["color"], markersize=3)
        axes.text(x[:, 0].mean(), x[:, 1].max() + 0.06, f"{time:.2f} s", ha="center", fontsize="x-small")
    axes.axhline(0.0, color="black", linewidth=1)
    axes.set(aspect="equal", xlabel="x (m)", ylabel="y (m)")
    axes.autoscale_view()
    axes.set_ylim(-0.15, axes.get_ylim()[1] + 0.15)
    figure.suptitle(title)
    labels = {"u_y": "displacement (m)", "v_y": "velocity (m/s)", "f_y": "nodal force (N/m)"}
    for panel, (name, label), look in zip(bottom.subplots(1, 3), labels.items(), LOOKS):
        panel.plot(history["time"], history[f"{name}({point})"], color=look["color"], linewidth=1)
        panel.set(xlabel="t (s)", ylabel=label, title=f"${name[0]}_y$ of {point}")
        panel.grid(color="0.9", linewidth=0.6)
    return figure


def ledger_figure(histories: Mapping[str, History]) -> Figure:
    """Draw, for each run, its energies over time, and below what its integrator gained and lost.

    Parameters
    ----------
    histories : dict of History
        By title.
    """
    count = len(histories)
    figure, axes = plt.subplots(
        2, count, figsize=(5.2 * count, 6), sharex=True, sharey="row", layout="constrained", squeeze=False
    )
    for (upper, lower), (title, history) in zip(axes.T, histories.items()):
        time = history["time"]
        columns = ["kinetic", "strain", "potential", "friction", "damping", "total"]
        shown = [c for c in columns if np.abs(history[c]).max() > 0.0]
        for column, look in zip(shown, cycle(LOOKS)):
            label = {"friction": "lost to friction", "damping": "lost to damping"}.get(column, column)
            upper.plot(time, history[column], label=label, color=look["color"], linestyle=look["linestyle"])
        gained = history["total"] - history["total"][0]
        lower.plot(time, gained, color="black", label="gained by the integrator")
        lower.plot(
            time,
            history["contact_work"],
            color=LOOKS[1]["color"],
            linestyle="--",
            label="work of the contact forces",
        )
        lower.set_xlabel("t (s)")
        upper.set_title(title)
        for panel in (upper, lower):
            panel.grid(color="0.9", linewidth=0.6)
            panel.legend(frameon=False, fontsize="small")
    axes[0, 0].set_ylabel("energy (J/m)")
    axes[1, 0].set_ylabel("energy (J/m)")
    return figure


def film(
    path: str | Path,
    body: Any,
    frames: Iterable[tuple[str, np.ndarray, np.ndarray]],
    label: str,
    limits: tuple[float, float],
    window: Sequence[float],
    seconds: float = 0.06,
) -> None:
    """Write an animated GIF of a plane body coloured by a field of its cells.

    Parameters
    ----------
    path : str or Path
        NAME.gif.
    body : Body
    frames : iterable of (caption, displacement (N, 2), field (n,))
    label : str
        Name and unit of the field.
    limits : (lowest, highest)
        Of the colour map.
    window : (width, height)
        What is seen; the view follows the body along x.
    seconds : float
        From one frame to the next.
    """
    import imageio.v3 as imageio

    figure, axes = plt.subplots(figsize=(5.2, 3.6), layout="constrained")
    cells = PolyCollection([], cmap=COLOUR_MAP, edgecolor="0.3", linewidth=0.2)
    cells.set_clim(*limits)
    axes.add_collection(cells)
    axes.axhline(0.0, color="black", linewidth=1)
    axes.set(aspect="equal", xlabel="x (m)", ylabel="y (m)", ylim=(-0.05 * window[1], window[1]))
    figure.colorbar(cells, label=label, shrink=0.85)
    images = []
    for caption, displacement, values in frames:
        x = body.coordinates + displacement
        cells.set_verts(list(x[body.cells][:, OUTLINE[body.cells.shape[1]]]))
        cells.set_array(values)
        middle = x[:, 0].mean()
        axes.set_xlim(middle - window[0] / 2, middle + window[0] / 2)
        axes.set_title(caption, fontsize="medium")
        figure.canvas.draw()
        figure.set_layout_engine("none")  # the first frame's layout serves all
        images.append(np.array(figure.canvas.buffer_rgba())[..., :3])  # type: ignore[attr-defined]
    plt.close(figure)
    with write_aside(path) as aside:
        imageio.imwrite(aside, np.stack(images), extension=".gif", duration=1000 * seconds, loop=0)
