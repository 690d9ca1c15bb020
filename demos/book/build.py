"""Build the book: execute the lessons, gather the pages, run Sphinx, check what came out.

    python demos/book/build.py [--out DIR] [--execute NAME ...]

Everything is kept in DIR/../book-build, so that a lesson is executed again only if it or the code below it
has changed.
"""

import argparse
import hashlib
import os
import shutil
import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import jupytext
import nbformat
from api_pages import write_api
from benchmark_page import write_benchmarks
from checked_site import check_site
from contents import LESSONS, PAGES, contents
from nbclient import NotebookClient
from nbclient.exceptions import CellExecutionError
from paraview_pictures import take_pictures
from sphinx.cmd.build import build_main

BOOK = Path(__file__).parent
HOUSE = BOOK.parents[1]
PACKAGES = ("geometry", "forms", "model", "demos/harness")
# A notebook may lie anywhere: the harness is found from where the packages are.
BEGIN = """import sys
from pathlib import Path

import model

sys.path.append(str(Path(model.__file__).parents[1] / "demos"))"""
# Figures tell what they show, for those who do not see them.
DESCRIBE = """from alt_texts import describe_figures
describe_figures()"""


class LessonFailed(Exception):
    """A cell of a lesson raised an error."""


def main(arguments: list[str] | None = None) -> int:
    """Build, and return 0 or what went wrong."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=HOUSE / "results" / "book")
    parser.add_argument(
        "--execute",
        metavar="NAME",
        nargs="*",
        help="execute these lessons only, the others stay without output",
    )
    options = parser.parse_args(arguments)
    out = options.out.resolve()
    work = out.with_name(out.name + "-build")
    source = work / "source"
    shutil.rmtree(source, ignore_errors=True)
    shutil.copytree(BOOK, source, ignore=shutil.ignore_patterns("*.py", "__pycache__"))
    (source / "notebooks").mkdir()

    scripts = [*LESSONS, *PAGES]
    chosen = [s for s in scripts if options.execute is None or s.stem in options.execute]
    try:
        with ProcessPoolExecutor(2) as pool:
            results = pool.map(executed, chosen, [work / "run" / script.stem for script in chosen])
            done = dict(zip(chosen, results))
    except LessonFailed as failed:
        print(failed, file=sys.stderr)
        return 1
    notebooks = [done.get(script) or as_notebook(script) for script in scripts]
    for script, notebook in zip(scripts, notebooks):
        stage(script, notebook, source)
        folder = work / "run" / script.stem / "book"  # what a page has written for the book
        if folder.exists() and script in done:
            shutil.copytree(folder, source / "_static" / script.stem)
    if options.execute is None:
        take_pictures(work / "run", source / "_static" / "paraview")
    contents(source)
    write_api(source / "api")
    form = os.environ.get("SCENE_OPTIONS", "") or "full"
    write_benchmarks(source / "benchmarks.md", work / "run", HOUSE, form)

    shutil.rmtree(out, ignore_errors=True)
    failed = build_main(
        ["-q", "-W", "--keep-going", "-c", str(BOOK), "-D", f"html_static_path={source / '_static'}"]
        + ["-d", str(work / "doctrees"), str(source), str(out)]
    )
    faults = [] if failed else check_site(out, [script.stem for script in LESSONS if script in done])
    print("\n".join(faults) or ("" if failed else f"The book is in {out}: open index.html."))
    return failed or bool(faults)


def as_notebook(script: Path) -> nbformat.NotebookNode:
    """Read a lesson as a notebook without output that finds the harness wherever it lies."""
    notebook = jupytext.read(script, fmt="py:percent")
    begin = nbformat.v4.new_code_cell(BEGIN, metadata={"tags": ["remove-cell"]}, id="begin")
    first = next(n for n, cell in enumerate(notebook.cells) if cell.cell_type == "code")
    notebook.cells.insert(first, begin)
    for number, cell in enumerate(notebook.cells):  # the same script gives the same file
        cell["id"] = f"cell-{number}"
    kernel = {"name": "python3", "display_name": "Python 3", "language": "python"}
    notebook.metadata = nbformat.from_dict({"kernelspec": kernel})
    return notebook


def executed(script: Path, folder: Path) -> nbformat.NotebookNode:
    """Execute a lesson in a folder of its own, unless it and the code below it are as they were.

    Raises
    ------
    LessonFailed
        If a cell fails, with the name of the lesson, the cell and the error.
    """
    notebook = as_notebook(script)
    key, known = fingerprint(script), folder / "fingerprint"
    done = folder / f"{script.stem}.ipynb"
    if known.exists() and known.read_text() == key:
        return nbformat.read(done, as_version=4)
    print(f"executing {script.name}", flush=True)
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    os.environ["PYTHONPATH"] = str(HOUSE)  # the packages of this checkout
    notebook.cells.insert(
        0, nbformat.v4.new_code_cell(f"import sys\nsys.path.append({str(BOOK)!r})\n{DESCRIBE}")
    )
    try:
        NotebookClient(notebook, timeout=None, resources={"metadata": {"path": str(folder)}}).execute()
    except CellExecutionError as error:
        cell = next(cell for cell in reversed(notebook.cells) if cell.get("execution_count"))
        said = f"{script.name} failed in this cell:\n\n{cell.source}\n\n{error.ename}: {error.evalue}"
        raise LessonFailed(said) from None
    del notebook.cells[0]
    for cell in notebook.cells:
        if "outputs" in cell:
            cell.outputs = [output for output in cell.outputs if not is_name_only(output)]
    nbformat.write(notebook, done)
    known.write_text(key)
    return notebook


def is_name_only(output: nbformat.NotebookNode) -> bool:
    """Tell whether an output only says of which kind an object is, or to which file a figure went."""
    text = output.get("data", {}).get("text/plain", "")
    return output["output_type"] == "execute_result" and ("PosixPath(" in text or " at 0x" in text)


def fingerprint(script: Path) -> str:
    """Return what changes as soon as the lesson, the packages, or the way of executing change."""
    files = [script, Path(__file__), BOOK / "alt_texts.py", *sorted(BOOK.glob("*.js")), BOOK / "turnable.py"]
    files += sorted(file for package in PACKAGES for file in (HOUSE / package).rglob("*.py"))
    digest = hashlib.sha256(os.environ.get("SCENE_OPTIONS", "").encode())
    for file in files:
        digest.update(file.read_bytes())
    return digest.hexdigest()


def stage(script: Path, notebook: nbformat.NotebookNode, source: Path) -> None:
    """Write a lesson as page, and for download without and with output."""
    name = script.stem
    nbformat.write(as_notebook(script), source / "notebooks" / f"{name}.ipynb")
    nbformat.write(notebook, source / "notebooks" / f"{name}_with_output.ipynb")
    shutil.copy(script, source / "notebooks" / script.name)
    page = nbformat.from_dict(notebook)
    for cell in page.cells:
        texts = [
            output["metadata"].get("image/png", {}).get("alt")
            for output in cell.get("outputs", [])
            if "image/png" in output.get("data", {})
        ]
        if any(texts):
            cell.metadata["mystnb"] = {"image": {"alt": " ".join(filter(None, texts))}}
    links = (
        f"{{.downloads}}\nDownload this lesson: {{download}}`as a notebook <notebooks/{name}.ipynb>`, "
        f"{{download}}`with its output <notebooks/{name}_with_output.ipynb>`, "
        f"{{download}}`as a script <notebooks/{name}.py>`."
    )
    page.cells.insert(1, nbformat.v4.new_markdown_cell(links, id="links"))
    nbformat.write(page, source / f"{name}.ipynb")


if __name__ == "__main__":
    sys.exit(main())
