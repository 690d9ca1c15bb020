"""A scene: command line, output folder, figures, progress, timing, and the summary that ends it.

Knows neither the mesh nor the loop. From `Scene(...)` to `finish()` an expected error or Ctrl-C ends a script in
one sentence (`harness.script_errors`); importing this changes nothing.
"""

import argparse
import json
import math
import os
import sys
import tempfile
import time
from collections.abc import Iterable
from importlib import metadata
from numbers import Real
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn, Self

from harness.machine import machine
from harness.pages import off_by
from harness.script_errors import end_in_one_sentence
from harness.stopwatch import Stopwatch
from model.atomic_file import write_aside

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COSTS = (
    "dofs",
    "contact_candidates",
    "sweeps",
    "cycles",
    "work_units",
    "assembly_seconds",
    "solve_seconds",
    "total_seconds",
    "residual",
)
OPTIONS = "the options are --quick and --out DIR"


class Scene:
    """One demo from its command line to its summary.

    >>> from tempfile import TemporaryDirectory
    >>> folder = TemporaryDirectory()
    >>> scene = Scene("falling_block", "A block falls on the road.", ["--quick", "--out", folder.name])
    >>> scene = scene.built("M")
    >>> @scene.assembly  # timed, for the summary
    ... def mass():
    ...     return 2.0
    >>> scene.result("weight", mass() * 9.81, "N", reference=19.62, source="m g")
    >>> scene.finish(**dict.fromkeys(COSTS[:5], 0), solve_seconds=0.0, residual=0.0)  # doctest: +ELLIPSIS
    A block falls on the road.
    ...
    >>> sorted(path.name for path in scene.out.iterdir())
    ['summary.json']
    >>> folder.cleanup()

    In a notebook the command line is the kernel's; the options are those of the environment's SCENE_OPTIONS.

    Parameters
    ----------
    name : str
        Name of the scene, of its file and of its output folder.
    description : str
        One sentence for `--help` and the head of the table.
    arguments : sequence of str, optional
        Instead of the command line.

    Attributes
    ----------
    quick : bool
        Whether `--quick` was given.
    out : pathlib.Path
        Output folder DIR/NAME, made if need be; DIR is "results" or what `--out` says.
    assembly : Stopwatch
        Decorates what builds meshes and matrices, so that the summary can say how long that took.

    Raises
    ------
    ValueError
        If the output folder cannot be made or written to.
    """

    def __init__(self, name: str, description: str, arguments: Iterable[str] | None = None):
        self._started = time.perf_counter()
        self._undo = end_in_one_sentence() if _is_script(sys._getframe(1).f_globals) else None
        self.name, self.description = name, description
        if arguments is None:
            arguments = os.environ.get("SCENE_OPTIONS", "").split() if _in_notebook() else sys.argv[1:]
        parser = _Parser(prog=name, description=description, allow_abbrev=False)
        parser.add_argument("--quick", action="store_true", help="smaller meshes and fewer steps")
        parser.add_argument("--out", metavar="DIR", default="results", help="output goes to DIR/%(prog)s")
        options = parser.parse_args(list(arguments))
        self.quick: bool = options.quick
        self.out = _folder(Path(options.out) / name)
        self.assembly = Stopwatch()
        self._built: list[str] = []
        self._left_out: list[str] = []
        self._results: dict[str, dict[str, Any]] = {}
        self._cost: dict[str, Any] = {}

    def built(self, *what: str) -> Self:
        """Note what the scene assembles or sets up, as "K"; return the scene."""
        self._built = list(dict.fromkeys([*self._built, *what]))
        return self

    def left_out(self, *what: str) -> Self:
        """Note what the scene does without, as "M", "C", "friction"; return the scene."""
        self._left_out = list(dict.fromkeys([*self._left_out, *what]))
        return self

    def result(
        self,
        key: str,
        value: float,
        unit: str,
        reference: float | None = None,
        source: str | None = None,
        bound: str | None = None,
    ) -> None:
        """Note one result; a key given again replaces the earlier one.

        Parameters
        ----------
        key : str
            As in "p0[mu=0]".
        value : number
            Finite.
        unit : str
            As in "MPa"; "1" for a plain number.
        reference : number, optional
            What it should be.
        source : str, optional
            Where the reference comes from.
        bound : "at most" or "at least", optional
            The reference is a limit that the value is to keep; the tables say where it is missed.

        Raises
        ------
        ValueError
            If a value or reference is not a finite number, or the bound is another word or has no reference.
        """
        if bound not in (None, "at most", "at least") or (bound and reference is None):
            raise ValueError(
                f"The bound of {key!r} is {bound!r} with reference {reference!r}; "
                "it must be 'at most' or 'at least', with a reference."
            )
        self._results[key] = {
            "value": _number(f"The result {key!r}", value),
            "unit": unit,
            "reference": None if reference is None else _number(f"The reference of {key!r}", reference),
            "source": source,
            "bound": bound,
        }

    def value(self, key: str) -> float:
        """Return a result noted before."""
        return float(self._results[key]["value"])

    def cost(self, **costs: float) -> None:
        """Note what the scene cost, under the keys in `COSTS`; total_seconds is measured if it is not given.

        Raises
        ------
        ValueError
            For another key, or a value that is not a finite number.
        """
        for key, value in costs.items():
            if key not in COSTS:
                raise ValueError(f"There is no cost {key!r}; the costs are {', '.join(COSTS)}.")
            self._cost[key] = _number(f"The cost {key!r}", value)

    def figure(self, figure: "Figure | None", name: str) -> Path | None:
        """Save a matplotlib figure (or none) as NAME.png in the output folder; a script then closes it."""
        if figure is None:
            return None
        path = self.out / f"{name}.png"
        with write_aside(path) as aside:
            figure.savefig(aside, format="png", dpi=150)
        if not _in_notebook():
            from matplotlib import pyplot

            pyplot.close(figure)
        return path

    def progress(self, iterable: Iterable, description: str | None = None, total: int | None = None) -> Any:
        """Go through `iterable` behind a progress bar, shown on terminals only and after two seconds."""
        from tqdm import tqdm

        return tqdm(iterable, desc=description, total=total, delay=2, disable=None, leave=False)

    def finish(self, solved: Any = None, **costs: float) -> None:
        """Write summary.json, and print what it says.

        Parameters
        ----------
        solved : Solution or History, optional
            What the scene cost, by its method `cost()`.
        **costs : float
            As for `cost`, over what `solved` says.

        Raises
        ------
        ValueError
            If a cost is missing or the file cannot be written.
        """
        self.cost(**{"assembly_seconds": self.assembly.seconds} | self._cost)
        self.cost(**(solved.cost() if solved is not None else {}) | costs)
        self._cost.setdefault("total_seconds", time.perf_counter() - self._started)
        missing = [key for key in COSTS if key not in self._cost]
        if missing:
            raise ValueError(
                f"The scene {self.name!r} does not say its {', '.join(missing)}; call cost() first."
            )
        summary = {
            "scene": self.name,
            "quick": self.quick,
            "dolfinx": _dolfinx_version(),
            "machine": machine(),
            "built": self._built,
            "left_out": self._left_out,
            "results": self._results,
            "cost": {key: self._cost[key] for key in COSTS},
        }
        with write_aside(self.out / "summary.json") as aside:
            aside.write_text(json.dumps(summary, indent=2, allow_nan=False) + "\n", encoding="utf-8")
        print(self._table())
        if self._undo is not None:
            self._undo()

    def _table(self) -> str:
        """Lay out the summary for the terminal."""
        from tabulate import tabulate

        rows = [
            (key, r["value"], r["unit"], r["reference"], off_by(r), r["source"])
            for key, r in self._results.items()
        ]
        results = tabulate(rows, ["result", "value", "unit", "reference", "off by", "source"], floatfmt=".6g")
        costs = [
            tabulate([[self._cost[key] for key in keys]], keys, floatfmt=".3g")
            for keys in (COSTS[:5], COSTS[5:])  # two tables, no wider than a page
        ]
        built, left_out = (", ".join(names) or "nothing" for names in (self._built, self._left_out))
        last = f"Built: {built}. Left out: {left_out}. Written to {self.out}."
        return "\n\n".join([self.description, results, *costs, last])


class _Parser(argparse.ArgumentParser):
    """Argument parser that complains in one sentence."""

    def error(self, message: str) -> NoReturn:
        self.exit(2, f"{self.prog}: {message}; {OPTIONS}.\n")


def _in_notebook() -> bool:
    """Tell whether a Jupyter kernel runs this, whose command line is not ours."""
    return "kernel_launcher" in Path(sys.argv[0]).name


def _is_script(names: dict[str, Any]) -> bool:
    """Tell whether a module with these globals runs as a script, rather than imported or at a prompt."""
    return names.get("__name__") == "__main__" and "__file__" in names and not hasattr(sys, "ps1")


def _folder(path: Path) -> Path:
    """Make a folder that can be written to."""
    try:
        path.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=path):
            return path
    except OSError as error:
        raise ValueError(
            f"The output folder {path} cannot be used ({error.strerror}); give another with --out."
        ) from None


def _number(what: str, value: Any) -> float | int:
    """Return a plain finite number for JSON."""
    if getattr(value, "shape", None) == ():  # of numpy
        value = value.item()
    if not isinstance(value, Real) or not math.isfinite(value):
        raise ValueError(f"{what} is {value!r}; it must be a finite number.")
    return value  # type: ignore[return-value]


def _dolfinx_version() -> str | None:
    """Version of dolfinx, if it is installed."""
    if "dolfinx" in sys.modules:
        return sys.modules["dolfinx"].__version__
    for distribution in ("fenics-dolfinx", "dolfinx-solver-real"):
        try:
            return metadata.version(distribution)
        except metadata.PackageNotFoundError:
            continue
    return None
