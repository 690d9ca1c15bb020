"""The rod pulled to and fro: hysteresis and the dependence on the path, as the closed forms have them."""

import pytest

DEMO = "load_paths"


def test_quick_demo(quick):
    results = quick.results
    assert results["displacement[Q_m]"] == pytest.approx(0.04, rel=1e-9)
    assert results["largest_error_of_the_loop"] < 2e-3
    assert results["taken_in_a_cycle"] == pytest.approx(2 * 0.2**3 / 1.5, rel=1e-6)
    assert results["max_coulomb_violation"] < 1e-15
    assert results["displacement[w/2, then Q, then w]"] == pytest.approx(
        2 * results["displacement[w, then Q]"], rel=1e-9
    )
    assert results["difference_of_the_loads"] < 1e-12
    assert quick.summary["cost"]["residual"] < 1e-12
    for name in ("load_paths.png", "rod.xdmf", "rod_road.xdmf", "problem.npz"):
        assert (quick.out / name).stat().st_size > 500
