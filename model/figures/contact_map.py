"""Bodies in space on paper: the contact seen through the road, and the face of a cut."""

from collections.abc import Mapping, Sequence
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from model.figures.figures import COLOUR_MAP, outlines
from model.node_loop.status import Status

MARKS = {Status.STICK: ("black", "stick"), Status.SLIP: ("tab:orange", "slip")}


def contact_map(
    body: Any,
    boundary: str | Sequence[str],
    fields: Mapping[str, np.ndarray],
    status: np.ndarray,
    reach: float,
    mirror: Sequence[int] = (),
    centre: tuple[float, float] = (0.0, 0.0),
    title: str = "",
) -> Figure:
    """Draw nodal fields on a boundary, looking down on the road, and beside them what each node does.

    Parameters
    ----------
    body : Body
        In 3-D, its road about z = 0.
    boundary : str or sequence of str
        Boundary that touches, or several.
    fields : dict of ndarray, each (N,)
        Values at all nodes of the body, by label with unit: "pressure (MPa)".
    status : ndarray, shape (N,)
        0 free, 1 slip, 2 stick.
    reach : float
        Half the width of what is drawn (mm).
    mirror : axes
        0 and 1 for bodies cut at x = 0 and y = 0, to draw the other half as well.
    centre : (x, y)
        Middle of what is drawn (mm).
    title : str
        Above the maps.

    Examples
    --------
    >>> import numpy as np
    >>> from geometry import Body, half_ball
    >>> from model import contact_map
    >>> body = Body.from_grid(half_ball(radius=10.0))
    >>> N = len(body.coordinates)
    >>> pressure, status = np.zeros(N), np.zeros(N, dtype=int)
    >>> figure = contact_map(body, "sphere", {"pressure (MPa)": pressure}, status, reach=1.0)
    >>> len(figure.axes) > 1
    True
    """
    facets = outlines(body.facet_nodes(boundary))
    x = body.coordinates[:, :2]
    middle = np.asarray(centre)
    facets = facets[(np.abs(x[facets] - middle) <= 1.5 * reach).all(axis=(1, 2))]
    signs = [np.ones(2)]
    for axis in mirror:
        signs += [sign * np.where(np.arange(2) == axis, -1, 1) for sign in signs]
    size = (4.2 * (len(fields) + 1), 3.8)
    figure, panels = plt.subplots(1, len(fields) + 1, figsize=size, layout="constrained", squeeze=False)
    for panel, (label, values) in zip(panels[0], fields.items(), strict=False):
        polygons = [sign * x[facets] for sign in signs]
        colours = PolyCollection(
            list(np.concatenate(polygons)), cmap=COLOUR_MAP, edgecolor="face", linewidth=0.2
        )
        colours.set_array(np.tile(np.asarray(values)[facets].mean(axis=1), len(signs)))
        panel.add_collection(colours)
        figure.colorbar(colours, ax=panel, label=label, shrink=0.85)
    last = panels[0, -1]
    shown = np.unique(facets)
    for sign in signs:
        last.plot(*(sign * x[shown]).T, ".", color="0.85", markersize=2)
        for kind, (colour, _) in MARKS.items():
            last.plot(*(sign * x[shown[status[shown] == kind]]).T, ".", color=colour, markersize=3)
    marks = [
        Line2D([], [], color=colour, marker=".", linestyle="none", label=name)
        for colour, name in MARKS.values()
    ]
    last.legend(handles=marks, frameon=False, loc="upper right", fontsize="small")
    for panel in panels[0]:
        limits = [(middle[axis] - reach, middle[axis] + reach) for axis in range(2)]
        panel.set(xlabel="x (mm)", ylabel="y (mm)", aspect="equal", xlim=limits[0], ylim=limits[1])
    figure.suptitle(title)
    return figure


def cut_figure(
    body: Any,
    boundary: str | Sequence[str],
    displacement: np.ndarray,
    field: np.ndarray,
    label: str,
    centre: tuple[float, float],
    width: float,
    title: str = "",
) -> Figure:
    """Draw the cut face of a body in space, deformed and coloured by a field of its cells, and a part of it.

    Parameters
    ----------
    body : Body
    boundary : str
        A plane boundary across y, as the symmetry plane "y0".
    displacement : ndarray, shape (N, 3)
        Drawn as it is (mm).
    field : ndarray, shape (n,)
        A value a cell; drawn as means over the cells about each node.
    label : str
        Its name and unit.
    centre : (x, z)
        Middle of the magnified part (mm).
    width : float
        Its width (mm).
    title : str
        Above the picture.

    Examples
    --------
    >>> import numpy as np
    >>> from geometry import Body, half_ball
    >>> from model import cut_figure
    >>> body = Body.from_grid(half_ball(radius=10.0, part="quarter"))
    >>> still, stress = np.zeros_like(body.coordinates), np.ones(len(body.cells))
    >>> figure = cut_figure(body, "y0", still, stress, "von Mises stress (MPa)", (0.0, 0.0), 1.0)
    >>> len(figure.axes) > 1
    True
    """
    facets = outlines(body.facet_nodes(boundary))
    corners = np.asarray(body.cells)
    around = np.bincount(corners.ravel(), minlength=len(body.coordinates))
    total = np.bincount(corners.ravel(), np.repeat(field, corners.shape[1]), len(body.coordinates))
    values = (total / around)[facets].mean(axis=1)
    x = (body.coordinates + displacement)[:, [0, 2]]
    low, high = x[facets].min(axis=(0, 1)), x[facets].max(axis=(0, 1))
    views = [((low + high) / 2, 1.05 * (high - low).max()), (np.asarray(centre), width)]
    figure, panels = plt.subplots(1, 2, figsize=(10, 4), layout="constrained")
    for panel, (middle, across), line in zip(panels, views, (0.1, 0.4)):
        colours = PolyCollection(list(x[facets]), cmap=COLOUR_MAP, edgecolor="black", linewidth=line)
        colours.set_array(values)
        panel.add_collection(colours)
        panel.set(xlabel="x (mm)", ylabel="z (mm)", aspect="equal")
        panel.set(
            xlim=(middle[0] - across / 2, middle[0] + across / 2),
            ylim=(middle[1] - 0.4 * across, middle[1] + 0.4 * across),
        )
    figure.colorbar(colours, ax=panels, label=label, shrink=0.9)
    figure.suptitle(title)
    return figure
