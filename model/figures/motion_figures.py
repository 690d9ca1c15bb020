"""Figures and films of bodies in motion, in the style of `model.figures.figures`."""

from collections.abc import Iterable, Mapping, Sequence
from itertools import cycle
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure

from model.atomic_file import write_aside
from model.figures.figures import COLOUR_MAP, STYLES, outlines
from model.recording.history import History


def bounce_figure(
    body: Any,
    snapshots: Mapping[float, np.ndarray],
    histories: Mapping[str, History],
    point: str,
    touch: float,
    title: str = "",
) -> Figure:
    """Draw snapshots of a plane body above the histories of a point (figures 8 and 9 of the paper).

    Parameters
    ----------
    body : Body
        With `coordinates` (N, 2) and `cells` (n, k) in dolfinx's order.
    snapshots : dict of (N, 2)
        Displacements by time (s).
    histories : dict of History
        By label, one to three, which have followed the point; the first is drawn in grey below the others.
    point : str
        Name of the point; a dot in the snapshots.
    touch : float
        Time at which the point should touch (s), a vertical line.
    title : str
        Above the axes.

    Examples
    --------
    >>> from forms import Elasticity, Isotropic
    >>> from geometry import Body, Plane, rectangle
    >>> from model import History, MovingBody, Newmark, bounce_figure, integrate
    >>> elasticity = Elasticity(Body.from_grid(rectangle(2.0, 1.0, 4, 2)), Isotropic(E=1e4, nu=0.3))
    >>> weight = elasticity.body_force((0.0, -10.0))
    >>> scheme = Newmark(MovingBody.from_forms(elasticity, 1.0, weight, Plane(), "bottom"), dt=0.001)
    >>> state = scheme.start()
    >>> history = History(scheme, state, {"A": 0})
    >>> for state in integrate(scheme, state, 5, history):
    ...     pass
    >>> snapshots = {0.0: scheme.start().displacement, state.time: state.displacement}
    >>> figure = bounce_figure(elasticity.body, snapshots, {"Newmark": history}, "A", touch=0.0)
    >>> len(figure.axes) > 1
    True
    """
    figure = plt.figure(figsize=(10, 5.6), layout="constrained")
    halves: Any = figure.subfigures(2, 1, height_ratios=[1, 1.9])
    top, bottom = halves
    axes = top.subplots()
    node = next(iter(histories.values())).points[point]
    for time, displacement in snapshots.items():
        x = body.coordinates + displacement
        polygons = x[outlines(body.cells)]
        axes.add_collection(
            PolyCollection(list(polygons), facecolor="white", edgecolor="0.3", linewidth=0.25)
        )
        axes.plot(*x[node], "o", color=STYLES[2]["color"], markersize=3)
        axes.text(x[:, 0].mean(), x[:, 1].max() + 0.06, f"{time:.2f} s", ha="center", fontsize="x-small")
    axes.axhline(0.0, color="black", linewidth=1)
    axes.set(aspect="equal", xlabel="x (m)", ylabel="y (m)")
    axes.autoscale_view()
    axes.set_ylim(-0.15, axes.get_ylim()[1] + 0.15)
    figure.suptitle(title)
    labels = {"u_y": "displacement (m)", "v_y": "velocity (m/s)", "f_y": "nodal force (N/m)"}
    for panel, (name, ylabel) in zip(bottom.subplots(1, 3), labels.items()):
        for label, shade, dash in zip(histories, ("0.6", "black", "0.3"), ("-", "-", "--")):
            times, values = histories[label]["time"], histories[label][f"{name}({point})"]
            panel.plot(times, values, color=shade, linestyle=dash, linewidth=1.1, label=label)
        panel.axvline(touch, color=STYLES[2]["color"], linestyle=":", label=f"{touch:.3f} s, free fall")
        panel.set(xlabel="t (s)", ylabel=ylabel, title=f"${name[0]}_y$ of {point}")
        panel.grid(color="0.9", linewidth=0.6)
    figure.legend(*panel.get_legend_handles_labels(), loc="outside lower center", ncols=4, frameon=False)
    return figure


def ledger_figure(histories: Mapping[str, History]) -> Figure:
    """Draw, for each run, its energies over time, and below what its integrator gained and lost.

    Parameters
    ----------
    histories : dict of History
        By title.

    Examples
    --------
    >>> from forms import Elasticity, Isotropic
    >>> from geometry import Body, Plane, rectangle
    >>> from model import History, MovingBody, Newmark, ledger_figure, integrate
    >>> elasticity = Elasticity(Body.from_grid(rectangle(2.0, 1.0, 4, 2)), Isotropic(E=1e4, nu=0.3))
    >>> weight = elasticity.body_force((0.0, -10.0))
    >>> scheme = Newmark(MovingBody.from_forms(elasticity, 1.0, weight, Plane(), "bottom"), dt=0.001)
    >>> state = scheme.start()
    >>> history = History(scheme, state, {"A": 0})
    >>> for state in integrate(scheme, state, 5, history):
    ...     pass
    >>> len(ledger_figure({"Newmark": history}).axes)
    2
    """
    count = len(histories)
    figure, axes = plt.subplots(
        2, count, figsize=(5.2 * count, 6), sharex=True, sharey="row", layout="constrained", squeeze=False
    )
    for (upper, lower), (title, history) in zip(axes.T, histories.items()):
        time = history["time"]
        columns = ["kinetic", "strain", "potential", "friction", "damping", "total"]
        for column, style in zip(columns, cycle(STYLES)):
            label = {"friction": "lost to friction", "damping": "lost to damping"}.get(column, column)
            if np.abs(history[column]).max() > 0.0:
                line = {"color": style["color"], "linestyle": style["linestyle"]}
                upper.plot(time, history[column], label=label, **line)
        gained = history["total"] - history["total"][0]
        lower.plot(time, gained, color="0.7", linewidth=3.5, label="gained by the integrator")
        work = {"color": "black", "linewidth": 1, "linestyle": "--", "label": "work of the contact forces"}
        lower.plot(time, history["contact_work"], **work)
        lower.set_xlabel("t (s)")
        upper.set_title(title)
        upper.legend(frameon=False, fontsize="small", loc="center")
        for panel in (upper, lower):
            panel.grid(color="0.9", linewidth=0.6)
    axes[0, 0].set_ylabel("energy (J/m)")
    axes[1, 0].set_ylabel("energy since the start (J/m)")
    lines = axes[1, 0].get_legend_handles_labels()
    figure.legend(*lines, loc="outside lower center", ncols=2, frameon=False, fontsize="small")
    return figure


def force_figure(histories: Mapping[str, History], axis: str = "y") -> Figure:
    """Draw the force of the road on a body against time, a panel for each run.

    Parameters
    ----------
    histories : dict of History
        By title.
    axis : str
        Component.

    Examples
    --------
    >>> from forms import Elasticity, Isotropic
    >>> from geometry import Body, Plane, rectangle
    >>> from model import History, MovingBody, Newmark, force_figure, integrate
    >>> elasticity = Elasticity(Body.from_grid(rectangle(2.0, 1.0, 4, 2)), Isotropic(E=1e4, nu=0.3))
    >>> weight = elasticity.body_force((0.0, -10.0))
    >>> scheme = Newmark(MovingBody.from_forms(elasticity, 1.0, weight, Plane(), "bottom"), dt=0.001)
    >>> state = scheme.start()
    >>> history = History(scheme, state, {"A": 0})
    >>> for state in integrate(scheme, state, 5, history):
    ...     pass
    >>> len(force_figure({"Newmark": history}).axes)
    1
    """
    count = len(histories)
    figure, axes = plt.subplots(
        count,
        1,
        figsize=(10, 1.25 * count + 0.8),
        sharex=True,
        sharey=True,
        layout="constrained",
        squeeze=False,
    )
    for panel, (title, history) in zip(axes[:, 0], histories.items()):
        panel.plot(history["time"], history[f"force_{axis}"], color="black", linewidth=0.9)
        panel.text(0.01, 0.82, title, transform=panel.transAxes)
        panel.grid(color="0.9", linewidth=0.6)
    panel.set_xlabel("t (s)")
    figure.supylabel("force of the road (N/m)", fontsize="medium")
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

    Examples
    --------
    >>> from forms import Elasticity, Isotropic
    >>> from geometry import Body, Plane, rectangle
    >>> from model import History, MovingBody, Newmark, film, integrate
    >>> elasticity = Elasticity(Body.from_grid(rectangle(2.0, 1.0, 4, 2)), Isotropic(E=1e4, nu=0.3))
    >>> weight = elasticity.body_force((0.0, -10.0))
    >>> scheme = Newmark(MovingBody.from_forms(elasticity, 1.0, weight, Plane(), "bottom"), dt=0.001)
    >>> state = scheme.start()
    >>> history = History(scheme, state, {"A": 0})
    >>> for state in integrate(scheme, state, 5, history):
    ...     pass
    >>> import numpy as np
    >>> frames = [("start", 0.0 * state.displacement, np.zeros(8)), ("end", state.displacement, np.ones(8))]
    >>> film("block.gif", elasticity.body, frames, "a field (MPa)", (0.0, 1.0), (3.0, 2.0))
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
        cells.set_verts(list(x[outlines(body.cells)]))
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
