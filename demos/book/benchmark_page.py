"""The page of benchmarks: what each is, what it should give, what this build gave, and which test asserts it."""

import ast
import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from contents import LESSONS

HEAD = """# Benchmarks

Every number that a lesson compares with a reference, as this build found it: its source, the reference, the value,
the difference, and the test of the suite that asserts it. The lessons ran in the form `{form}`. What is known to
be missed stands under {{doc}}`known_defects`.
"""


def write_benchmarks(page: Path, runs: Path, house: Path, form: str) -> None:
    """Write the page from the summaries of the runs (none, where nothing was executed).

    Parameters
    ----------
    page : Path
    runs : Path
        Folder in which each lesson wrote results/NAME/summary.json.
    house : Path
        The checkout, for its tests.
    form : str
        How the lessons were run.
    """
    tests = asserted(house / "tests")
    text, order = [HEAD.format(form=form)], [script.stem for script in LESSONS]
    files = (file for file in runs.glob("*/results/*/summary.json") if file.parts[-4] in order)
    for file in sorted(files, key=lambda file: order.index(file.parts[-4])):
        summary = json.loads(file.read_text(encoding="utf-8"))
        rows = [
            _row(key, result, named(key, tests.get(summary["scene"], {})))
            for key, result in summary["results"].items()
            if result["reference"] is not None
        ]
        if rows:
            text += [
                f"## {summary['scene'].replace('_', ' ')}",
                "",
                f"{{doc}}`{file.parts[-4]}`, dolfinx {summary['dolfinx']}",
            ]
            where = {test.split(", ")[0] for test in tests.get(summary["scene"], {}).values()}
            text[-1] += "".join(f"; tests in `tests/{name}`" for name in sorted(where))
            text += ["", "| quantity | unit | reference | this build | off by | source | test |"]
            text += ["|---|---|---|---|---|---|---|", *rows, ""]
    page.write_text("\n".join(text) + "\n", encoding="utf-8")


def asserted(folder: Path) -> dict[str, dict[str, str]]:
    """Return, for each scene, the test that names each of its results, "file, function" by a pattern of names.

    A test of a demo says DEMO = "NAME"; which of its functions names a result is read off its text, where
    f"pressure[{way}]" stands for all such names.
    """
    found: dict[str, dict[str, str]] = {}
    for file in sorted(folder.glob("test_*.py")):
        tree = ast.parse(file.read_text(encoding="utf-8"))
        demos = [
            node.value.value
            for node in tree.body
            if isinstance(node, ast.Assign)
            and isinstance(node.targets[0], ast.Name)
            and node.targets[0].id == "DEMO"
            and isinstance(node.value, ast.Constant)
        ]
        for demo in demos:
            names = found.setdefault(Path(demo).name, {})
            for test in tree.body:
                if isinstance(test, ast.FunctionDef) and test.name.startswith("test_"):
                    for pattern in _patterns(test):
                        names.setdefault(pattern, f"{file.name}, {test.name}")
    return found


def _patterns(test: ast.FunctionDef) -> Iterator[str]:
    """Patterns of the names that a test speaks of: plain strings, f-strings, and beginnings."""
    begins = [
        string
        for node in ast.walk(test)
        if isinstance(node, ast.Call)
        and isinstance(node.func, ast.Attribute)
        and node.func.attr == "startswith"
        for string in ast.walk(node)
    ]
    for node in ast.walk(test):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            yield re.escape(node.value) + (".*" if node in begins else "")
        elif isinstance(node, ast.JoinedStr):
            yield "".join(re.escape(p.value) if isinstance(p, ast.Constant) else ".*" for p in node.values)


def named(key: str, tests: dict[str, str]) -> str:
    """Return the test that names a result, or nothing."""
    fitting = (
        pattern for pattern in tests if len(pattern.replace(".*", "")) > 1 and re.fullmatch(pattern, key)
    )
    return next((tests[pattern] for pattern in fitting), "")


def _row(key: str, result: dict[str, Any], test: str) -> str:
    value, reference = result["value"], result["reference"]
    bound = result.get("bound")
    off = f"{100 * (value / reference - 1):+.2g} %" if reference else f"{abs(value):.1e}"
    if bound:
        kept = value <= reference if bound == "at most" else value >= reference
        off = "kept" if kept else "**missed**"
    cells = [
        f"`{key}`",
        result["unit"],
        f"{bound or ''} {reference:.6g}",
        f"{value:.6g}",
        off,
        result["source"] or "",
    ]
    cells.append(f"`{test.split(', ')[1]}`" if test else "none by name")
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"
