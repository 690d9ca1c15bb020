"""The study of the rough road's steps, in its quick form."""

DEMO = "reports/rough_road_steps"


def test_quick_study(quick):
    results = quick.results
    assert results["max_energy_gain[mass redistribution]"] <= 1e-12
    for name in ("contact-stabilised", "mass redistribution"):
        assert results[f"energy_taken[{name},dt=0.002]"] > 0.0
        assert results[f"off_the_road[{name},dt=0.002]"] <= 1e-12
    assert results["level_of_rough_over_plane[125 Hz]"] > 0.0
    assert (quick.out / "spectrum.png").stat().st_size > 10_000
