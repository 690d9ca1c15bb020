"""The rod against a wall, in its quick form: pressure, release, energy."""

import csv

import numpy as np

DEMO = "rod_impact"
STABILISED = ("contact-stabilised", "mass redistribution")


def test_quick_demo(quick):
    out, summary, results = quick.out, quick.summary, quick.results
    for name in STABILISED:
        assert results[f"pressure_off_by[{name}]"] < 0.05
        assert abs(results[f"release[{name}]"] - 2.0) <= 1.0001 * 0.01  # dt
        assert results[f"touches[{name}]"] == 1
        assert results[f"max_energy_gain[{name}]"] < 1e-12
        assert abs(results[f"energy_at_end[{name}]"] / 0.125 - 1.0) < 0.01
    assert results["newmark_energy_identity_error"] < 1e-12
    assert results["touches[Newmark]"] > 5
    assert results["max_energy_gain[Newmark]"] > 1e-3
    assert results["pressure_off_by[Newmark]"] > 0.5
    assert summary["cost"]["residual"] <= 1e-10

    assert (out / "impact.png").stat().st_size > 10_000
    assert (out / "rod.xdmf").read_text().count("<Time") == 30 and (out / "rod_road.xdmf").exists()
    with open(out / "history_mass_redistribution.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert float(rows[-1]["time"]) == 3.0
    with np.load(out / "problem.npz") as problem:
        assert problem["contact_force"].shape == problem["normal"].shape
        assert problem["contact_force"].any()
