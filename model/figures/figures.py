"""The demos' figures: one style, axes with units, readable in grey.

Lines differ in marker and dash as well as in colour, colour maps run from dark to light. Every function
returns a matplotlib figure for `Scene.figure`.
"""

import ctypes.util
import sys
from collections.abc import Callable, Mapping
from itertools import cycle
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

COLOUR_MAP = "viridis"
COLOURS = ["black", "#0072b2", "#d55e00", "#009e73", "#7f7f7f", "#cc79a7", "#56b4e9", "#e69f00", "0.4"]
DASHES: list[tuple[int, ...]] = [
    *[(), (4, 2), (6, 2, 1, 2), (1, 2), (5, 1), (3, 1, 1, 1), (1, 3), (8, 2), (4, 2, 1, 2)],
    *[(1, 1), (10, 3), (6, 1, 1, 1, 1, 1)],
]
STYLES: list[dict[str, Any]] = [
    {"color": color, "marker": marker, "linestyle": (0, dash) if dash else "-"}
    for color, marker, dash in zip(cycle(COLOURS), "Dos^vxP*+<>p", DASHES)
]
OUTLINE = {3: [0, 1, 2], 4: [0, 1, 3, 2]}  # corners in a row, from dolfinx's order
VTK_CELLS = {
    "triangle": (5, [0, 1, 2]),
    "quadrilateral": (9, [0, 1, 3, 2]),
    "tetrahedron": (10, [0, 1, 2, 3]),
    "hexahedron": (12, [0, 1, 3, 2, 4, 5, 7, 6]),
}


def outlines(cells: np.ndarray) -> np.ndarray:
    """Return the corners of triangles or quadrilaterals (n, k) one after the other, from dolfinx's order.

    Examples
    --------
    >>> import numpy as np
    >>> from model import outlines
    >>> outlines(np.array([[0, 1, 2, 3]]))  # dolfinx numbers the corners of a quadrilateral like a tensor
    array([[0, 1, 3, 2]])
    """
    return np.asarray(cells)[:, OUTLINE[np.shape(cells)[1]]]


def new_figure(xlabel: str, ylabel: str, title: str = "", size: tuple = (6.4, 4.0)) -> tuple[Figure, Axes]:
    """Make an empty figure with labelled axes and a light grid.

    Parameters
    ----------
    xlabel, ylabel : str
        With units, as in "x (mm)".
    title : str
        Above the axes.
    size : (width, height) in inches

    Examples
    --------
    >>> from model import new_figure
    >>> figure, axes = new_figure("x (mm)", "pressure (MPa)")
    >>> axes.get_xlabel()
    'x (mm)'
    """
    figure, axes = plt.subplots(figsize=size, layout="constrained")
    axes.set(xlabel=xlabel, ylabel=ylabel, title=title)
    axes.grid(color="0.9", linewidth=0.6)
    axes.set_axisbelow(True)
    return figure, axes


def pressure_figure(
    x: np.ndarray,
    computed: Mapping[str, np.ndarray],
    exact: Mapping[str, Callable[[np.ndarray], np.ndarray]],
    half_width: float,
    title: str = "",
) -> Figure:
    """Draw contact pressures and tractions along the road: computed ones as marks, closed forms as lines.

    Parameters
    ----------
    x : ndarray, shape (n,)
        Positions of the nodes (mm).
    computed : dict of ndarray, each (n,)
        Nodal values by label (MPa).
    exact : dict of callables
        Closed forms by label.
    half_width : float
        Of the patch (mm); half as much again is drawn on either side.
    title : str
        Above the axes.

    Examples
    --------
    >>> import numpy as np
    >>> from model import HertzCylinder, pressure_figure
    >>> hertz = HertzCylinder(P=1e4, R=10.0, E=210e3, nu=0.3)
    >>> x = np.linspace(-1.0, 1.0, 21)
    >>> figure = pressure_figure(x, {"computed": hertz.pressure(x)}, {"Hertz": hertz.pressure}, hertz.a)
    >>> figure.axes[0].get_xlabel()
    'x (mm)'
    """
    figure, axes = new_figure("x (mm)", "stress (MPa)", title)
    reach = 1.5 * half_width
    fine = half_width * np.concatenate([[-1.5], np.sin(np.linspace(-np.pi / 2, np.pi / 2, 801)), [1.5]])
    for style, (label, function) in zip(cycle(STYLES), exact.items()):
        axes.plot(fine, function(fine), label=label, color=style["color"], linestyle=style["linestyle"])
    near = np.abs(x) <= reach
    for style, (label, values) in zip(cycle(STYLES), computed.items()):
        mark = {"marker": style["marker"], "color": style["color"], "markerfacecolor": "none"}
        axes.plot(x[near], values[near], linestyle="none", markersize=5, label=label, **mark)
    axes.set_xlim(-reach, reach)
    axes.legend(frameon=False)
    return figure


def stick_slip_figure(
    x: np.ndarray,
    traction: np.ndarray,
    bound: np.ndarray,
    exact: Mapping[str, Callable[[np.ndarray], np.ndarray]],
    sticks: tuple[float, float],
    half_width: float,
    slip: np.ndarray | None = None,
    title: str = "",
) -> Figure:
    """Draw tractions along the road under the largest that friction allows, where it sticks, and the slip.

    Parameters
    ----------
    x : ndarray, shape (n,)
        Positions of the nodes (mm), in any order.
    traction, bound : ndarray, shape (n,)
        Shear stress, and mu p (MPa).
    exact : dict of callables
        Closed forms by label.
    sticks : (from, to)
        The stick zone (mm), shaded.
    half_width : float
        Of the patch (mm); four tenths more are drawn on either side.
    slip : ndarray, shape (n,), optional
        Slip of each node in the last step, 0 where it sticks; drawn as arrows of relative length.
    title : str
        Above the axes.

    Examples
    --------
    >>> import numpy as np
    >>> from model import stick_slip_figure
    >>> x = np.linspace(-1.0, 1.0, 21)
    >>> bound = 0.5 * np.sqrt(1.0 - x**2)
    >>> traction = bound - 0.5 * np.sqrt(np.maximum(0.25 - x**2, 0.0))  # sticks to half the patch
    >>> figure = stick_slip_figure(x, traction, bound, {}, (-0.5, 0.5), 1.0)
    >>> figure.axes[0].get_xlabel()
    'x (mm)'
    """
    figure, axes = new_figure("x (mm)", "shear stress (MPa)", title)
    order, height = np.argsort(x), bound.max()
    axes.axvspan(*sticks, color="0.92", linewidth=0, label="sticks")
    fine = half_width * np.concatenate([[-1.4], np.sin(np.linspace(-np.pi / 2, np.pi / 2, 801)), [1.4]])
    for style, (label, function) in zip(cycle(STYLES), exact.items()):
        axes.plot(fine, function(fine), label=label, color=style["color"], linestyle=style["linestyle"])
    axes.plot(x[order], bound[order], color="0.5", linestyle=":", label=r"$\mu p$, computed")
    mark: dict[str, Any] = {"marker": "D", "markersize": 5, "color": "black", "markerfacecolor": "none"}
    axes.plot(x[order], traction[order], linestyle="none", label=r"$|\tau|$, computed", **mark)
    if slip is not None:
        moves = slip != 0
        length = 0.09 * half_width * slip[moves] / np.abs(slip[moves]).max(initial=1e-300)
        level = np.full(length.size, -0.09 * height)
        exactly: dict[str, Any] = {"angles": "xy", "scale_units": "xy", "scale": 1}
        axes.quiver(x[moves], level, length, 0 * length, width=0.004, **exactly)
        axes.annotate("slip", (-1.35 * half_width, -0.09 * height), va="center", fontsize="small")
    axes.set(xlim=(-1.4 * half_width, 1.4 * half_width), ylim=(-0.17 * height, 1.5 * height))
    axes.legend(frameon=False, fontsize="small", loc="upper center", ncols=2)
    return figure


def convergence_figure(
    size: np.ndarray | Mapping[str, np.ndarray],
    errors: Mapping[str, np.ndarray],
    xlabel: str,
    ylabel: str,
    order: float | None = None,
    floors: Mapping[str, float] | None = None,
) -> Figure:
    """Draw errors against mesh size, run time or anything else on logarithmic axes.

    Parameters
    ----------
    size : ndarray, or dict of ndarray
        Horizontal positions, common or for each label.
    errors : dict of ndarray
        By label.
    xlabel, ylabel : str
        With units.
    order : float, optional
        Slope of a triangle drawn below the lines.
    floors : dict of float, optional
        Horizontal lines by label.

    Examples
    --------
    >>> import numpy as np
    >>> from model import convergence_figure
    >>> h = np.array([0.1, 0.05, 0.025])
    >>> figure = convergence_figure(h, {"computed": h**2}, "cell size (mm)", "relative error", order=2.0)
    >>> figure.axes[0].get_xscale()
    'log'
    """
    figure, axes = new_figure(xlabel, ylabel)
    axes.set(xscale="log", yscale="log")
    for style, (label, values) in zip(cycle(STYLES), errors.items()):
        x = size[label] if isinstance(size, Mapping) else size
        axes.plot(x, values, label=label, markerfacecolor="none", markersize=5, **style)
    for dash, (label, floor) in zip(cycle([":", "--"]), (floors or {}).items()):
        axes.axhline(floor, color="0.5", linestyle=dash, linewidth=1, label=label)
    if order is not None:
        _order_triangle(axes, order)
    for axis, (low, high) in zip((axes.xaxis, axes.yaxis), (axes.get_xlim(), axes.get_ylim())):
        if high > 10 * low:  # a labelled decade is in sight, and labels between would run into each other
            axis.set_minor_formatter(NullFormatter())
    axes.legend(frameon=False, fontsize="small")
    return figure


def _order_triangle(axes: Axes, order: float) -> None:
    """Draw a triangle of the given slope under the lower right of what is drawn."""
    curves = [np.asarray(line.get_xydata()) for line in axes.lines if line.get_transform() == axes.transData]
    points = np.concatenate(curves)
    points = points[(points > 0).all(axis=1)]
    left, right = np.exp(np.quantile(np.log(points[:, 0]), [0.3, 0.6]))
    under = min(
        np.exp(np.interp(np.log(x), *np.log(curve[np.argsort(curve[:, 0])]).T))
        for curve in curves
        for x in (left, right)
    )
    low = under / 3 / max(1, (right / left) ** order)
    high = low * (right / left) ** order
    axes.fill([left, right, right], [low, low, high], facecolor="0.92", edgecolor="0.3", linewidth=0.8)
    axes.annotate(f"{order:g}", (right, np.sqrt(low * high)), (3, 0), textcoords="offset points", va="center")


def mesh_figure(
    body: Any,
    displacement: np.ndarray | None = None,
    centre: tuple[float, float] | None = None,
    width: float | None = None,
    title: str = "",
) -> Figure:
    """Draw the mesh of a plane body; beside the whole, if asked for, a part of it magnified.

    Parameters
    ----------
    body : Body
        With `coordinates` (N, 2) and `cells` (n, k) in dolfinx's order.
    displacement : ndarray, shape (N, 2), optional
        Moves the nodes (mm).
    centre : (x, y), optional
        Middle of the magnified part (mm).
    width : float, optional
        Its width (mm).
    title : str
        Above the axes.

    Examples
    --------
    >>> from geometry import Body, rectangle
    >>> from model import mesh_figure
    >>> figure = mesh_figure(Body.from_grid(rectangle(2.0, 1.0, 4, 2)), centre=(0.0, 0.0), width=0.5)
    >>> len(figure.axes)
    2
    """
    x = body.coordinates if displacement is None else body.coordinates + displacement
    polygons = x[outlines(body.cells)]
    panels = 1 if centre is None else 2
    figure, axes = plt.subplots(1, panels, figsize=(4.8 * panels, 3.6), layout="constrained", squeeze=False)
    for panel, thickness in zip(axes[0], [0.3, 0.5]):
        panel.add_collection(
            PolyCollection(list(polygons), facecolor="none", edgecolor="black", linewidth=thickness)
        )
        panel.set(xlabel="x (mm)", ylabel="y (mm)", aspect="equal")
    low, high = x.min(axis=0), x.max(axis=0)
    margin = 0.03 * (high - low).max()
    axes[0, 0].set(xlim=(low[0] - margin, high[0] + margin), ylim=(low[1] - margin, high[1] + margin))
    if centre is not None and width is not None:
        axes[0, 1].set(
            xlim=(centre[0] - width / 2, centre[0] + width / 2),
            ylim=(centre[1] - 0.35 * width, centre[1] + 0.35 * width),
        )
    figure.suptitle(title)
    return figure


def body_picture(
    body: Any,
    displacement: np.ndarray,
    field: np.ndarray,
    label: str,
    centre: tuple[float, ...],
    width: float,
    title: str = "",
) -> Figure | None:
    """Draw the deformed body with pyvista, coloured by a field of its cells, and a part of it magnified.

    Parameters
    ----------
    body : Body
        Of either dimension.
    displacement : ndarray, shape (N, dim)
        Drawn as it is (mm).
    field : ndarray, shape (n,)
        A value a cell, say von Mises' stress.
    label : str
        Its name and unit, as in "von Mises stress (MPa)".
    centre : (x, y) or (x, y, z)
        Middle of the magnified part (mm).
    width : float
        Its width (mm).
    title : str
        Above the picture.

    Returns
    -------
    Figure, or None (and a sentence on stderr) where VTK has nothing to draw with.

    Examples
    --------
    >>> import numpy as np
    >>> from geometry import Body, rectangle
    >>> from model import body_picture
    >>> body = Body.from_grid(rectangle(2.0, 1.0, 4, 2))
    >>> u, stress = np.zeros((15, 2)), np.arange(8.0)
    >>> picture = body_picture(body, u, stress, "von Mises stress (MPa)", centre=(0.0, 0.5), width=0.5)
    >>> picture is None or len(picture.axes) > 1  # None where VTK has nothing to draw with
    True
    """
    trouble = _no_rendering()
    if trouble:
        print(f"No picture of the body: {trouble}.", file=sys.stderr)
        return None
    x = body.coordinates + displacement
    middle = (x.max(axis=0) + x.min(axis=0)) / 2
    size = np.ptp(x, axis=0)  # in pictures three quarters as high as wide
    whole = 1.05 * max(size[0], size[1] / 0.75) if body.dim == 2 else 1.4 * np.linalg.norm(size)
    views = [(middle, whole), (np.asarray(centre, dtype=float), width)]
    limits = (0.0, float(np.max(field)))
    figure, axes = plt.subplots(1, 2, figsize=(10, 4), layout="constrained")
    for panel, (focus, across) in zip(axes, views):
        image = _render(body, displacement, field, focus, across, limits, edges=panel is axes[1])
        if body.dim == 2:
            sides = focus[:2, None] + across / 2 * np.array([[-1, 1], [-0.75, 0.75]])
            panel.imshow(image, extent=tuple(sides.ravel()))
            panel.set(xlabel="x (mm)", ylabel="y (mm)")
        else:
            panel.imshow(image)
            panel.set_axis_off()
    colours = plt.cm.ScalarMappable(plt.Normalize(*limits), COLOUR_MAP)
    figure.colorbar(colours, ax=axes, label=label, shrink=0.9)
    figure.suptitle(title)
    return figure


def _render(
    body: Any,
    displacement: np.ndarray,
    field: np.ndarray,
    centre: np.ndarray,
    width: float,
    limits: tuple[float, float],
    edges: bool,
    pixels: int = 800,
) -> np.ndarray:
    """Render a deformed body off screen, in parallel projection, three quarters as high as wide."""
    import pyvista

    kind, order = VTK_CELLS[body.cell]
    cells = np.asarray(body.cells)[:, order]
    rows = np.hstack([np.full((len(cells), 1), cells.shape[1]), cells])
    points = np.zeros((len(body.coordinates), 3))
    points[:, : body.dim] = body.coordinates + displacement
    focus = np.zeros(3)
    focus[: len(centre)] = centre
    grid = pyvista.UnstructuredGrid(rows.ravel(), np.full(len(cells), kind), points)
    grid.cell_data["field"] = field
    plotter: Any = pyvista.Plotter(off_screen=True, window_size=[pixels, pixels * 3 // 4])
    plotter.add_mesh(
        grid, clim=limits, cmap=COLOUR_MAP, show_edges=edges, lighting=body.dim == 3, show_scalar_bar=False
    )
    plotter.set_background("white")
    plotter.view_xy() if body.dim == 2 else plotter.view_isometric()
    plotter.enable_parallel_projection()
    camera = plotter.camera
    direction = np.asarray(camera.position) - camera.focal_point
    camera.focal_point, camera.position = focus, focus + direction
    camera.parallel_scale = 0.75 * width / 2
    image = plotter.screenshot(return_img=True)
    plotter.close()
    return np.asarray(image)


def _no_rendering() -> str:
    """Say what is missing for VTK to draw without a display; it would crash rather than say so itself."""
    try:
        import pyvista  # noqa: F401
        import vtk
    except ImportError as error:
        return f"pyvista is missing or lacks a library ({error})"
    vtk.vtkLogger.SetStderrVerbosity(vtk.vtkLogger.VERBOSITY_OFF)  # it warns of each way that it tries
    window = vtk.vtkRenderWindow().GetClassName()
    if window == "vtkOSOpenGLRenderWindow" and not ctypes.util.find_library("OSMesa"):
        return "VTK finds no OpenGL (on Debian: apt install libegl1 libgl1-mesa-dri)"
    return ""
