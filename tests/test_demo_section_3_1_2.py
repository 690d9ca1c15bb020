"""Section 3.1.2 of the paper, in its quick form."""

import numpy as np

DEMO = "section_3_1_2_tangential_loading"


def test_quick_demo(quick):
    out, results = quick.out, quick.results
    for name in ("subsequent", "initial"):
        assert results[f"max_coulomb_violation[{name}]"] < 1e-12
        assert results[f"tangential_force_error[{name}]"] < 1e-10
        assert results[f"force_balance_error[{name}]"] < 1e-10
        assert results[f"max_slip_power[{name}]"] <= 0.0
        assert results[f"min_gap[{name}]"] == results[f"min_pressure[{name}]"] == 0.0
        assert 1.0 < results[f"p0[{name}]"] / 8570.66 < 1.1  # friction makes the peak grow
        assert abs(results[f"contact_from[{name}]"] + 0.74279) < 0.1  # within a cell
        assert results[f"stick_from[{name}]"] + results[f"stick_to[{name}]"] > 0.0  # towards the leading edge
    assert results["stick_to[initial]"] == results["contact_to[initial]"]  # and up to it
    assert results["stick_to[subsequent]"] < results["contact_to[subsequent]"]
    assert abs(results["c_over_a[uncoupled]"] / 0.5 - 1) < 0.04
    assert results["tau_L2_error[uncoupled]"] < 0.08
    assert abs(results["patch_centre[uncoupled]"]) < 0.02 and abs(results["stick_centre[uncoupled]"]) < 0.02
    for name in ("figure_6.png", "figure_7.png", "uncoupled.png", "initial.xdmf"):
        assert (out / name).stat().st_size > 1000
    with np.load(out / "problem.npz") as problem:
        assert problem["contact_force"].shape == problem["normal"].shape
