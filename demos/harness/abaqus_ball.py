"""A ball as some preprocessor writes it: Abaqus's .inp with numbers, sets and surfaces of its own."""

from pathlib import Path

import numpy as np

from geometry import half_cylinder_nested


def write_ball(path: Path, radius: float, refinements: int) -> None:
    """Write half of the lower half of a ball's section, to be turned about the axis x = 0, to NAME.inp.

    It has the element set Steel, the node set Axis, the surface Ball, and a reference point of no element.
    """
    whole = half_cylinder_nested(radius, refinements)
    cells = whole.cells[whole.points[whole.cells, 0].mean(axis=1) > 0][:, [0, 1, 3, 2]]
    used, number = np.unique(cells, return_inverse=True)
    x, number = whole.points[used], number.reshape(cells.shape)
    on_arc = np.abs(np.hypot(x[:, 0], x[:, 1] - radius) - radius) < 1e-10 * radius
    lines = ["*Heading", " a ball, by somebody else's preprocessor", "*Node", " 1, 0., 99."]
    lines += [f" {10 * k + 10}, {a!r}, {b!r}" for k, (a, b) in enumerate(x.tolist())]
    lines += ["*Element, type=CAX4, elset=Steel"]
    lines += [f" {k + 1}, " + ", ".join(map(str, 10 * row + 10)) for k, row in enumerate(number)]
    axis = 10 * np.flatnonzero(x[:, 0] < 1e-10 * radius) + 10
    lines += ["*Nset, nset=Axis", *(f" {k}" for k in axis), "*Surface, name=Ball, type=ELEMENT"]
    sides = [
        (k + 1, s + 1) for k, row in enumerate(on_arc[number]) for s in range(4) if row[s] and row[s - 3]
    ]
    path.write_text("\n".join([*lines, *(f" {k}, S{s}" for k, s in sides)]) + "\n")
