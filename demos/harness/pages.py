"""Pages of results, written from summaries so that no figure is copied by hand."""

import json
import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from tabulate import tabulate

from model.atomic_file import write_aside

Summary = Mapping[str, Any]
MARKS = "<!-- results: written by `make pages` -->", "<!-- end of results -->"


def off_by(result: Mapping[str, Any]) -> str | None:
    """Say how a result compares: the difference to its reference in percent, or whether its bound is kept.

    >>> off_by({"value": 8555.0, "reference": 8570.66, "bound": None})
    '-0.18 %'
    >>> off_by({"value": 24.0, "reference": 10.0, "bound": "at most"})
    'MISSED'
    """
    value, reference, bound = result["value"], result["reference"], result.get("bound")
    if bound:
        return "met" if (value <= reference if bound == "at most" else value >= reference) else "MISSED"
    return f"{100 * (value / reference - 1):+.2g} %" if reference else None


def page(summary: Summary) -> str:
    """Markdown page of one summary: where it was measured, all results, the cost."""
    machine, rows = summary["machine"], []
    for key, r in summary["results"].items():
        wanted = "" if r["reference"] is None else f"{r.get('bound') or ''} {r['reference']:.6g}".strip()
        rows.append([f"`{key}`", f"{r['value']:.6g}", r["unit"], wanted, off_by(r), r["source"]])
    head = ["result", "value", "unit", "reference", "off by", "source"]
    cost = summary["cost"]
    return "\n".join(
        [
            f"# {summary['scene']}",
            "",
            f"Written by `make pages` from the summary of {'a quick' if summary['quick'] else 'a full'} run.",
            f"Measured on {machine['processor']}, {machine['cores']} cores, dolfinx {summary['dolfinx']}.",
            f"BLAS kernels: {'; '.join(f'{k}: {v}' for k, v in machine['blas'].items()) or 'unknown'}"
            + (f", forced by OPENBLAS_CORETYPE={machine['coretype']}." if machine["coretype"] else "."),
            "",
            tabulate(rows, head, "github", disable_numparse=True),
            "",
            tabulate(
                [[f"{value:.3g}" for value in cost.values()]], list(cost), "github", disable_numparse=True
            ),
            "",
        ]
    )


def summary_table(summaries: Mapping[str, Summary], rows: Iterable[tuple[str, str, str]]) -> str:
    """Markdown table of chosen results.

    Parameters
    ----------
    summaries : dict of summary
        By scene.
    rows : iterable of (words, scene, key)
        A scene that has not been run, or has no such key, is left out.
    """
    lines = []
    for words, scene, key in rows:
        r = summaries.get(scene, {}).get("results", {}).get(key)
        if r is None:
            continue
        bound = f"{r.get('bound') or ''} " * bool(r.get("bound"))
        source = f" ({r['source']})" * bool(r["source"])
        wanted = "" if r["reference"] is None else f"{bound}{r['reference']:.5g}{source}"
        judged = (off_by(r) or "").replace("MISSED", "**missed**")
        unit = "" if r["unit"] == "1" else f" {r['unit']}"
        lines.append([words, f"{r['value']:.5g}{unit}", wanted, judged])
    return tabulate(lines, ["", "this code", "reference", "off by"], "github", disable_numparse=True)


def between_marks(text: str, table: str) -> str:
    """Put a table between the two marks of a text.

    Raises
    ------
    ValueError
        If the marks are not there.
    """
    begin, end = map(re.escape, MARKS)
    found, count = re.subn(f"({begin}\n).*?({end})", lambda m: f"{m[1]}\n{table}\n\n{m[2]}", text, flags=re.S)
    if count != 1:
        raise ValueError(f"The text must hold the lines {MARKS[0]!r} and {MARKS[1]!r} once.")
    return found


def collect(results: Path, pages: Path) -> dict[str, Summary]:
    """Keep the summaries of full runs, write a page of each, and return all that are kept.

    Parameters
    ----------
    results : Path
        Folder of the scenes' folders, `results/`.
    pages : Path
        Folder with NAME.json and NAME.md of each scene.
    """
    for path in sorted(results.glob("*/summary.json")):
        summary = json.loads(path.read_text(encoding="utf-8"))
        if not summary.get("quick", True):
            with write_aside(pages / f"{summary['scene']}.json") as aside:
                aside.write_text(json.dumps(summary, indent=1) + "\n", encoding="utf-8")
    kept = {path.stem: json.loads(path.read_text(encoding="utf-8")) for path in sorted(pages.glob("*.json"))}
    for name, text in {
        **{name: page(summary) for name, summary in kept.items()},
        "README": index(kept),
    }.items():
        with write_aside(pages / f"{name}.md") as aside:
            aside.write_text(text, encoding="utf-8")
    return kept


def index(kept: Mapping[str, Summary]) -> str:
    """Markdown page with a line for each summary: results, misses, run time."""
    rows = []
    for name, summary in kept.items():
        judged = [off_by(r) for r in summary["results"].values()]
        minutes = summary["cost"]["total_seconds"] / 60
        rows.append([f"[{name}]({name}.md)", len(judged), judged.count("MISSED"), f"{minutes:.1f}"])
    table = tabulate(rows, ["scene", "results", "bounds missed", "minutes"], "github", disable_numparse=True)
    return f"# Results of the last full runs\n\nWritten by `make pages`.\n\n{table}\n"
