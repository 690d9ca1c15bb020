"""The book: its parts, and once it is built a browser that opens it from disk."""

import base64
import os
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

HOUSE = Path(__file__).parents[1]
BOOK = HOUSE / "demos" / "book"

for needed in ("sphinx", "myst_nb", "jupytext", "sphinx_book_theme"):
    pytest.importorskip(needed, reason="the book's packages are not there: make .venv/book")


@pytest.fixture
def parts(monkeypatch):
    """Find the book's own modules."""
    monkeypatch.syspath_prepend(str(BOOK))


def test_every_lesson_is_in_the_book_once(parts):
    import contents

    assert sorted(contents.LESSONS) == sorted((HOUSE / "demos").glob("*.py"))
    assert contents.LESSONS[0].stem == "node_and_spring"


def test_every_lesson_is_one(parts):
    """What is needed and learnt, equations, ParaView, three to five exercises, solutions, further reading."""
    import build
    import contents

    lengths = []
    for script in contents.LESSONS:
        lines = script.read_text(encoding="utf-8").splitlines()
        lengths.append(len(lines))
        prose = False
        for line in lines:
            prose = "[markdown]" in line if line.startswith("# %%") else prose
            assert not prose or not line or line.startswith("#"), f"{script.name}: {line!r} is no prose"
        cells = build.as_notebook(script).cells
        text = "\n".join(cell.source for cell in cells if cell.cell_type == "markdown")
        for needed in (
            "**You will learn**",
            "**You need**",
            r"\tag{",
            "**In ParaView**",
            "**Further reading.**",
        ):
            assert needed in text, f"{script.name} has no {needed}"
        exercises = re.findall(r"^\d\. ", text.split("## Exercises")[1], re.M)
        assert 3 <= len(exercises) <= 5, script.name
        hidden = [cell.source for cell in cells if "hide-cell" in cell.metadata.get("tags", [])]
        assert len(hidden) == 1 and "# 1. " in hidden[0], script.name
    assert np.median(lengths) <= 100 and max(lengths) <= 125


def test_figures_are_described(parts):
    from alt_texts import describe
    from matplotlib.figure import Figure

    figure = Figure()
    left, right = figure.subplots(1, 2)
    left.plot([0, 1], label="loop")
    left.set(xlabel="x (mm)", ylabel="p (MPa)", title="pressure")
    left.legend()
    right.set(xlabel="sweeps", ylabel="residual")
    assert describe(figure) == (
        "Figure: pressure, p (MPa) against x (mm); shown are loop; residual against sweeps."
    )


def test_faults_of_a_site_are_found(parts, tmp_path):
    from checked_site import check_site

    (tmp_path / "good.html").write_text('<h1 id="top"></h1><img src="a.png" alt="a line that falls">')
    (tmp_path / "a.png").write_bytes(b"")
    assert check_site(tmp_path, ["good"]) == []
    (tmp_path / "bad.html").write_text(
        '<a href="good.html#end"></a><img src="b.png"><a href="none.html"></a>'
    )
    faults = check_site(tmp_path, ["bad"])
    assert len(faults) == 4
    assert "no such anchor" in faults[0] and "not there" in faults[1] and "without a text" in faults[3]


def test_broken_references_fail(tmp_path):
    from sphinx.cmd.build import build_main

    (tmp_path / "source").mkdir()
    options = ["-q", "-W", "-c", str(BOOK), "-D", "html_static_path="]
    for text, broken in (("# A page", False), ("# A page\n\n{doc}`nowhere`", True)):
        (tmp_path / "source" / "index.md").write_text(text)
        assert bool(build_main([*options, str(tmp_path / "source"), str(tmp_path / "out")])) == broken


def test_benchmarks_name_their_tests(parts):
    from benchmark_page import asserted, named

    tests = asserted(HOUSE / "tests")
    assert named("min_gap", tests["node_and_spring"]) == "test_demo_node_and_spring.py, test_quick_demo"
    assert named("pressure[UFL]", tests["hanging_rod"]) == "test_demo_hanging_rod.py, test_quick_demo"
    assert named("height", tests["hanging_rod"]) == ""


def test_a_failing_cell_is_named(parts, tmp_path, monkeypatch):
    import build

    lesson = tmp_path / "lesson.py"
    lesson.write_text("# %% [markdown]\n# # A lesson\n\n# %%\nx = 1\n\n# %%\nx / 0\n")
    with pytest.raises(build.LessonFailed, match=r"(?s)lesson.py failed.*x / 0.*ZeroDivisionError"):
        build.executed(lesson, tmp_path / "run")


def test_a_lesson_is_executed_again_only_if_it_changes(parts, tmp_path, capfd):
    import build

    lesson = tmp_path / "lesson.py"
    for text, executed in (("print(1)", True), ("print(1)", False), ("print(2)", True)):
        lesson.write_text(f"# %% [markdown]\n# # A lesson\n\n# %%\n{text}\n")
        notebook = build.executed(lesson, tmp_path / "run")
        assert notebook.cells[-1].outputs[0].text == text[6] + "\n"
        assert ("executing lesson.py" in capfd.readouterr().out) == executed


@pytest.fixture(scope="module")
def site():
    """The book as `make book` has left it, where BOOK says so: building it is no matter of seconds."""
    if "BOOK" not in os.environ:
        pytest.skip(
            "The built book is looked at by: make book && BOOK=results/book pytest tests/test_book.py"
        )
    return Path(os.environ["BOOK"]).resolve()


def test_nothing_comes_from_the_network(site):
    for page in (
        "index",
        "node_and_spring",
        "first_lecture",
        "benchmarks",
        "api/index",
        "api/model.node_loop",
    ):
        assert (site / f"{page}.html").exists()
    outside = [
        line
        for path in site.glob("*.html")
        for line in path.read_text(encoding="utf-8").splitlines()
        if 'src="http' in line or ('rel="stylesheet"' in line and 'href="http' in line)
    ]
    assert outside == []


ASK = """
import sys
from paraview import simple
for name in sys.argv[1:]:
    reader = simple.XDMFReader(FileNames=[name])
    for time in (reader.TimestepValues or [0.0])[-1:]:
        reader.UpdatePipeline(time)
    print(name, reader.GetDataInformation().GetNumberOfPoints(), *reader.PointData.keys(), sep="|")
    simple.Delete(reader)
"""


def test_paraview_reads_all_that_lessons_have_written(site, tmp_path):
    if not (shutil.which("pvpython") and shutil.which("xvfb-run")):
        pytest.skip("pvpython and xvfb-run are not there: on Debian, apt install paraview xvfb xauth")
    script, files = tmp_path / "ask.py", sorted(site.with_name(f"{site.name}-build").glob("run/**/*.xdmf"))
    script.write_text(ASK)
    environment = {key: value for key, value in os.environ.items() if not key.startswith("PYTHON")}
    command = ["xvfb-run", "-a", "pvpython", script, *files]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    lines = [line.split("|") for line in done.stdout.splitlines() if "|" in line]
    assert [Path(name) for name, *_ in lines] == files and len(files) > 30
    for name, points, *fields in lines:
        assert int(points) > 0
        road = name.endswith("_road.xdmf")
        needed = {"height", "normal"} if road else {"displacement", "contact_pressure", "gap", "status"}
        assert needed <= set(fields), name
        assert road or Path(name.replace(".xdmf", "_road.xdmf")).exists(), name


def test_notebooks_without_output_run_elsewhere(site, tmp_path):
    import nbformat
    from nbclient import NotebookClient

    bare = next(site.rglob("_downloads/**/node_and_spring.ipynb"))
    notebook = nbformat.read(bare, as_version=4)
    assert not any(cell.get("outputs") for cell in notebook.cells)
    NotebookClient(notebook, timeout=300, resources={"metadata": {"path": str(tmp_path)}}).execute()
    assert (tmp_path / "results" / "node_and_spring" / "summary.json").exists()
    filled = nbformat.read(next(site.rglob("_downloads/**/node_and_spring_with_output.ipynb")), as_version=4)
    assert any(cell.get("outputs") for cell in filled.cells)


@pytest.fixture(scope="module")
def browser():
    """Chromium without a window, driven by selenium; skipped where either is not there."""
    pytest.importorskip("selenium", reason="selenium is not there: make .venv/book")
    if not (shutil.which("chromium") and shutil.which("chromedriver")):
        pytest.skip("Chromium is not there: on Debian, apt install chromium chromium-driver")
    from selenium import webdriver

    options = webdriver.ChromeOptions()
    for argument in ("--headless", "--no-sandbox", "--disable-dev-shm-usage", "--enable-unsafe-swiftshader"):
        options.add_argument(argument)
    options.binary_location = shutil.which("chromium")
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    driver = webdriver.Chrome(options, webdriver.ChromeService(shutil.which("chromedriver")))
    yield driver
    driver.quit()


def errors(browser):
    """What the console calls severe, or an error of JavaScript."""
    return [entry["message"] for entry in browser.get_log("browser") if entry["level"] == "SEVERE"]


def test_every_page_opens_from_disk_without_an_error(browser, site):
    pages = [page for page in sorted(site.rglob("*.html")) if "_static" not in page.relative_to(site).parts]
    faults = []
    for page in [*pages, *sorted((site / "_static").rglob("scenes_to_turn/*.html"))]:
        browser.get(page.as_uri())
        faults += [f"{page.name}: {message}" for message in errors(browser)]
        broken = browser.execute_script(
            "return [...document.images].filter(i => i.complete && !i.naturalWidth).map(i => i.src)"
        )
        faults += [f"{page.name}: {source} does not show" for source in broken]
    assert len(pages) > 20 and faults == []


def test_the_first_lecture_prints_on_two_pages(browser, site):
    browser.get((site / "first_lecture.html").as_uri())
    options = {"printBackground": False, "preferCSSPageSize": True}
    pdf = base64.b64decode(browser.execute_cdp_cmd("Page.printToPDF", options)["data"])
    assert len(re.findall(rb"/Type /Page\b", pdf)) == 2


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_themes_have_contrast(browser, site, theme):
    features = [{"name": "prefers-color-scheme", "value": theme}]
    browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": features})
    browser.get((site / "node_and_spring.html").as_uri())
    colours = browser.execute_script(
        "const of = (e) => [getComputedStyle(e).color, getComputedStyle(e).backgroundColor];"
        "return [of(document.body), of(document.querySelector('div.cell_input pre'))]"
    )
    for text, ground in colours:
        low, high = sorted(luminance(each) for each in (text, ground))
        assert (high + 0.05) / (low + 0.05) > 7  # WCAG, level AAA
    page = luminance(colours[0][1])
    assert page > 0.9 if theme == "light" else page < 0.1


def luminance(colour):
    """Relative luminance of what CSS calls rgb(...)."""
    rgb = np.array([float(each) for each in re.findall(r"[\d.]+", colour)[:3]]) / 255
    return np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4) @ [0.2126, 0.7152, 0.0722]


def test_formulas_are_set(browser, site):
    from selenium.webdriver.support.ui import WebDriverWait

    browser.get((site / "node_and_spring.html").as_uri())
    WebDriverWait(browser, 30).until(
        lambda b: b.execute_script("return document.querySelectorAll('mjx-container svg').length") > 20
    )


@pytest.mark.parametrize("slider", ["lf-path", "lf-step", "lf-mu"])
def test_sliders_move_and_the_picture_changes(browser, site, slider):
    browser.get((site / "load_and_friction.html").as_uri())
    picture = (
        "return document.getElementById('lf-lines').innerHTML + document.getElementById('lf-mesh').innerHTML"
    )
    words = "return document.getElementById('lf-words').textContent"
    before = browser.execute_script(picture), browser.execute_script(words)
    browser.execute_script(
        "const e = document.getElementById(arguments[0]); e.value = 1; e.dispatchEvent(new Event('input'))",
        slider,
    )
    after = browser.execute_script(picture), browser.execute_script(words)
    assert before[0] != after[0] and before[1] != after[1]
    assert errors(browser) == []
