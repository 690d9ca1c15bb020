"""The study of finite strain, in its quick form."""

import pytest

DEMO = "reports/finite_strain"


def test_quick_study(quick):
    results = quick.results
    key = "finite, mu=0.5, dt=0.01"
    assert results[f"second_touch[{key}]"] == pytest.approx(0.97, abs=1e-9)
    assert results[f"rotation[{key}]"] == pytest.approx(-5.38, abs=0.006)
    assert results["off_linear_over_speed[v0=0.001]"] == pytest.approx(6.8e-7, rel=0.05)
    assert results["incline_acceleration[mu=0.05, 96 cells]"] == pytest.approx(1.2204, rel=0.003)
    assert results["force[r=0.2, 96 x 10, mu=0.5, 30%]"] == pytest.approx(59.50, abs=0.006)
    lossy, kept = (
        "rolling_energy_loss[energy-momentum, dt={}]",
        "rolling_energy_loss[lossless contact, dt={}]",
    )
    assert 0.0 < results[lossy.format(0.01)] < results[lossy.format(0.02)]
    assert abs(results[kept.format(0.01)]) < 1e-9
    assert results["max_energy_gain"] < 1e-10 and results["spin_error"] < 1e-11
    assert results["creepage"] == pytest.approx(1.697e-3, rel=0.07)
    assert results["incline_threshold"] == pytest.approx(0.0648, rel=0.03)
    assert results["ball_spin_change[vertical, no friction]"] < 1e-9
    assert results["cost_ratio_to_linear_step"] > 1.0
    taken = results["rolling_friction_a_revolution[48 x 6 cells, dt=0.01]"]
    assert -1e-15 <= taken < 1e-3  # of the energy: rounding where no node slips
    finite = [results[f"error[finite, energy-momentum, dt={dt}]"] for dt in (0.02, 0.01, 0.005)]
    assert finite[2] < finite[0] and finite[2] < results["error_of_the_linear_model"]
    for correction in ("direct", "multigrid", "algebraic"):
        assert results[f"off[{correction}, 375 unknowns]"] < 1e-9
    assert results["iterations[none, 375 unknowns]"] > results["iterations[direct, 375 unknowns]"]
    for name in ("rolling", "error_over_dt", "error_over_run_time"):
        assert (quick.out / f"{name}.png").stat().st_size > 10_000
