"""The tread block, in its quick form: nodes on the road, friction about mu, area growing with the load."""

import numpy as np
import pytest

from geometry import read_samples

DEMO = "tread_block"


def test_quick_tread(quick):
    out, results = quick.out, quick.results
    for name in ("2-D", "flat road"):
        assert results[f"off_the_road[{name}]"] <= 1e-12
        assert results[f"residual[{name}]"] <= 1e-8
        assert results[f"friction_at_the_end[{name}]"] == pytest.approx(0.8, rel=0.1)
    assert 0.1 < results["largest_strain[2-D]"] < 0.45  # missed, as the page of known defects says
    assert 0.3 < results["real_area[2-D]"] < results["real_area[flat road]"]
    assert len(read_samples(out / "road.csv")[0]) == 300
    for name in ("area_and_friction.png", "stick_and_slip_2d.png", "problem.npz", "tread.xdmf"):
        assert (out / name).stat().st_size > 1000
    for name in ("tread", "tread_road"):
        assert (out / f"{name}.xdmf").read_text().count("<Time") == 24
    with np.load(out / "problem.npz") as problem:
        assert problem["displacement"].shape == problem["coordinates"].shape
