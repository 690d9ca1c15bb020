"""Section 3.1.1 of the paper, in its quick form."""

import numpy as np

DEMO = "section_3_1_1_normal_loading"


def test_quick_demo(quick):
    out, summary, results = quick.out, quick.summary, quick.results
    assert abs(results["p0[mu=0]"] / 8570.66 - 1) < 0.002
    assert results["a_lower[mu=0]"] < 0.74279 < results["a_upper[mu=0]"]
    assert abs(results["a[mu=0]"] / 0.74279 - 1) < 0.01
    for mu in ("mu=0", "mu=0.5"):
        assert results[f"min_gap[{mu}]"] == results[f"min_pressure[{mu}]"] == 0.0
        assert results[f"force_balance_error[{mu}]"] < 1e-10
        assert results[f"max_coulomb_violation[{mu}]"] < 1e-12
    assert results["pressure_L2_error[mu=0]"] < 0.05
    assert abs(results["stick_half_width[mu=0.5]"] / 0.678662 - 1) < 0.05
    assert results["p0[mu=0.5]"] > results["p0[mu=0]"]
    assert results["a[mu=0.5]"] < results["a[mu=0]"]
    assert summary["cost"]["residual"] < 1e-10
    for name in ("figure_3b.png", "figure_4.png", "figure_5.png", "frictionless.xdmf", "friction.h5"):
        assert (out / name).stat().st_size > 1000
    with np.load(out / "problem.npz") as problem:
        assert problem["friction_coefficient"] == 0.5
        assert problem["displacement"].shape == problem["coordinates"].shape
