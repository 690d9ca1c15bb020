"""The study of the rod's orders, in its quick form."""

DEMO = "reports/rod_orders"


def test_quick_study(quick):
    results = quick.results
    for name in ("contact-stabilised", "mass redistribution"):
        assert results[f"order_of_displacement_until_release[{name}]"] > 0.85
        assert abs(results[f"energy_at_end[{name},dt=0.005]"] / 0.125 - 1.0) < 0.01
    assert quick.summary["cost"]["residual"] <= 1e-10
    for name in ("order_of_pressure.png", "pressure_against_run_time.png", "energy_against_dt.png"):
        assert (quick.out / name).stat().st_size > 10_000
