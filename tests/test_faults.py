"""Damaged files, targets that cannot be written, Ctrl-C: a sentence, and what was good stays."""

import errno
import os
import pickle
import re
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from harness.scene import Scene
from harness.verdict import is_sentence

from forms import Elasticity, Isotropic, Support
from geometry import Body, Plane, RoundRoad, half_cylinder, read_msh, rectangle
from model import (
    BodyOnRoad,
    ContactProblem,
    History,
    MovingBody,
    Newmark,
    NotConverged,
    load_checkpoint,
    save_checkpoint,
    solve,
)

DEMO = Path(__file__).parents[1] / "demos" / "reports" / "extreme_cases.py"
MSH = """$MeshFormat
2.2 0 8
$EndMeshFormat
$PhysicalNames
2
1 1 "bottom"
2 2 "block"
$EndPhysicalNames
$Nodes
4
1 0 0 0
2 1 0 0
3 1 1 0
4 0 1 0
$EndNodes
$Elements
2
1 1 2 1 1 1 2
2 3 2 2 1 1 2 3 4
$EndElements
"""


@pytest.fixture(scope="module")
def elasticity():
    return Elasticity(Body.from_grid(rectangle(1.0, 1.0, 2, 2)), Isotropic(1.0, 0.3))


@pytest.fixture(scope="module")
def problem(elasticity):
    load = elasticity.total_force("top", (0.0, -0.1))
    system = elasticity.system(load, Support(elasticity.body).fix("top", x=0.0))
    return BodyOnRoad(system, "bottom", Plane(), friction=0.3).problem


@pytest.fixture(scope="module")
def scheme(elasticity):
    load = elasticity.body_force((0.0, -1.0))
    return Newmark(MovingBody.from_forms(elasticity, 1.0, load, Plane(), "bottom"), 0.1)


class Mine:
    """What a hostile pickle would run."""

    def __reduce__(self):
        return (os.mkdir, ("owned",))


def hostile(path):
    """Write an archive whose arrays are pickles that do something."""
    np.savez(path, **dict.fromkeys(("data", "run", "load"), np.array([Mine()], dtype=object)))


def refused(read, path):
    """Read, and return the sentence that refuses; None where it is read after all."""
    try:
        read(path)
    except ValueError as error:
        assert is_sentence(str(error)), str(error)
        assert path.name in str(error)
        return str(error)
    return None


@pytest.mark.parametrize("kind", ["problem", "checkpoint", "mesh"])
def test_truncated_and_foreign_files(kind, problem, scheme, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = tmp_path / {"problem": "problem.npz", "checkpoint": "run.npz", "mesh": "body.msh"}[kind]
    if kind == "problem":
        problem.save(path)
        read = ContactProblem.load
    elif kind == "checkpoint":
        save_checkpoint(path, scheme, scheme.run(scheme.start(), 3))
        read = lambda path: load_checkpoint(path, scheme)  # noqa: E731
    else:
        path.write_text(MSH)
        read = read_msh
    whole = path.read_bytes()
    assert refused(read, path) is None
    for part in (0, 1, 10, len(whole) // 3, len(whole) // 2, len(whole) * 9 // 10):
        path.write_bytes(whole[:part])
        assert refused(read, path), part
    for foreign in (
        b"\x89PNG\r\n\x1a\n" + bytes(100),
        b"PK\x03\x04" + bytes(100),
        pickle.dumps(Mine()),
        b"\x00" * 1000,
    ):
        path.write_bytes(foreign)
        assert refused(read, path)
    with open(path, "wb") as file:
        hostile(file)
    assert refused(read, path)
    assert not (tmp_path / "owned").exists()


@pytest.mark.parametrize("seed", range(20))
def test_flipped_bits_in_saved_problems(seed, problem, tmp_path):
    """A damaged file is refused, or what it says is a problem like any other."""
    path = tmp_path / "problem.npz"
    problem.save(path)
    damaged = bytearray(path.read_bytes())
    random = np.random.default_rng(seed)
    for place in random.integers(len(damaged), size=8):
        damaged[place] ^= 1 << int(random.integers(8))
    path.write_bytes(damaged)
    refused(ContactProblem.load, path)


def writers(problem, scheme, tmp_path):
    state = scheme.start()
    history = History(scheme, state)
    scene = Scene("faults", "A test.", ["--out", str(tmp_path / "scene")])
    from matplotlib.figure import Figure

    return {
        "problem": problem.save,
        "checkpoint": lambda path: save_checkpoint(path, scheme, state),
        "history": history.write,
        "events": history.write_events,
        "figure": lambda path: scene.figure(Figure(), os.path.relpath(path.with_suffix(""), scene.out)),
    }


WRITERS = ["problem", "checkpoint", "history", "events", "figure"]


@pytest.mark.parametrize("name", WRITERS)
def test_a_full_disk_leaves_what_was_there(name, problem, scheme, tmp_path, monkeypatch):
    path = tmp_path / "target.png"
    write = writers(problem, scheme, tmp_path)[name]
    write(path)
    good, files = path.read_bytes(), sorted(os.listdir(tmp_path))

    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "replace", full)
    with pytest.raises(ValueError, match="target.png cannot be written: No space left"):
        write(path)
    assert path.read_bytes() == good
    assert sorted(os.listdir(tmp_path)) == files


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="needs /dev/full")
@pytest.mark.parametrize("name", WRITERS)
def test_a_disk_that_fills_while_writing(name, problem, scheme, tmp_path):
    """The file beside the target is a door to /dev/full, which takes nothing."""
    path = tmp_path / "target.png"
    write = writers(problem, scheme, tmp_path)[name]
    write(path)
    good = path.read_bytes()
    os.symlink("/dev/full", tmp_path / f".target.png.{os.getpid()}.part")
    with pytest.raises(ValueError, match="target.png cannot be written: No space left"):
        write(path)
    assert path.read_bytes() == good


@pytest.mark.parametrize("name", WRITERS)
def test_targets_that_are_none(name, problem, scheme, tmp_path):
    write = writers(problem, scheme, tmp_path)[name]
    (tmp_path / "folder.png").mkdir()
    with pytest.raises(ValueError, match="folder.png is a folder"):
        write(tmp_path / "folder.png")
    (tmp_path / "file").write_text("good")
    with pytest.raises(ValueError, match="x.png cannot be written"):
        write(tmp_path / "file" / "x.png")
    assert (tmp_path / "file").read_text() == "good"


def test_no_convergence_names_three_causes_with_numbers(problem):
    with pytest.raises(
        NotConverged, match=r"likeliest causes: \(1\).*\d.*; \(2\).*\d.*; \(3\).*\d"
    ) as caught:
        solve(problem, "none", limit=3)
    assert caught.value.residual == caught.value.history[-1] > 1e-10
    assert caught.value.sweeps > 0
    assert is_sentence(str(caught.value))


def test_the_first_cause_is_the_one_that_the_numbers_support(problem):
    try:
        residual = solve(problem, "none", tolerance=1e-18).residual
    except NotConverged as error:
        assert re.search(r"causes: \(1\) rounding, which alone leaves", str(error))
    else:
        assert residual <= 1e-18  # with some compilers all sums come out exact
    body = Body.from_grid(half_cylinder(1.0))
    elasticity = Elasticity(body, Isotropic(E=1e3, nu=0.3))
    system = elasticity.system(elasticity.total_force("top", (0.0, -3.0)), Support(body).fix("top", x=0.0))
    for correction in ("direct", "algebraic"):
        with pytest.raises(NotConverged, match=r"causes: \(1\) rounding, which alone leaves"):
            solve(BodyOnRoad(system, "arc", RoundRoad(radius=-3.0)), correction, tolerance=1e-18)
    far = replace(problem, gap=problem.gap + 1e6)  # so far away that rounding is large, and not yet there
    with pytest.raises(NotConverged, match=r"causes: \(1\) (?!rounding)") as caught:
        solve(far, "none", limit=3)
    assert caught.value.residual > 1e-3


@pytest.mark.parametrize("seconds", [0.0, 0.7, 3.0])
def test_ctrl_c_at_any_moment(seconds, tmp_path):
    command = [sys.executable, DEMO, "--quick", "--out", tmp_path]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    with subprocess.Popen(command, cwd=tmp_path, text=True, **pipes) as process:
        while not (tmp_path / "extreme_cases").exists():
            assert process.poll() is None, process.communicate()[1]
            time.sleep(0.01)
        time.sleep(seconds)
        process.send_signal(signal.SIGINT)
        _, said = process.communicate(timeout=300)
    assert process.returncode == 130, said
    assert "Traceback" not in said
    assert "files written so far are whole" in said
    assert not list(tmp_path.rglob("*.part"))
