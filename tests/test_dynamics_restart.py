"""Runs that stop and go on: checkpoints to the last bit, and what a killed run leaves behind."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import pyvista
from bodies_in_motion import SCHEMES, bouncing_ring

from model import CentralDifferences, History, Newmark, integrate, load_checkpoint

STATE = ("displacement", "velocity", "acceleration", "contact_force", "gap", "status", "mean_force")


@pytest.mark.parametrize("scheme", [*SCHEMES, CentralDifferences])
@pytest.mark.parametrize("stop", [20, 36])
def test_a_restart_continues_bit_for_bit(scheme, stop, tmp_path):
    moving, velocity = bouncing_ring(0.1)
    dt = 0.001 if scheme is CentralDifferences else 0.01
    stop, steps = round(stop * 0.01 / dt), round(0.55 / dt)
    whole = scheme(moving, dt)
    start = whole.start(velocity=velocity)
    record = History(whole, start, {"A": 0}, tmp_path / "history.csv")
    *_, state = integrate(whole, start, steps, record)

    first = scheme(moving, dt)
    begun = first.start(velocity=velocity)
    for _ in integrate(first, begun, stop, History(first, begun, {"A": 0}), tmp_path / "run.npz"):
        pass
    second = scheme(bouncing_ring(0.1)[0], dt)
    history = History(second, second.start(velocity=velocity), {"A": 0}, tmp_path / "resumed.csv")
    loaded = load_checkpoint(tmp_path / "run.npz", second, history)
    assert loaded.step == stop
    *_, resumed = integrate(second, loaded, steps - stop, history)

    assert resumed.step == state.step
    for name in STATE:
        assert np.array_equal(getattr(resumed, name), getattr(state, name)), name
    for column in record.columns:
        if column != "seconds":
            assert np.array_equal(record[column], history[column], equal_nan=True), column
    assert record.events == history.events
    lines = [(tmp_path / name).read_text().splitlines() for name in ("history.csv", "resumed.csv")]
    assert len(lines[0]) == len(lines[1]) == steps + 2


def test_a_checkpoint_of_another_run_is_refused(tmp_path):
    moving, velocity = bouncing_ring()
    scheme = Newmark(moving, 0.01)
    for _ in integrate(scheme, scheme.start(velocity=velocity), 2, checkpoint=tmp_path / "run.npz"):
        pass
    with pytest.raises(ValueError, match="of another run"):
        load_checkpoint(tmp_path / "run.npz", Newmark(moving, 0.005))
    (tmp_path / "torn.npz").write_bytes((tmp_path / "run.npz").read_bytes()[:1000])
    with pytest.raises(ValueError, match="no checkpoint"):
        load_checkpoint(tmp_path / "torn.npz", scheme)


RUN = """
import sys
sys.path.insert(0, sys.argv[1])
from bodies_in_motion import Body, bouncing_ring, ring
from model import History, Newmark, integrate
from model.results.xdmf import Series
moving, velocity = bouncing_ring(0.1)
body = Body.from_grid(ring(0.5, 0.2, 40, 3, lowest=(0.0, 0.5)))
scheme = Newmark(moving, 0.01)
state = scheme.start(velocity=velocity)
history = History(scheme, state, {"A": 0}, "history.csv")
series = Series("ring.xdmf", body)
for state in integrate(scheme, state, 100_000, history, "run.npz", every=10):
    series.write(state.time, {"displacement": state.displacement})
    print(state.step, flush=True)
"""


def same(a, b):
    """Whether two processes found the same, each with kernels that it may have compiled itself."""
    return np.abs(a - b).max() <= 1e-9 * np.abs(b).max()


def test_a_killed_run_leaves_every_finished_step(tmp_path):
    command = [sys.executable, "-W", "ignore", "-c", RUN, str(Path(__file__).parent)]
    with subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, text=True) as process:
        for _ in range(45):
            process.stdout.readline()
        process.kill()  # SIGKILL
        printed = process.stdout.read().split()
    last = int(printed[-1]) if printed else 45

    reader = pyvista.get_reader(tmp_path / "ring.xdmf")
    assert len(reader.time_values) in (last, last + 1)  # the last may have died before it could say so
    moving, velocity = bouncing_ring(0.1)
    scheme = Newmark(moving, 0.01)
    state = scheme.run(scheme.start(velocity=velocity), 43)
    reader.set_active_time_value(reader.time_values[42])
    mesh = reader.read()
    mesh = mesh[0] if isinstance(mesh, pyvista.MultiBlock) else mesh
    assert same(mesh.point_data["displacement"][:, :2], state.displacement)

    rows = (tmp_path / "history.csv").read_text().splitlines()
    assert len(rows) >= last + 2  # a head, the start, and each step
    resumed = load_checkpoint(tmp_path / "run.npz", scheme)
    assert resumed.step % 10 == 0 and last - 10 <= resumed.step <= last + 1
    twin = Newmark(moving, 0.01)
    assert same(twin.run(twin.start(velocity=velocity), resumed.step).displacement, resumed.displacement)
