"""The rod that its weight stretches down to a road: by hand and from UFL as the closed form has it."""

import pytest
from harness.rods import hanging_rod

DEMO = "hanging_rod"


def test_quick_demo(quick):
    out, results = quick.out, quick.results
    for way in ("by hand", "UFL"):
        assert results[f"pressure[{way}]"] == pytest.approx(1200 * 9.81 / 2 - 2000, rel=1e-11)
        assert results[f"largest_error_of_u[{way}]"] < 1e-12
    assert results["min_gap"] == 0.0
    assert quick.summary["cost"]["residual"] < 1e-10
    for name in ("rod.png", "rod.xdmf", "rod_road.xdmf", "problem.npz"):
        assert (out / name).stat().st_size > 500


@pytest.mark.parametrize("gap", [0.0, 1e-3, 5e-3, 7e-3])
def test_by_hand_is_the_closed_form(quick, gap):
    y, u, p = quick.names["by_hand"](gap)
    exact, _, pressure = hanging_rod(y, 1.0, 1e6, 1200 * 9.81, gap)
    assert u == pytest.approx(exact, abs=1e-15) and p == pytest.approx(pressure, abs=1e-8)
