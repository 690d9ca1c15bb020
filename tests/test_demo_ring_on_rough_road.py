"""The ring on a rough road, in its quick form: on the road, no energy gained, shaken more than on a plane."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np

DEMO = Path(__file__).parents[1] / "demos" / "ring_on_rough_road.py"


def test_quick_ring(tmp_path):
    subprocess.run([sys.executable, DEMO, "--quick", "--out", tmp_path], check=True, cwd=tmp_path)
    out = tmp_path / DEMO.stem
    summary = json.loads((out / "summary.json").read_text())
    results = {key: result["value"] for key, result in summary["results"].items()}
    for road in ("rough", "plane"):
        assert results[f"off_the_road[{road}]"] <= 1e-12
        assert results[f"min_gap[{road}]"] == results[f"min_pressure[{road}]"] == 0.0
        assert results[f"max_coulomb_violation[{road}]"] <= 1e-12
        assert results[f"max_energy_gain[{road}]"] <= 1e-4
        assert results[f"energy_change[{road}]"] < 0.0
        assert results[f"momentum_error[{road}]"] <= 1e-11
        assert abs(results[f"first_touch[{road}]"] - 0.319) < 0.01
    assert results["max_energy_gain[mass redistribution]"] <= 1e-12
    assert results["level_of_rough_over_plane[125 Hz]"] > 0.0
    assert results["difference_of_the_step_solved_anew"] <= 1e-9
    assert summary["cost"]["residual"] <= 1e-9
    for name in (
        "spectrum.png",
        "ring_on_the_road.png",
        "force.png",
        "energy_ledger.png",
        "ring.xdmf",
        "road.csv",
    ):
        assert (out / name).stat().st_size > 1000
    with np.load(out / "problem.npz") as problem:
        assert problem["displacement"].shape == problem["coordinates"].shape
