"""XDMF as others read it: VTK's reader, h5py, dolfinx; and what is left after faults."""

import os
import shutil
import subprocess
import sys
import time
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np
import pytest

from geometry import Body, box, rectangle
from model.results import xdmf as output
from model.results.xdmf import Series, on_body, write_xdmf

pyvista = pytest.importorskip("pyvista")
import h5py  # noqa: E402  (after dolfinx, which output imports)


@pytest.fixture(params=["quadrilateral", "triangle", "hexahedron", "tetrahedron"])
def body(request):
    if request.param in ("quadrilateral", "triangle"):
        return Body.from_grid(rectangle(3, 2, 5, 4, request.param))
    return Body.from_grid(box(1, 1, 1, 2, 2, 3, request.param))


@pytest.fixture
def square():
    return Body.from_grid(rectangle(3, 2, 5, 4))


def fields(body, t=1.0):
    """Fields that can be told apart at every node and cell."""
    x = body.coordinates
    middle = x[body.cells].mean(axis=1)
    stress = np.einsum("ci,cj->cij", middle, middle + t)
    nodes = {"displacement": t * x, "contact_pressure": t * x[:, 0] + x[:, 1]}
    return nodes, {"stress": stress, "von_mises": middle[:, 0] + t}


def assert_same(grid, body, t=1.0):
    """Compare what VTK read with what was written, at the points and cells that VTK has."""
    dim = body.dim
    points = grid.points[:, :dim]
    assert sorted(map(tuple, points)) == sorted(map(tuple, body.coordinates))
    assert grid["displacement"][:, :dim] == pytest.approx(t * points, abs=1e-12)
    assert np.all(grid["displacement"][:, dim:] == 0)
    assert grid["contact_pressure"] == pytest.approx(t * points[:, 0] + points[:, 1], abs=1e-12)
    middle = grid.cell_centers().points[:, :dim]
    assert grid["von_mises"] == pytest.approx(middle[:, 0] + t, abs=1e-12)
    stress = grid["stress"].reshape(-1, 3, 3)[:, :dim, :dim]
    assert stress == pytest.approx(np.einsum("ci,cj->cij", middle, middle + t), abs=1e-12)


def references(path):
    """HDF5 files and datasets that an XDMF file names."""
    items = ElementTree.parse(path).iter("DataItem")
    return [tuple(item.text.split(":")) + (item.get("Dimensions"),) for item in items]


def assert_whole(path):
    """Open every dataset that is named, with h5py; return the number of steps."""
    for name, dataset, dimensions in references(path):
        with h5py.File(path.parent / name) as file:
            assert file[dataset].shape == tuple(map(int, dimensions.split()))
            assert np.isfinite(file[dataset][...]).all()
    return len(ElementTree.parse(path).findall("./Domain/Grid/Grid"))


def test_vtk_reads_what_was_written(body, tmp_path):
    path = tmp_path / "deep" / "solution.xdmf"
    write_xdmf(path, body, *fields(body))
    assert_same(pyvista.read(path), body)
    assert sorted(os.listdir(path.parent)) == ["solution.h5", "solution.xdmf"]
    assert "https" not in path.read_text()


def test_h5py_and_dolfinx_read_it_too(body, tmp_path):
    from dolfinx import io
    from mpi4py import MPI

    path = tmp_path / "solution.xdmf"
    write_xdmf(path, body, *fields(body))
    assert_whole(path)
    with h5py.File(tmp_path / "solution.h5") as file:
        values = file["Function/displacement/0"][:, : body.dim]
        assert values == pytest.approx(file["Mesh/mesh/geometry"][...])
    with io.XDMFFile(MPI.COMM_SELF, path, "r") as file:
        mesh = file.read_mesh(name="mesh")
    assert mesh.topology.index_map(body.dim).size_local == len(body.cells)


def test_plane_bodies_may_have_all_nine_stresses(square, tmp_path):
    stress = np.random.default_rng(3).random((len(square.cells), 3, 3))
    write_xdmf(tmp_path / "solution.xdmf", square, {}, {"stress": stress})
    grid = pyvista.read(tmp_path / "solution.xdmf")
    assert sorted(grid["stress"][:, 8]) == pytest.approx(sorted(stress[:, 2, 2]))


def test_series_is_whole_after_every_step(body, tmp_path):
    path = tmp_path / "ring.xdmf"
    series = Series(path, body)
    assert not path.exists()
    for step, t in enumerate([0.0, 0.1, 0.25]):
        series.write(t, *fields(body, t))
        assert assert_whole(path) == step + 1
    reader = pyvista.get_reader(path)
    assert reader.time_values == [0.0, 0.1, 0.25]
    for t in reader.time_values:
        reader.set_active_time_value(t)
        assert_same(reader.read(), body, t)
    assert sorted(os.listdir(tmp_path)) == ["ring.steps", "ring.xdmf"]


def test_a_new_series_replaces_the_old_one_once_it_is_whole(square, tmp_path):
    path = tmp_path / "ring.xdmf"
    for length in (3, 2, 4):
        before = path.read_text() if path.exists() else None
        series = Series(path, square)
        assert before == (path.read_text() if path.exists() else None)
        for t in range(length):
            series.write(t, *fields(square, t))
            assert assert_whole(path) == t + 1
        assert len(os.listdir(tmp_path)) == 2


def test_a_series_is_resumed(square, tmp_path):
    path = tmp_path / "ring.xdmf"
    whole = Series(path, square)
    for t in range(6):
        whole.write(t, *fields(square, t))
    series = Series(path, square, resume_at=4)
    assert assert_whole(path) == 6
    for t in (4, 5, 6):
        series.write(t, *fields(square, t))
    assert assert_whole(path) == 7
    reader = pyvista.get_reader(path)
    assert reader.time_values == list(range(7))
    reader.set_active_time_value(6.0)
    assert_same(reader.read(), square, 6)
    with pytest.raises(ValueError, match="holds no series"):
        Series(tmp_path / "other.xdmf", square, resume_at=1)
    with pytest.raises(ValueError, match="body with 30 nodes, not"):
        Series(path, Body.from_grid(rectangle(3, 2, 6, 4)), resume_at=1)


WRITER = """
import sys
import numpy as np
from geometry import Body, rectangle
from model.results.xdmf import Series
body = Body.from_grid(rectangle(3, 2, 30, 30))
series = Series("ring.xdmf", body)
for step in range(100_000):
    series.write(step, {"displacement": step * body.coordinates})
    print(step, flush=True)
"""


def test_a_killed_run_leaves_every_finished_step(tmp_path):
    command = [sys.executable, "-c", WRITER]
    with subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, text=True) as process:
        for _ in range(20):
            process.stdout.readline()
        time.sleep(0.0123)
        process.kill()
        printed = process.stdout.read().split()
    last = int(printed[-1]) if printed else 19
    assert assert_whole(tmp_path / "ring.xdmf") in (last + 1, last + 2)
    assert len(pyvista.get_reader(tmp_path / "ring.xdmf").time_values) > 19


@pytest.mark.parametrize(
    ("nodes", "words"),
    [
        ({"u": np.zeros(3)}, r"'u' has shape \(3,\); the body has 30 nodes"),
        ({"u": np.full(30, np.nan)}, "'u' is not finite at nodes 0"),
        ({"a/b": np.zeros(30)}, "'a/b' must consist of letters"),
        ({"s": np.zeros(30)}, "'s' is given for nodes and for cells"),
    ],
)
def test_wrong_fields_get_a_sentence(square, tmp_path, nodes, words):
    with pytest.raises(ValueError, match=words):
        write_xdmf(tmp_path / "solution.xdmf", square, nodes, {"s": np.zeros(20)})
    assert os.listdir(tmp_path) == []


def test_wrong_targets_get_a_sentence(square, tmp_path):
    (tmp_path / "folder.xdmf").mkdir()
    (tmp_path / "file").write_text("good")
    for write in (write_xdmf, lambda path, body, _: Series(path, body)):
        with pytest.raises(ValueError, match="folder.xdmf is a folder"):
            write(tmp_path / "folder.xdmf", square, {})
        with pytest.raises(ValueError, match="file/x.xdmf cannot be written: (Not a dir|File exists)"):
            write(tmp_path / "file" / "x.xdmf", square, {})
        with pytest.raises(ValueError, match=r"'x.vtk' must end in .xdmf"):
            write("x.vtk", square, {})


@pytest.mark.parametrize("fault", ["disk is full", "dolfinx fails"])
def test_a_fault_leaves_what_was_there(square, tmp_path, monkeypatch, fault):
    path = tmp_path / "solution.xdmf"
    write_xdmf(path, square, *fields(square))
    before = {file: Path(tmp_path / file).read_bytes() for file in os.listdir(tmp_path)}
    if fault == "disk is full":
        usage = shutil.disk_usage(tmp_path)._replace(free=1000)
        monkeypatch.setattr(output.shutil, "disk_usage", lambda _: usage)
        words = "No space left"
    else:

        def fail(*_):
            raise RuntimeError("Failed to write HDF5 local dataset.")

        monkeypatch.setattr(output.io.XDMFFile, "write_function", fail)
        words = "Failed to write HDF5"
    with pytest.raises(ValueError, match=f"solution.h5 cannot be written: {words}"):
        write_xdmf(path, square, *fields(square, 2.0))
    assert before == {file: Path(tmp_path / file).read_bytes() for file in os.listdir(tmp_path)}


def test_values_are_spread_over_the_body():
    assert on_body(4, np.array([2, 0]), np.array([5.0, 6.0])).tolist() == [6, 0, 5, 0]
    assert on_body(3, np.array([1]), np.array([2]), elsewhere=-1).tolist() == [-1, 2, -1]
    assert on_body(2, np.array([1]), np.array([[2.0, 3.0]])).tolist() == [[0, 0], [2, 3]]


def test_vtkhdf_holds_the_same_series(body, tmp_path):
    from vtkmodules.vtkIOHDF import vtkHDFReader

    from model.results.vtkhdf import write_vtkhdf

    series = Series(tmp_path / "ring.xdmf", body)
    for t in (0.0, 0.1, 0.25):
        series.write(t, *fields(body, t))
    reader = vtkHDFReader()
    reader.SetFileName(str(write_vtkhdf(tmp_path / "ring.xdmf")))
    reader.UpdateInformation()
    assert reader.GetNumberOfSteps() == 3
    for step, t in enumerate((0.0, 0.1, 0.25)):
        reader.SetStep(step)
        reader.Update()
        assert_same(pyvista.wrap(reader.GetOutput()), body, t)
    with pytest.raises(ValueError, match="no XDMF file"):
        write_vtkhdf(tmp_path / "other.xdmf")
