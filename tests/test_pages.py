"""The pages of results say what the kept summaries say, and the README's table too."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
from harness.pages import MARKS, between_marks, collect, index, page, summary_table

ROOT = Path(__file__).parents[1]
PAGES = ROOT / "demos" / "reports" / "results"
sys.path.insert(0, str(ROOT / "demos" / "reports"))
from readme_rows import ROWS  # noqa: E402


@pytest.fixture(scope="module")
def kept():
    return {path.stem: json.loads(path.read_text(encoding="utf-8")) for path in sorted(PAGES.glob("*.json"))}


def test_pages_are_those_of_the_summaries(kept):
    assert kept
    for name, summary in kept.items():
        assert not summary["quick"]
        assert (PAGES / f"{name}.md").read_text(encoding="utf-8") == page(summary)
    assert (PAGES / "README.md").read_text(encoding="utf-8") == index(kept)


def test_the_readme_shows_the_kept_results(kept):
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    assert between_marks(readme, summary_table(kept, ROWS)) == readme


def test_every_scene_of_the_table_is_there():
    for _, scene, _ in ROWS:
        assert any((ROOT / "demos" / folder / f"{scene}.py").exists() for folder in ("", "reports")), scene


def test_a_quick_run_is_not_kept(tmp_path, kept):
    summary = next(iter(kept.values()))
    folder, pages = tmp_path / "results" / summary["scene"], tmp_path / "pages"
    folder.mkdir(parents=True)
    pages.mkdir()
    (folder / "summary.json").write_text(json.dumps(summary | {"quick": True}))
    assert collect(tmp_path / "results", pages) == {}
    (folder / "summary.json").write_text(json.dumps(summary))
    assert list(collect(tmp_path / "results", pages)) == [summary["scene"]]
    assert (pages / f"{summary['scene']}.md").read_text(encoding="utf-8") == page(summary)


def test_misses_are_told():
    results = {"cycles": {"value": 20, "unit": "1", "reference": 16, "source": "wanted", "bound": "at most"}}
    table = summary_table({"scene": {"results": results}}, [("cycles of it", "scene", "cycles")])
    assert "**missed**" in table
    assert "at most 16 (wanted)" in table
    assert summary_table({}, [("cycles of it", "scene", "cycles")]).count("\n") == 1


def test_text_without_the_marks_is_refused():
    with pytest.raises(ValueError, match="must hold the lines"):
        between_marks(f"{MARKS[0]}\n", "table")


def test_an_unknown_study_is_refused_with_the_known_ones():
    command = [sys.executable, str(ROOT / "demos" / "reports"), "error_against_time"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 2
    assert "there is no study error_against_time; there are error_against_run_time, " in done.stderr
