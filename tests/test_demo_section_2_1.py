"""Section 2.1 of the paper with the user's own mesh and forms, in its quick form."""

import numpy as np

DEMO = "section_2_1_own_forms"


def test_quick_demo(quick):
    out, results = quick.out, quick.results
    assert abs(results["pressure"] / 0.1 - 1) < 1e-10
    assert results["largest_error_of_pressure"] < 1e-10
    assert results["force_balance_error"] < 1e-10
    assert results["min_gap[plane]"] == results["min_gap[hill]"] == 0.0
    assert results["nodes_in_contact[hill]"] > 5
    assert results["residual[hill]"] <= 1e-10
    assert abs(results["mean_pressure_in_time"] / 0.12 - 1) < 0.01
    for name in ("pressure_on_the_hill.png", "pressure_in_time.png", "hill.xdmf"):
        assert (out / name).stat().st_size > 1000
    with np.load(out / "problem.npz") as problem:
        assert problem["displacement"].shape == problem["coordinates"].shape
