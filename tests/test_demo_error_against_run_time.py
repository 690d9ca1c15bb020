"""The report of error against run time, in its quick form."""

import json
import subprocess
import sys
from pathlib import Path

DEMO = Path(__file__).parents[1] / "demos" / "error_against_run_time.py"


def test_quick_report(tmp_path):
    subprocess.run([sys.executable, DEMO, "--quick", "--out", tmp_path], check=True, cwd=tmp_path)
    out = tmp_path / "error_against_run_time"
    summary = json.loads((out / "summary.json").read_text())
    results = {key: result["value"] for key, result in summary["results"].items()}
    cycles = [value for key, value in results.items() if key.startswith("cycles[")]
    assert max(cycles) <= 16
    assert max(cycles) - min(cycles) <= 2
    assert abs(results["p0[mesh-converged]"] / 8559 - 1) < 0.005
    assert results["cost_ratio_to_linear_solve"] < 3.0
    depths = [value for key, value in results.items() if key.startswith("penetration")]
    assert depths == sorted(depths, reverse=True)
    assert depths[-1] > 0.0
    assert summary["cost"]["residual"] <= 1e-8
    for name in (
        "algebraic_error.png",
        "error_against_run_time.png",
        "seconds_per_unknown.png",
        "hertz.xdmf",
        "problem.npz",
    ):
        assert (out / name).stat().st_size > 1000
