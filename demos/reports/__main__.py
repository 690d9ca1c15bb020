"""Run the long studies one after the other, and write their pages: `python demos/reports [NAME ...] [--quick]`.

Each runs in a process of its own, with the BLAS kernels that suit the processor: OPENBLAS_CORETYPE, which may
name a slower one, is unset. How long they will take is known from the runs whose pages are kept.
"""

import argparse
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from time import perf_counter

from tqdm import tqdm

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent))
from harness.pages import between_marks, collect, summary_table  # noqa: E402
from readme_rows import ROWS  # noqa: E402

PAGES, README = HERE / "results", HERE.parents[1] / "README.md"
PICTURE = Path("section_3_1_1_normal_loading/figure_4.png")
HANDICAPS = ("OPENBLAS_CORETYPE", "OPENBLAS_L2_SIZE")
UNKNOWN = 300.0  # seconds expected of a study that has not been run


def expected_seconds(name: str, quick: bool) -> float:
    """Seconds that the kept run of a study took; a quick one takes about a twentieth."""
    path = PAGES / f"{name}.json"
    seconds = json.loads(path.read_text())["cost"]["total_seconds"] if path.exists() else UNKNOWN
    return seconds / 20 if quick else seconds


def run(names: list[str], options: list[str]) -> int:
    """Run the studies; return how many failed."""
    seconds = {name: expected_seconds(name, "--quick" in options) for name in names}
    minutes = max(1, round(sum(seconds.values()) / 60))
    print(f"Studies: {len(names)}; expected to take {minutes} min.")
    environment = {key: value for key, value in os.environ.items() if key not in HANDICAPS}
    paths = [str(HERE.parent), str(HERE.parents[1]), os.environ.get("PYTHONPATH", "")]
    environment |= {"PYTHONPATH": os.pathsep.join(filter(None, paths))}
    failed = 0
    form = "{desc}: {percentage:3.0f}%|{bar}| {elapsed} of about {postfix}"
    with tqdm(total=sum(seconds.values()), disable=None, bar_format=form) as bar:
        left = sum(seconds.values())
        for name in names:
            bar.set_description(name)
            bar.set_postfix_str(f"{(bar.format_dict['elapsed'] + left) / 60:.0f} min")
            began = perf_counter()
            done = subprocess.run([sys.executable, str(HERE / f"{name}.py"), *options], env=environment)
            failed += done.returncode != 0
            if done.returncode:
                print(f"{name} ended with exit code {done.returncode} after {perf_counter() - began:.0f} s.")
            left -= seconds[name]
            bar.update(seconds[name])
    return failed


def write_pages(results: Path) -> None:
    """Write the page of every kept summary, and the table and the picture of the README."""
    PAGES.mkdir(exist_ok=True)
    text = between_marks(README.read_text(encoding="utf-8"), summary_table(collect(results, PAGES), ROWS))
    README.write_text(text, encoding="utf-8")
    if (results / PICTURE).exists():
        shutil.copy(results / PICTURE, HERE.parent)


def main() -> int:
    """Read the command line and do as it says."""
    studies = sorted(path.stem for path in HERE.glob("*.py") if path.read_text().startswith("# ---"))
    parser = argparse.ArgumentParser(prog="reports", description="The long studies and their pages.")
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of {', '.join(studies)}; default all")
    parser.add_argument("--quick", action="store_true", help="smaller meshes and fewer steps; pages stay")
    parser.add_argument("--out", default="results", metavar="DIR", help="output goes to DIR/NAME")
    parser.add_argument("--pages", action="store_true", help="run nothing, write the pages")
    chosen = parser.parse_args()
    unknown = sorted(set(chosen.names) - set(studies))
    if unknown:
        parser.error(f"there is no study {', '.join(unknown)}; there are {', '.join(studies)}")
    failed = 0
    if not chosen.pages:
        failed = run(chosen.names or studies, ["--quick"] * chosen.quick + ["--out", chosen.out])
    if not chosen.quick:
        write_pages(Path(chosen.out))
    return min(failed, 1)


if __name__ == "__main__":
    sys.exit(main())
