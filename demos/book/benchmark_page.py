"""The page of benchmarks: what each is, what it should give, what this build gave, and which test asserts it."""

import ast
import json
from pathlib import Path
from typing import Any

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
    text = [HEAD.format(form=form)]
    for file in sorted(runs.glob("*/results/*/summary.json")):
        summary = json.loads(file.read_text(encoding="utf-8"))
        rows = [
            _row(key, result, tests.get(summary["scene"], {}))
            for key, result in summary["results"].items()
            if result["reference"] is not None
        ]
        if rows:
            text += [
                f"## {summary['scene'].replace('_', ' ')}",
                "",
                f"{{doc}}`{file.parts[-4]}`, dolfinx {summary['dolfinx']}",
            ]
            text += ["", "| quantity | unit | reference | this build | off by | source | test |"]
            text += ["|---|---|---|---|---|---|---|", *rows, ""]
    page.write_text("\n".join(text) + "\n", encoding="utf-8")


def asserted(folder: Path) -> dict[str, dict[str, str]]:
    """Return, for each scene, the test that names each of its results.

    A test of a demo says DEMO = "NAME"; which of its functions names a result is read off its text.
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
                    for node in ast.walk(test):
                        if isinstance(node, ast.Constant) and isinstance(node.value, str):
                            names.setdefault(node.value, f"{file.name}, {test.name}")
    return found


def _row(key: str, result: dict[str, Any], tests: dict[str, str]) -> str:
    value, reference = result["value"], result["reference"]
    bound = result.get("bound")
    off = f"{100 * (value / reference - 1):+.2g} %" if reference else f"{abs(value):.1e}"
    if bound:
        kept = value <= reference if bound == "at most" else value >= reference
        off = "kept" if kept else "**missed**"
    test = tests.get(key, "")
    cells = [
        f"`{key}`",
        result["unit"],
        f"{bound or ''} {reference:.6g}",
        f"{value:.6g}",
        off,
        result["source"] or "",
    ]
    cells.append(", ".join(f"`{name}`" for name in test.split(", ")) if test else "none by name")
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"
