"""The tread block, in its quick form: nodes on the road, friction about mu, area growing with the load."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from geometry import read_samples

DEMO = Path(__file__).parents[1] / "demos" / "tread_block.py"


def test_quick_tread(tmp_path):
    subprocess.run([sys.executable, DEMO, "--quick", "--out", tmp_path], check=True, cwd=tmp_path)
    out = tmp_path / "tread_block"
    results = json.loads((out / "summary.json").read_text())["results"]
    for name in ("2-D", "2-D cords", "3-D"):
        assert results[f"off_the_road[{name}]"]["value"] <= 1e-12
        assert results[f"residual[{name}]"]["value"] <= 1e-8
        assert 0.3 < results[f"real_area[{name}]"]["value"] < 1
        assert results[f"friction_at_the_end[{name}]"]["value"] == pytest.approx(0.8, rel=0.1)
    assert results["real_area[2-D cords]"]["value"] < results["real_area[2-D]"]["value"]
    assert len(read_samples(out / "road.csv")[0]) == 300
    for name in (
        "area_and_friction.png",
        "stick_and_slip_2d.png",
        "stick_and_slip_3d.png",
        "on_the_road_3d.png",
        "problem.npz",
        "tread.xdmf",
        "tread_3d.h5",
    ):
        assert (out / name).stat().st_size > 1000
