"""Pictures that one lesson or study needs, in the style of `model.figures`."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure

from model import Status
from model.figures.contact_map import MARKS, contact_map, cut_figure
from model.figures.figures import (
    COLOUR_MAP,
    STYLES,
    body_picture,
    new_figure,
    outlines,
    pressure_figure,
    stick_slip_figure,
)
from model.results.body_on_road import von_mises
from model.results.xdmf import on_body


def patch_figure(
    patch: Any, exact: Mapping[str, Callable[[np.ndarray], np.ndarray]], half_width: float, title: str
) -> Figure:
    """Draw the pressure of a `Patch`, and its shear traction if there is any, beside closed forms by label."""
    computed = {"p": patch.p} | ({"tau": patch.tau} if patch.tau.any() else {})
    return pressure_figure(patch.x, computed, exact, half_width, title)


def traction_figure(
    patch: Any,
    mu: float,
    exact: Mapping[str, Callable[[np.ndarray], np.ndarray]],
    half_width: float,
    title: str,
    sticks: tuple[float, float] | None = None,
    slip: np.ndarray | None = None,
) -> Figure:
    """Draw the shear traction of a `Patch` under mu p; `sticks` (from, to) is that of its nodes if not given."""
    sticks = patch.zone(Status.STICK) if sticks is None else sticks
    return stick_slip_figure(patch.x, abs(patch.tau), mu * patch.p, exact, sticks, half_width, slip, title)


def contact_zone(pressed: Any, solution: Any, centre: tuple[float, float], width: float) -> Figure | None:
    """Draw a plane body in contact, deformed, with von Mises' stress, and the contact zone magnified (mm)."""
    u, label = pressed.displacement(solution), "von Mises stress (MPa)"
    stress = von_mises(pressed.system.stress(u))
    return body_picture(pressed.system.body, u, stress, label, centre, width, "The contact zone")


def lines_figure(
    lines: Mapping[str, tuple[np.ndarray, np.ndarray]],
    xlabel: str,
    ylabel: str,
    title: str,
    levels: Mapping[str, float] | None = None,
) -> Figure:
    """Draw lines (x, y) by label, with marks where there are several, and levels in grey by label."""
    figure, axes = new_figure(xlabel, ylabel, title)
    for style, (label, (x, y)) in zip(STYLES, lines.items()):
        marks = {} if len(lines) > 1 else {"marker": "", "linewidth": 1}
        axes.plot(x, y, label=label, **(style | {"markersize": 4} | marks))
    for label, level in (levels or {}).items():
        axes.axhline(level, color="0.5", linestyle="--", label=label)
    axes.legend(frameon=False)
    return figure


def panels_over(
    x: np.ndarray, panels: Mapping[str, Mapping[str, np.ndarray]], xlabel: str, part: slice = slice(None)
) -> Figure:
    """Draw panels side by side, by the label of their y axis, each with lines over x by label; `part` of them."""
    size = (3.5 * len(panels), 3.2)
    figure, axes = plt.subplots(1, len(panels), figsize=size, layout="constrained", squeeze=False)
    for panel, (ylabel, lines) in zip(axes[0], panels.items()):
        for dash, (label, y) in zip(("-", "--", ":", "-."), lines.items()):
            panel.plot(x[part], y[part], dash, color="black", label=label)
        panel.set(xlabel=xlabel, ylabel=ylabel)
        if len(lines) > 1:
            panel.legend()
    return figure


def presses_or_hangs(loads: np.ndarray, answers: Sequence[tuple[float, float]], g0: float) -> Figure:
    """Draw gap and force of the road of a node on a spring, (u, p) by load, and what one makes of the other."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.2), layout="constrained")
    u, p = np.transpose(answers)
    left.plot(loads, g0 + u, "k-", label="gap $g$ (m)")
    left.plot(loads, p, "k--", label="force of the road $p$ (N)")
    left.set(xlabel="load $b$ (N), upwards positive", title="hangs, or presses: a kink between")
    right.plot(g0 + u, p, "k-", lw=2)
    right.set(
        xlabel="gap $g$ (m)", ylabel="force of the road $p$ (N)", title="(5), (6) and (b) in one picture"
    )
    left.legend()
    return figure


def sticks_then_slips(pulls: np.ndarray, u: np.ndarray, force: np.ndarray, mu: float) -> Figure:
    """Draw how a node is pulled along a road: its forces (m, 2) beside the limit of friction, its displacements."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.2), layout="constrained")
    left.plot(pulls, force[:, 0], "k-", label=r"$\tau$")
    left.plot(pulls, -mu * force[:, 1], "--", color="0.5", lw=3, label=r"$-\mu p$")
    left.set(xlabel="pull along the road (N)", ylabel="force of the road (N)", title="sticks, then slips")
    right.plot(pulls, u[:, 0], "k-", label="$u_t$")
    right.set(xlabel="pull along the road (N)", ylabel="displacement (m)", title="moves only where it slips")
    left.legend()
    right.legend()
    return figure


def slip_in_a_rod(rod: Any, u: np.ndarray, tau: np.ndarray, exact: np.ndarray, limit: float) -> Figure:
    """Draw displacement and friction (N/m) along a `Rod` that is pulled, beside the closed form and the limit."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.2), layout="constrained")
    left.plot(rod.x, u, "ko", ms=4, label="loop")
    left.plot(rod.x, exact, "-", color="0.4", lw=1, zorder=0, label="closed form (a)")
    left.set(xlabel="x (m)", ylabel="u (m)", title="what moves")
    right.plot(rod.x, -tau / rod.share, "ko", ms=4, label="loop")
    right.axhline(limit, color="0.5", linestyle="--", label=r"$\mu w$")
    right.set(xlabel="x (m)", ylabel="friction (N/m)", title="slips where the limit is reached")
    left.legend()
    right.legend(loc="center left")
    return figure


def rod_that_hangs(
    y: np.ndarray,
    answer: tuple[np.ndarray, np.ndarray],
    closed: tuple[np.ndarray, np.ndarray],
    gaps: np.ndarray,
    forces: np.ndarray,
) -> Figure:
    """Draw a hanging rod: displacement and stress over height (m,), and the road's pressure over the gap.

    The answer has displacements (m,) and the stress of elements (m - 1,), the closed form both at the heights;
    the forces (gaps, 2) are computed and exact.
    """
    (u, stress), (exact, sigma) = answer, closed
    figure, panels = plt.subplots(1, 3, figsize=(11, 3.4), layout="constrained")
    panels[0].plot(1e3 * u, y, "ko", ms=4, label="by hand")
    panels[0].plot(1e3 * exact, y, "-", color="0.4", lw=1, zorder=0, label="closed form (a)")
    panels[0].set(xlabel="u (mm)", ylabel="height y (m)", title="comes down to the road")
    panels[1].stairs(1e-3 * stress, y, orientation="horizontal", color="k", lw=1.5, label="by hand")
    panels[1].plot(1e-3 * sigma, y, "-", color="0.4", lw=1, label="closed form (a)")
    panels[1].axvline(0, color="0.7", lw=0.8)
    panels[1].set(xlabel=r"$\sigma$ (kPa)", ylabel="height y (m)", title="compressed below, stretched above")
    panels[2].plot(1e3 * gaps, 1e-3 * forces[:, 0], "ko", ms=4, label="by hand")
    panels[2].plot(1e3 * gaps, 1e-3 * forces[:, 1], "-", color="0.4", lw=1, zorder=0, label="closed form (a)")
    panels[2].set(xlabel="gap $g_0$ (mm)", ylabel="pressure of the road (kPa)", title="or does not touch")
    for panel in panels:
        panel.legend()
    return figure


def loops_of_force(
    Q: np.ndarray,
    u: np.ndarray,
    exact: np.ndarray,
    x: np.ndarray,
    shear: Mapping[str, np.ndarray],
    limit: float,
) -> Figure:
    """Draw force over displacement of a path beside the closed form, and friction (N/m) along a rod by the way there."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
    left.plot(exact, Q, "-", color="0.4", lw=1, label="closed form (a), (b)")
    left.plot(u, Q, "ko", ms=4, label="computed")
    left.set(xlabel="displacement of the end (m)", ylabel="pull Q (N)", title="to and fro")
    left.locator_params(axis="x", nbins=5)
    for style, (name, values) in zip(STYLES, shear.items()):
        right.plot(x, values, label=name, markersize=4, markevery=2, **style)
    right.axhline(limit, color="0.5", linestyle=":", label=r"$\mu w$")
    right.set(xlabel="x (m)", ylabel="friction (N/m)", title="the same loads in the end")
    left.legend()
    right.legend(loc="upper left")
    return figure


def string_on_the_road(string: Any, u: np.ndarray, p: np.ndarray, history: np.ndarray) -> Figure:
    """Draw a `String` on its road, displacements (m) and forces (N) beside the closed form, and the sweeps' errors."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.4), layout="constrained")
    x, d, L = string.x, -string.lower[0], string.x[0] + string.x[-1]
    left.fill_between([0, L], -d, -1.25 * d, color="0.85", label="road")
    left.plot([0, *x, L], [0, *u, 0], "ko", ms=4, label="loop")
    left.plot([0, *x, L], [0, *string.exact, 0], "-", color="0.4", lw=1, zorder=0, label="closed form (c)")
    left.quiver(x, np.full(x.size, -1.25 * d), 0 * x, p, scale=4.0, width=0.004, color="0.35")
    left.set(xlabel="x (m)", ylabel="u (m)", title="the string, and the forces of the road")
    left.legend(loc="upper center")
    right.semilogy(np.maximum(history, 1e-17), color="k")
    right.set(xlabel="sweeps", ylabel="error of equilibrium (N)", title="downhill, but slowly")
    return figure


def sweeps_and_cycles(sweeps: Mapping[int, Sequence[float]], cycles: Mapping[int, Sequence[float]]) -> Figure:
    """Draw what a sweep leaves of a wave, and the residuals of sweeps and cycles by the number of nodes."""
    figure, axes = plt.subplots(1, 3, figsize=(11, 3.4), layout="constrained")
    theta, waves = np.linspace(0, np.pi, 200), r"$\theta$: phase from node to node"
    axes[0].plot(theta, np.abs(np.exp(1j * theta) / (2 - np.exp(-1j * theta))), "k-")
    axes[0].axvspan(np.pi / 2, np.pi, color="0.9")
    axes[0].text(2.35, 0.8, "a coarser mesh\ncannot see these", ha="center", fontsize=9)
    axes[0].set(xlabel=waves, ylabel="what a sweep leaves, $|G|$", title="eq. (a)", ylim=(0, 1.02))
    for n, style in zip(sweeps, ("-", "--", "-.", ":")):
        line = {"color": "k", "ls": style, "label": f"{n} nodes"}
        axes[1].semilogy(sweeps[n], **line)
        axes[2].semilogy(range(1, len(cycles[n]) + 1), cycles[n], marker="o", ms=3, **line)
    axes[1].set(xlabel="sweeps", ylabel="residual", title="the loop alone", xscale="log")
    axes[2].set(xlabel="cycles, two sweeps of the fine string each", ylabel="residual")
    axes[2].set(title="truncated multigrid")
    axes[1].legend(fontsize=8)
    axes[2].legend(fontsize=8)
    return figure


def what_a_cycle_does(
    x: np.ndarray, errors: Mapping[str, np.ndarray], histories: Mapping[int, Sequence[float]]
) -> Figure:
    """Draw errors (m) along a string by name, and residuals over cycles by the number of nodes."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 3.4), layout="constrained")
    for style, (name, error) in zip(STYLES, errors.items()):
        left.plot(x, 1e3 * error, label=name, **(style | {"marker": ""}))
    left.set(xlabel="x (m)", ylabel="error (mm)", title="rough, smooth, gone")
    for style, (n, history) in zip(STYLES, histories.items()):
        right.semilogy(range(1, len(history) + 1), history, label=f"{n} nodes", markersize=4, **style)
    right.set(xlabel="cycles", ylabel="residual (loads of a node)", title="as many on each mesh")
    left.legend()
    right.legend(fontsize=8)
    return figure


def panels_of_impacts(runs: Mapping[str, Any], exact: Any) -> Figure:
    """Draw position, pressure and energy of a rod that strikes a wall, the closed form behind them in grey.

    Parameters
    ----------
    runs : dict of History
        By title, a column each; they follow the node "end".
    exact : RodImpact
    """
    fine = np.linspace(0.0, 3.0, 1201)
    rows: list[tuple[str, Callable[[Any], np.ndarray], np.ndarray, tuple[float, float] | None]] = [
        ("u(0, t) (m)", lambda run: run["u_x(end)"], exact.displacement(0.0, fine), (-0.03, 0.55)),
        ("pressure (Pa)", lambda run: run["force_x"], exact.contact_pressure(fine), (-0.1, 1.3)),
        ("energy (J)", lambda run: run["kinetic"] + run["strain"], exact.energy + 0 * fine, None),
    ]
    size = (2.5 * len(runs), 2.2 * len(rows))
    figure, axes = plt.subplots(
        len(rows), len(runs), figsize=size, sharex=True, sharey="row", layout="constrained", squeeze=False
    )
    for line, (label, quantity, exact, limits) in zip(axes, rows):
        for panel, run, style in zip(line, runs.values(), STYLES):
            panel.plot(fine, exact, color="0.75", linewidth=3.5)
            panel.plot(run["time"], quantity(run), color=style["color"], linewidth=1)
            panel.grid(color="0.9", linewidth=0.6)
        line[0].set(ylabel=label, ylim=limits)
    for panel, title in zip(axes[0], runs):
        panel.set_title(title, fontsize="medium")
    for panel in axes[-1]:
        panel.set_xlabel("t (s)")
    return figure


def area_and_friction(paths: Mapping[str, Any], mu: float) -> Figure:
    """Draw the real contact area while bodies are pressed, and the friction while they are dragged.

    Parameters
    ----------
    paths : dict of Dragged
        By title; pressures in MPa, ways in mm.
    mu : float
        Coulomb's coefficient, a line.
    """
    figure, (left, right) = plt.subplots(1, 2, figsize=(9.6, 3.8), layout="constrained")
    for style, (name, path) in zip(STYLES, paths.items()):
        pressing = path.way == 0
        kept = {"label": name, "markerfacecolor": "none", **style}
        left.plot(np.append(0, path.pressure[pressing]), np.append(0, path.area[pressing]), **kept)
        few = max(1, np.count_nonzero(~pressing) // 12)
        right.plot(path.way[~pressing], path.friction[~pressing], markevery=few, **kept)
    left.set(xlabel="mean pressure (MPa)", ylabel="real contact area (of the blocks)")
    right.set(xlabel="way of the road (mm)", ylabel="tangential force (of the load)")
    right.axhline(mu, color="0.5", linestyle=":", label=r"$\mu$")
    left.legend(frameon=False)
    right.legend(frameon=False)
    return figure


def stick_slip_along_the_road(pressed: Any, path: Any, step: int, stress: np.ndarray, profile: Any) -> Figure:
    """Draw a plane body at one step of a path, its road, and below what sticks and slips on it in every step.

    Parameters
    ----------
    pressed : BodyOnRoad
    path : Dragged
    step : int
        Of the upper picture.
    stress : ndarray, shape (cells,)
        Von Mises' then (MPa).
    profile : SmoothRoad
        The road before it moves.
    """
    body, x = pressed.elasticity.body, pressed.points[:, 0]
    moved = body.coordinates + pressed.displacement(path.solutions[step])
    figure, panels = plt.subplots(3, 1, figsize=(8, 8), layout="constrained", height_ratios=[4, 1, 4])
    colours = PolyCollection(list(moved[outlines(body.cells)]), cmap=COLOUR_MAP, edgecolor="face")
    colours.set_array(stress)
    panels[0].add_collection(colours)
    figure.colorbar(colours, ax=panels[0], label="von Mises stress (MPa)")
    fine = np.linspace(x.min() - 2, x.max() + 5, 2000)
    panels[0].fill_between(
        fine, profile.height(fine[:, None] + path.way[step]), -2.0, color="0.8", linewidth=0
    )
    panels[1].plot(fine, profile.height(fine[:, None]), color="black")
    nodes = pressed.problem.contact_nodes
    for kind, (colour, name) in MARKS.items():
        here = pressed.nodes[path.solutions[step].status == kind]
        panels[0].plot(*moved[here].T, "o", color=colour, markersize=4, label=name)
        for way, solution in zip(path.way, path.solutions):
            on_road = (x + solution.displacement[nodes, 0] + way)[solution.status == kind]
            panels[2].plot(on_road, np.full(on_road.shape, way), ".", color=colour, markersize=5)
    panels[0].set(aspect="equal", xlim=(fine[0], fine[-1]), ylim=(-2, moved[:, 1].max() + 0.5))
    panels[0].set(xlabel="x (mm)", ylabel="y (mm)")
    panels[0].legend(frameon=False, loc="upper right")
    panels[1].set(xlim=(fine[0], fine[-1]), ylabel="height (mm)")
    panels[2].set(xlim=(fine[0], fine[-1]), xlabel="x on the road (mm)", ylabel="way of the road (mm)")
    return figure


def pushed_sphere(pressed: Any, solution: Any, hertz: Any, mindlin: Any, title: str) -> dict[str, Figure]:
    """Draw a half ball on a plane that is pushed along x: contact map, tractions on y = 0, and the cut there.

    Parameters
    ----------
    pressed : BodyOnRoad
        Its boundary is "sphere", its cut "y0".
    solution : Solution
    hertz : HertzSphere
    mindlin : MindlinSphere
    title : str
    """
    body, u = pressed.elasticity.body, pressed.displacement(solution)
    p, tau = pressed.pressure(solution), -pressed.traction(solution)[:, 0]
    p_map, tau_map, status = (on_body(len(u), pressed.nodes, each) for each in (p, tau, solution.status))
    maps = {"pressure (MPa)": p_map, "traction along the push (MPa)": tau_map}
    line, exact = np.abs(pressed.points[:, 1]) < 1e-9, {"Hertz": hertz.pressure, "Mindlin": mindlin.traction}
    computed, above = {"p": p[line], "tau": tau[line]}, f"On the line y = 0, {title}"
    stress, cut = pressed.elasticity.von_mises(u), "The cut through the middle, y = 0"
    return {
        "stick_and_slip": contact_map(body, "sphere", maps, status, 1.3 * hertz.a, mirror=[1], title=title),
        "traction": pressure_figure(pressed.points[line, 0], computed, exact, hertz.a, above),
        "deformed": cut_figure(body, "y0", u, stress, "von Mises stress (MPa)", (0.0, 0.5), 2.5, cut),
    }


def stick_slip_on_a_surface(pressed: Any, path: Any, step: int, surface: Any, title: str) -> Figure:
    """Draw what sticks and slips at one step of a path on the contours of a rough surface.

    Parameters
    ----------
    pressed : BodyOnRoad
        In space.
    path : Dragged
    step : int
    surface : SmoothRoad
        The road before it moves.
    title : str
    """
    solution = path.solutions[step]
    on_road = (pressed.points + solution.displacement[pressed.problem.contact_nodes])[:, :2]
    on_road[:, 0] += path.way[step]
    sides = [np.linspace(v.min() - 3, v.max() + 3, 121) for v in on_road.T]
    across = np.stack(np.meshgrid(*sides, indexing="ij"), axis=-1)
    heights = surface.height(across.reshape(-1, 2)).reshape(across.shape[:2])
    figure, axes = new_figure("x on the road (mm)", "y (mm)", title, (8, 5))
    shades = axes.contourf(across[..., 0], across[..., 1], heights, 12, cmap="Greys_r", alpha=0.6)
    figure.colorbar(shades, label="height of the road (mm)")
    for kind, (colour, name) in MARKS.items():
        axes.plot(*on_road[solution.status == kind].T, ".", color=colour, markersize=5, label=name)
    axes.set_aspect("equal")
    axes.legend(loc="lower left")
    return figure


def spectrum_figure(
    spectra: Mapping[str, tuple[np.ndarray, np.ndarray]], band: tuple[float, float], title: str
) -> Figure:
    """Draw power spectral densities ((m/s)^2/Hz) over frequencies (Hz), and a band in grey."""
    figure, axes = new_figure("frequency (Hz)", "velocity spectrum ((m/s)$^2$/Hz)", title, (7.5, 4.5))
    axes.axvspan(*band, color="0.9", zorder=0, label="v / wavelengths of the road")
    for style, (name, (frequency, power)) in zip(STYLES, spectra.items()):
        line = {"color": style["color"], "linestyle": style["linestyle"], "linewidth": 1.2}
        axes.loglog(frequency[1:], power[1:], label=name, **line)
    axes.set(xlim=(4, 400), ylim=(2e-5, 0.3))
    axes.legend(framealpha=1.0, fontsize="small", loc="lower left")
    return figure


def forces_and_contacts(histories: Mapping[str, Any]) -> Figure:
    """Draw the force of the road, and how many nodes touch, over time, for each run by its title."""
    figure, panels = plt.subplots(2, 1, figsize=(8, 5.5), sharex=True, layout="constrained")
    for style, (name, history) in zip(STYLES, histories.items()):
        line = {"color": style["color"], "linestyle": style["linestyle"], "linewidth": 1, "label": name}
        for panel, column in zip(panels, ("force_y", "contacts")):
            panel.plot(history["time"], history[column], **line)
    panels[0].set(ylabel="force of the road, upwards (N/m)")
    panels[1].set(ylabel="nodes that touch", xlabel="t (s)")
    panels[0].legend(frameon=False)
    return figure


def way_over_the_road(
    elasticity: Any,
    snapshots: Mapping[float, np.ndarray],
    node: int,
    pressed: Any,
    nodes: np.ndarray,
    profile: Any,
) -> Figure:
    """Draw a body along its way over a profile, and below, magnified, one state; heights are to scale.

    Parameters
    ----------
    elasticity : forms.Elasticity
    snapshots : dict of (N, 2)
        Displacements by time (s).
    node : int
        A dot in the snapshots.
    pressed : State
        The one below, at the nodes `nodes` (n,) that may touch.
    profile : SmoothRoad
    """
    body = elasticity.body
    fine = np.linspace(-0.7, snapshots[max(snapshots)][:, 0].mean() + 0.8, 4000)
    figure, (way, close) = plt.subplots(2, 1, figsize=(10, 6.2), layout="constrained", height_ratios=[1, 2])
    for panel in (way, close):
        panel.fill_between(fine, profile.height(fine[:, None]), -0.1, color="0.7", linewidth=0)
        panel.set(aspect="equal", xlabel="x (m)", ylabel="y (m)")
    for time, u in snapshots.items():
        moved = body.coordinates + u
        cells = list(moved[outlines(body.cells)])
        way.add_collection(PolyCollection(cells, facecolor="white", edgecolor="0.4", linewidth=0.1))
        way.plot(*moved[node], "o", color=STYLES[2]["color"], markersize=3)
        way.text(
            moved[:, 0].mean(), moved[:, 1].max() + 0.05, f"{time:.1f} s", ha="center", fontsize="x-small"
        )
    way.set(xlim=(fine[0], fine[-1]), ylim=(-0.1, 1.9))
    moved = body.coordinates + pressed.displacement
    cells = PolyCollection(list(moved[outlines(body.cells)]), cmap=COLOUR_MAP, edgecolor="0.3", linewidth=0.2)
    cells.set_array(elasticity.von_mises(pressed.displacement))
    close.add_collection(cells)
    figure.colorbar(cells, ax=close, label="von Mises stress (Pa)")
    for kind, (colour, name) in MARKS.items():
        here = moved[nodes[pressed.status == kind]].T
        close.plot(*here, "o", color=colour, markersize=4, label=name)
    middle = moved[:, 0].mean()
    close.set(xlim=(middle - 0.45, middle + 0.45), ylim=(-0.03, 0.25), title=f"t = {pressed.time:.3f} s")
    close.legend(framealpha=0.9, loc="upper right")
    return figure


def ring_outlines(outlines: Mapping[str, Any], radius: float) -> Figure:
    """Outer nodes of rings, each about its own centre, beside the circle that a ring of that radius has."""
    figure, axes = plt.subplots(figsize=(5.5, 5.0), layout="constrained")
    angle = np.linspace(0.0, 2 * np.pi, 200)
    axes.plot(radius * np.cos(angle), radius * np.sin(angle), "k-", lw=0.8, label="at rest")
    for (label, xy), marker in zip(outlines.items(), "x.+1"):
        x, y = (xy - xy.mean(axis=0)).T
        axes.plot(x, y, marker, color="0.35" if marker == "x" else "C0", ms=5, label=label)
    axes.set(xlabel="x (m)", ylabel="y (m)", aspect="equal", title="Outer nodes at 0.9 s, about their centre")
    axes.legend(loc="center")
    return figure


def way_over_time(lines: Mapping[str, Any], quantity: str, level: float | None = None) -> Figure:
    """(time, value) by name."""
    figure, axes = plt.subplots(figsize=(6.5, 3.6), layout="constrained")
    for (label, (time, value)), style in zip(lines.items(), ("-", "--", ":", "-.")):
        axes.plot(time, value, style, label=label)
    if level is not None:
        axes.axhline(level, color="0.5", lw=0.8)
    axes.set(xlabel="time (s)", ylabel=quantity)
    axes.legend()
    return figure
