"""The frame of a demo: options, output folder, summary, and how it ends when something goes wrong."""

import doctest
import importlib
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from harness.scene import COSTS, Scene

from model.atomic_file import write_aside

DEMOS = Path(__file__).parents[1] / "demos"
ENVIRONMENT = os.environ | {"PYTHONPATH": f"{DEMOS.parent}:{DEMOS}"}  # the harness lies beside the demos


@pytest.fixture
def scene(tmp_path):
    return Scene("test", "A test.", ["--quick", "--out", str(tmp_path)])


def run(tmp_path, body, *arguments, **options):
    """Run a script as a demo would be."""
    script = tmp_path / "falling_block.py"
    script.write_text("from harness.scene import Scene\n" + body)
    command = [sys.executable, *options.pop("flags", []), str(script), *arguments]
    options.setdefault("env", ENVIRONMENT)
    return subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=60, **options)


def test_summary_has_the_agreed_form(scene, tmp_path, capsys):
    scene.built("K", "K")
    scene.left_out("M", "C")
    scene.result("p0[mu=0]", np.float64(8555), "MPa", reference=8570.66, source="Hertz, eq. (13)")
    scene.result("sweeps", np.int64(12), "1")
    scene.cost(**dict.fromkeys(COSTS[:7], 1), residual=1e-11)
    scene.finish()
    summary = json.loads((tmp_path / "test" / "summary.json").read_text())
    keys = ["scene", "quick", "dolfinx", "machine", "built", "left_out", "results", "cost"]
    assert list(summary) == keys
    assert summary["quick"] and summary["machine"]["processor"]
    assert summary["dolfinx"].startswith("0.")
    assert (summary["built"], summary["left_out"]) == (["K"], ["M", "C"])
    assert summary["results"] == {
        "p0[mu=0]": {
            "value": 8555.0,
            "unit": "MPa",
            "reference": 8570.66,
            "source": "Hertz, eq. (13)",
            "bound": None,
        },
        "sweeps": {"value": 12, "unit": "1", "reference": None, "source": None, "bound": None},
    }
    assert list(summary["cost"]) == list(COSTS)
    assert summary["cost"]["total_seconds"] > 0
    printed = capsys.readouterr().out
    assert all(word in printed for word in ["A test.", "8555", "-0.18 %", "Hertz, eq. (13)", "residual"])
    assert os.listdir(tmp_path / "test") == ["summary.json"]


@pytest.mark.parametrize("value", [float("nan"), np.inf, None, "8555", 1j, np.ones(2)])
def test_values_must_be_finite_numbers(scene, value):
    with pytest.raises(ValueError, match="result 'p0' is .*finite"):
        scene.result("p0", value, "MPa")
    with pytest.raises(ValueError, match="cost 'dofs' is .*finite"):
        scene.cost(dofs=value)


def test_references_must_be_finite_numbers(scene):
    with pytest.raises(ValueError, match="reference of 'p0' is nan"):
        scene.result("p0", 1, "MPa", reference=float("nan"))


@pytest.mark.parametrize(("bound", "reference"), [("about", 1.0), ("at most", None)])
def test_bounds_are_at_most_or_at_least(scene, bound, reference):
    with pytest.raises(ValueError, match="must be 'at most' or 'at least'"):
        scene.result("cycles", 11, "1", reference, bound=bound)


def test_the_table_says_what_is_missed(scene, capsys):
    scene.result("cycles", 11, "1", 16, "wanted", "at most")
    scene.result("speed-up", 5.0, "1", 10, "wanted", "at least")
    scene.finish(**dict.fromkeys(COSTS, 0))
    lines = capsys.readouterr().out.splitlines()
    assert [("met" in line, "MISSED" in line) for line in lines if "wanted" in line] == [
        (True, False),
        (False, True),
    ]


def test_costs_are_the_agreed_ones(scene):
    with pytest.raises(ValueError, match="no cost 'seconds'"):
        scene.cost(seconds=1)
    scene.cost(dofs=1, sweeps=2)
    with pytest.raises(ValueError, match="does not say its contact_candidates, cycles"):
        scene.finish()


def test_figure_is_saved_whole(scene, tmp_path):
    from matplotlib import pyplot

    figure, _ = pyplot.subplots()
    path = scene.figure(figure, "figure_4")
    assert path == tmp_path / "test" / "figure_4.png"
    assert path.read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"
    assert figure.number not in pyplot.get_fignums()
    assert scene.figure(None, "picture") is None
    assert os.listdir(tmp_path / "test") == ["figure_4.png"]


def test_progress_is_silent_where_nobody_watches(scene, capsys):
    assert list(scene.progress(range(5), "steps")) == [0, 1, 2, 3, 4]
    assert capsys.readouterr().err == ""


def test_options(tmp_path):
    assert not Scene("test", "A test.", ["--out", str(tmp_path)]).quick
    done = run(tmp_path, "s = Scene('falling_block', 'Falls.')\nprint(s.quick, s.out)", "--quick")
    assert done.stdout == "True results/falling_block\n"
    assert (tmp_path / "results" / "falling_block").is_dir()


def test_a_mistyped_option_gets_a_sentence(tmp_path):
    done = run(tmp_path, "Scene('falling_block', 'Falls.')", "--quik")
    assert done.returncode == 2
    sentence = "falling_block: unrecognized arguments: --quik; the options are --quick and --out DIR.\n"
    assert done.stderr == sentence


def test_a_notebook_keeps_its_command_line(tmp_path, monkeypatch):
    monkeypatch.setattr(sys, "argv", ["/x/ipykernel_launcher.py", "-f", "/tmp/kernel.json"])
    monkeypatch.chdir(tmp_path)
    assert not Scene("test", "A test.").quick


def test_an_output_folder_that_is_a_file_gets_a_sentence(tmp_path):
    (tmp_path / "taken").write_text("")
    done = run(tmp_path, "Scene('falling_block', 'Falls.')", "--out", "taken")
    assert done.returncode == 1
    assert done.stderr.startswith("falling_block: The output folder taken/falling_block cannot be used (")
    assert done.stderr.count("\n") == 1


@pytest.mark.parametrize(
    ("statement", "sentence"),
    [
        ("raise ValueError('nu must be below 0.5, not 0.7.')", "nu must be below 0.5, not 0.7."),
        (
            "class E(RuntimeError): ...\nE.__module__ = 'model.solvers'\nraise E('It did not converge.')",
            "It did not converge.",
        ),
    ],
)
def test_expected_errors_end_in_a_sentence(tmp_path, statement, sentence):
    statement = "scene = Scene('falling_block', 'Falls.')\n" + statement
    done = run(tmp_path, statement)
    assert (done.returncode, done.stderr) == (1, f"falling_block: {sentence}\n")
    assert "Traceback" in run(tmp_path, statement, flags=["-X", "dev"]).stderr


def test_other_errors_keep_their_traceback(tmp_path):
    done = run(tmp_path, "scene = Scene('falling_block', 'Falls.')\n{}['missing']")
    assert done.returncode == 1
    assert "Traceback" in done.stderr


IMPORTS = """
import sys, warnings, numpy
hook, error_state = sys.excepthook, numpy.geterr()
import scipy.sparse.linalg, scipy.special, numba, matplotlib.pyplot  # their filters are their own affair
import importlib.util
if importlib.util.find_spec("dolfinx_solver"):
    import dolfinx_solver
import h5py, dolfinx.fem.petsc
from petsc4py import PETSc
filters, options = list(warnings.filters), PETSc.Options().getAll()
import model, forms, geometry
import harness.scene, harness.verdict, harness.linear_cost
import model.figures.figures, model.figures.motion_figures, model.figures.contact_map
harness.scene.Scene("imported", "Not by a script.")
assert sys.excepthook is hook
assert numpy.geterr() == error_state
assert warnings.filters == filters
assert PETSc.Options().getAll() == options
"""


def test_importing_changes_nothing(tmp_path):
    subprocess.run([sys.executable, "-c", IMPORTS], cwd=tmp_path, check=True)


def test_the_hook_is_put_back(tmp_path):
    costs = dict.fromkeys(COSTS, 0)
    look = "print(sys.excepthook is was)"
    body = f"scene = Scene('block', 'Falls.')\n{look}\nscene.finish(**{costs})\n{look}"
    done = run(tmp_path, f"import sys\nwas = sys.excepthook\n{body}")
    assert [line for line in done.stdout.splitlines() if line in ("True", "False")] == ["False", "True"]


IN_A_DESTRUCTOR = """
class Body:
    def __del__(self):
        signal.raise_signal(signal.SIGINT)
        print("lost")
body = Body()
del body
"""
WITHIN_COMPILED_CODE = """
from numba.core import serialize
space = vars(serialize) | {"interrupt": lambda: signal.raise_signal(signal.SIGINT)}
exec("def called():\\n    interrupt()\\n    print('whole')", space)
space["called"]()
"""


@pytest.mark.parametrize(("where", "said"), [(IN_A_DESTRUCTOR, ""), (WITHIN_COMPILED_CODE, "whole\n")])
def test_an_interruption_waits_where_it_would_be_lost_or_crash(where, said, tmp_path):
    done = run(tmp_path, f"import signal, time\nscene = Scene('block', 'Falls.')\n{where}\ntime.sleep(30)")
    assert done.returncode == 130
    assert (done.stdout, done.stderr.strip()) == (said, "Interrupted; the files written so far are whole.")


def test_assembly_is_timed(scene):
    @scene.assembly
    def built():
        with scene.assembly:
            time.sleep(0.01)
            return "K"

    assert built() == "K"
    assert scene.assembly.seconds >= 0.01


def test_interruption_leaves_whole_files_and_says_so(tmp_path):
    script = tmp_path / "falling_block.py"
    script.write_text(
        "import time\nfrom harness.scene import Scene\nfrom model.atomic_file import write_aside\n"
        "scene = Scene('falling_block', 'Falls.')\n"
        "(scene.out / 'summary.json').write_text('good')\n"
        "with write_aside(scene.out / 'summary.json') as aside:\n"
        "    aside.write_text('half')\n    print('writing', flush=True)\n    time.sleep(60)\n"
    )
    process = subprocess.Popen(
        [sys.executable, str(script)],
        cwd=tmp_path,
        env=ENVIRONMENT,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stdout.readline() == "writing\n"
    time.sleep(0.1)
    process.send_signal(signal.SIGINT)
    _, told = process.communicate(timeout=30)
    assert process.returncode == 130
    assert told.strip() == "Interrupted; the files written so far are whole."
    folder = tmp_path / "results" / "falling_block"
    assert os.listdir(folder) == ["summary.json"]
    assert (folder / "summary.json").read_text() == "good"


def test_write_aside_refuses_in_a_sentence(tmp_path):
    (tmp_path / "folder").mkdir()
    (tmp_path / "file").write_text("good")
    with pytest.raises(ValueError, match="folder is a folder"), write_aside(tmp_path / "folder"):
        pass
    with pytest.raises(ValueError, match="cannot be written"), write_aside(tmp_path / "file" / "x"):
        pass
    with pytest.raises(ValueError, match="No space left"), write_aside(tmp_path / "file") as aside:
        aside.write_text("half")
        raise OSError(28, "No space left on device")
    assert (tmp_path / "file").read_text() == "good"
    assert sorted(os.listdir(tmp_path)) == ["file", "folder"]


@pytest.mark.parametrize("file", sorted((DEMOS / "harness").glob("*.py")), ids=lambda file: file.stem)
def test_examples_of_the_harness_run(file):
    assert "doctest: +SKIP" not in file.read_text(encoding="utf-8")
    module = importlib.import_module(f"harness.{file.stem}" if file.stem != "__init__" else "harness")
    assert not doctest.testmod(module).failed
