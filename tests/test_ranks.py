"""The same scenes on one rank and on several: the same answer."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest
from on_ranks import found

LAUNCHER = shutil.which("mpirun", path=str(Path(sys.executable).parent)) or shutil.which("mpirun")
pytestmark = pytest.mark.skipif(LAUNCHER is None, reason="there is no mpirun here")


# What is run on how many ranks: by one launch each, for a process needs seconds to begin.
KINDS = {
    2: ["cylinder", "friction", "path", "held", "tread", "rubber", "hollow"]
    + [
        "newmark",
        "stabilised",
        "redistributed",
        "bouncing",
        "continued",
        "slippery",
        "recorded",
        "direct",
        "algebraic",
    ],
    3: ["triangles", "platen", "saved", "none", "own_forms_of_body"]
    + ["explicit", "below", "slides", "tips", "too_long", "ordered"],
    4: ["ball", "corner", "odd"],  # odd: one rank is empty, one has no candidate, one little else
}
NUMBERS = {"displacement", "contact_pressure", "contact_traction", "gap", "sheet", "ledger"}
WRONG = {
    "below": "below the road",
    "too_long": "on this mesh central differences are stable to",
    "ordered": "nodes are visited in their order",
    "slides": "The load drives the body into a translation along",
    "tips": "The load drives the body into a rotation about",
}


@pytest.fixture(scope="module")
def shared(tmp_path_factory):
    """What ranks find of each kind of scene, launched when first asked for."""
    there = {}

    def of(ranks, kind):
        if ranks not in there:
            there[ranks] = tmp_path_factory.mktemp(f"ranks{ranks}")
            found("saved", there[ranks])
            launch(ranks, there[ranks], *KINDS[ranks])
        with np.load(there[ranks] / f"{kind}.npz") as file:
            return dict(file)

    of.there = there
    return of


def started(ranks, *arguments):
    """Run Python on so many ranks to the end."""
    here = Path(__file__).parent
    paths = [str(here.parent), str(here), os.environ.get("PYTHONPATH", "")]
    return subprocess.run(
        [LAUNCHER, "-n", str(ranks), sys.executable, *map(str, arguments)],
        env=os.environ | {"PYTHONPATH": os.pathsep.join(paths)},
        stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=300,
    )  # fmt: skip


def launch(ranks, *arguments):
    """Run `on_ranks.py` on so many ranks."""
    done = started(ranks, "-m", "mpi4py", Path(__file__).with_name("on_ranks.py"), *arguments)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.parametrize(
    ("ranks", "kind"),
    [(ranks, kind) for ranks, kinds in KINDS.items() for kind in kinds if kind not in WRONG],
)
def test_many_ranks_find_what_one_finds(ranks, kind, shared, tmp_path):
    together = shared(ranks, kind)
    alone = found("newmark" if kind == "continued" else kind, tmp_path)
    assert "trouble" not in together, together["trouble"]
    assert np.array_equal(alone["status"], together["status"])
    assert 0 < np.count_nonzero(alone["status"]) < alone["status"].size
    # a node that sticks where two roads meet may share its force between pressure and friction in many ways
    unique = NUMBERS - ({"contact_pressure"} if kind == "corner" else set())
    for name in unique & alone.keys() & together.keys():
        assert np.abs(alone[name] - together[name]).max() <= 1e-8 * np.abs(alone[name]).max(), name


@pytest.mark.parametrize(("kind", "words"), WRONG.items())
def test_every_rank_hears_what_is_wrong(kind, words, shared):
    said = shared(3, kind)["everybody"]
    assert len(said) == 3
    assert all(words in sentence for sentence in said)


def test_a_run_goes_on_on_one_rank(shared):
    shared(3, "saved")
    alone, went_on = found("newmark"), found("continued", shared.there[3])
    assert np.array_equal(alone["status"], went_on["status"])
    for name in ("displacement", "contact_pressure", "contact_traction"):
        assert np.abs(alone[name] - went_on[name]).max() <= 1e-8 * np.abs(alone[name]).max(), name


def test_many_ranks_write_one_series(shared):
    with_steps = shared(3, "saved")["points"]
    with h5py.File(next(shared.there[3].glob("run.steps*/0*.h5"))) as file:
        found_there = np.concatenate([np.ravel(values) for values in leaves(file)])
    assert len(with_steps) * 3 <= found_there.size and np.isfinite(found_there).all()


def leaves(group):
    """All arrays of an HDF5 file."""
    for item in group.values():
        yield from leaves(item) if hasattr(item, "values") else [np.asarray(item)]


def test_an_error_is_one_sentence_and_ends_all(tmp_path):
    script = tmp_path / "wrong.py"
    script.write_text("import on_ranks\non_ranks.below()\n")
    done = started(2, str(script))
    assert done.returncode != 0
    assert done.stderr.count("ValueError") == 1 and "below the road" in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize("ranks", [1, 2])
def test_a_solver_let_go_gives_its_memory_back_at_once(ranks, tmp_path):
    script = tmp_path / "let_go.py"
    script.write_text(
        "import gc, weakref, on_ranks\n"
        "from model.ranks.shared_solver import SharedSolver\n"
        "from model.solvers.contact_solver import ContactSolver\n"
        "contact = on_ranks.cylinder(0.3)\n"
        "gc.disable()\n"
        "kind = SharedSolver if contact.system.exchanges else ContactSolver\n"
        "solver = kind(contact.problem, 'multigrid', progress=False)\n"
        "solver.solve(tolerance=1e-8)\n"
        "known = weakref.ref(solver)\n"
        "del solver\n"
        "assert known() is None\n"
    )
    done = started(ranks, "-m", "mpi4py", str(script))
    assert done.returncode == 0, done.stderr
