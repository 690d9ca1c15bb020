"""The same scenes on one rank and on several: the same answer."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from on_ranks import found

LAUNCHER = shutil.which("mpirun", path=str(Path(sys.executable).parent)) or shutil.which("mpirun")
# For Open MPI, which refuses to run as root and more ranks than cores; MPICH takes both.
OPEN_MPI = {
    "OMPI_ALLOW_RUN_AS_ROOT": "1",
    "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
    "OMPI_MCA_rmaps_base_oversubscribe": "1",
    "PRTE_MCA_rmaps_default_mapping_policy": ":oversubscribe",
    "OMPI_MCA_btl_vader_single_copy_mechanism": "none",
}
pytestmark = pytest.mark.skipif(LAUNCHER is None, reason="there is no mpirun here")


def on(ranks, kind, tmp_path):
    """What `ranks` ranks find."""
    here = Path(__file__).parent
    paths = [str(here.parent), str(here), os.environ.get("PYTHONPATH", "")]
    environment = os.environ | OPEN_MPI | {"PYTHONPATH": os.pathsep.join(paths)}
    command = [LAUNCHER, "-n", str(ranks), sys.executable, "-m", "mpi4py", str(here / "on_ranks.py")]
    done = subprocess.run(
        [*command, kind, str(tmp_path / "found.npz")],
        env=environment, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=300,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    with np.load(tmp_path / "found.npz") as file:
        return dict(file)


@pytest.mark.parametrize(
    ("kind", "ranks"),
    [("cylinder", 2), ("friction", 3), ("ball", 4), ("triangles", 3), ("path", 2), ("held", 2)],
)
def test_many_ranks_find_what_one_finds(kind, ranks, tmp_path):
    alone, shared = found(kind), on(ranks, kind, tmp_path)
    assert "trouble" not in shared, shared["trouble"]
    assert np.array_equal(alone["status"], shared["status"])
    assert 0 < np.count_nonzero(alone["status"]) < alone["status"].size
    for name in ("displacement", "contact_pressure", "contact_traction", "gap"):
        assert np.abs(alone[name] - shared[name]).max() <= 1e-8 * np.abs(alone[name]).max(), name


@pytest.mark.parametrize(
    ("kind", "words"), [("below", "below the road"), ("motion", "not shared among ranks")]
)
def test_every_rank_hears_what_is_wrong(kind, words, tmp_path):
    said = on(3, kind, tmp_path)["everybody"]
    assert len(said) == 3
    assert all(words in sentence for sentence in said)
