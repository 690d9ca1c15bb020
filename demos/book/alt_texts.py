"""Texts for figures, from what is written on them."""

from io import BytesIO
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure


def describe(figure: Figure) -> str:
    """Say in words what a figure shows: titles, axes, and names of its lines.

    >>> from matplotlib.figure import Figure
    >>> axes = Figure().subplots()
    >>> _ = axes.plot([0, 1], label="Hertz"), axes.set(xlabel="x (mm)", ylabel="p (MPa)"), axes.legend()
    >>> describe(axes.figure)
    'Figure: p (MPa) against x (mm); shown are Hertz.'
    """
    title = figure.get_suptitle()
    parts = [_describe(axes) for axes in figure.axes if axes.get_visible()]
    return f"Figure{', ' + title if title else ''}: " + "; ".join(filter(None, parts)) + "."


def describe_figures() -> None:
    """Let the kernel that calls this give every figure such a text along with its picture."""
    from IPython import get_ipython

    def picture(figure: Figure) -> tuple[bytes, dict[str, Any]]:
        file = BytesIO()
        figure.savefig(file, format="png", dpi=110, bbox_inches="tight", facecolor="white")
        return file.getvalue(), {"alt": describe(figure)}

    import matplotlib

    shell = get_ipython()
    matplotlib.use("module://matplotlib_inline.backend_inline")
    shell.run_line_magic("matplotlib", "inline")
    shell.display_formatter.formatters["image/png"].for_type(Figure, picture)


def _describe(axes: Axes) -> str:
    title, x, y = axes.get_title(), axes.get_xlabel(), axes.get_ylabel()
    what = f"{y} against {x}" if x and y else x or y
    legend = axes.get_legend()
    names = [text.get_text() for text in legend.get_texts()] if legend else []
    said = ", ".join(filter(None, [title, what]))
    return said + (f"; shown are {', '.join(names)}" if names else "")
