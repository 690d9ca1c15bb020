"""The study of the ring's time steps, in its quick form."""

DEMO = "reports/ring_time_steps"


def test_quick_study(quick):
    results = quick.results
    for name in ("contact-stabilised", "mass redistribution"):
        assert results[f"order_of_energy[{name}, 576 quads]"] > 0.7
        assert results[f"error_of_energy[{name}, 576 quads,dt=0.0025]"] < 0.01
    assert results["speedup_over_loop"] > 1.0
    assert results["cost_ratio_to_linear_steps"] > 0.0
    assert quick.summary["cost"]["residual"] <= 1e-10
    for name in ("energy_against_dt", "energy_against_run_time", "height_of_A_against_dt"):
        assert (quick.out / f"{name}.png").stat().st_size > 10_000
