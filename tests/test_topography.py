"""Roads from instruments: libraries that may not be there, and a clear sentence where they are not."""

import sys

import numpy as np
import pytest

from geometry import SmoothRoad, read_topography, samples_of


def test_a_library_that_is_not_installed_is_named(tmp_path, monkeypatch):
    for name, suffix in (("SurfaceTopography", ".sur"), ("pyopencrg", ".crg")):
        monkeypatch.setitem(sys.modules, name, None)
        (tmp_path / f"scan{suffix}").write_text("?")
        with pytest.raises(ImportError, match=f"{name}, which is not installed; `pip install {name}`"):
            read_topography(tmp_path / f"scan{suffix}")
    with pytest.raises(ValueError, match="no file"):
        read_topography(tmp_path / "none.sur")


def test_open_crg(tmp_path):
    crg = pytest.importorskip("pyopencrg")
    heights = 1e-3 * np.random.default_rng(2).normal(size=(5, 4))
    crg.CrgRoad(heights, 0.5, v=[-1.0, 0.0, 0.5, 2.0]).save(str(tmp_path / "road.crg"))
    positions, z = read_topography(tmp_path / "road.crg", unit="mm")
    np.testing.assert_allclose(np.unique(positions[:, 0]), 500 * np.arange(5), atol=1e-9)
    np.testing.assert_allclose(np.unique(positions[:, 1]), [-1000, 0, 500, 2000], atol=1e-9)
    np.testing.assert_allclose(z.reshape(5, 4), 1e3 * heights, atol=1e-4)
    gap = SmoothRoad.through(positions, z).closest(np.array([[500.0, 500.0, z[6]]]))[0]
    assert abs(gap[0]) < 1e-9
    (tmp_path / "road.crg").write_text("no road")
    with pytest.raises(ValueError, match="pyopencrg cannot read"):
        read_topography(tmp_path / "road.crg")


def test_surface_topography(tmp_path):
    library = pytest.importorskip("SurfaceTopography")
    heights = np.random.default_rng(2).normal(size=(3, 4))
    library.Topography(heights, (3.0, 8.0), unit="um").to_netcdf(str(tmp_path / "scan.nc"))
    positions, z = read_topography(tmp_path / "scan.nc", unit="nm")
    np.testing.assert_allclose(positions.reshape(3, 4, 2)[:, 0, 0], [0, 1e3, 2e3])
    np.testing.assert_allclose(positions.reshape(3, 4, 2)[0, :, 1], [0, 2e3, 4e3, 6e3])
    np.testing.assert_allclose(z.reshape(3, 4), 1e3 * heights)
    line = library.NonuniformLineScan([0.0, 1.0, 4.0], [0.0, 1.0, 2.0], unit="mm")
    np.testing.assert_allclose(samples_of(line), [[0, 1, 4], [0, 1, 2]])
    holes = library.Topography(np.ma.masked_array(heights, heights > 1), (3.0, 8.0))
    with pytest.raises(ValueError, match="samples are undefined.*clean=True"):
        samples_of(holes)
    with pytest.raises(ValueError, match="no unit"):
        samples_of(holes, unit="mm", clean=True)
    with pytest.warns(UserWarning, match="left out"):
        assert len(samples_of(holes, clean=True)[1]) == np.sum(heights <= 1)
    (tmp_path / "scan.sur").write_text("no scan")
    with pytest.raises(ValueError, match="SurfaceTopography cannot read"):
        read_topography(tmp_path / "scan.sur")
