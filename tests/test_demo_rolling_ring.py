"""The lesson on the ring that rolls, in its quick form."""

import pytest

DEMO = "rolling_ring"


def test_quick_lesson(quick):
    results = quick.results
    linear, finite = "linear, mu=0.1", "finite, mu=0.1"
    assert results[f"second_touch[{finite}]"] == pytest.approx(1.03, abs=1e-9)
    assert results[f"rotation[{finite}]"] == pytest.approx(-1.141, abs=0.0006)
    assert results[f"energy_at_the_end[{finite}]"] == pytest.approx(24.95, abs=0.006)
    assert (
        abs(results[f"mean_radius_change[{finite}]"]) < 0.005 < 0.2 < results[f"mean_radius_change[{linear}]"]
    )
    assert results[f"max_energy_gain[{finite}]"] < 1e-10
    assert results["sliding_to_rolling_time"] == pytest.approx(0.748, rel=0.01)
    for name in ("outlines", "swelling", "sliding_to_rolling"):
        assert (quick.out / f"{name}.png").stat().st_size > 10_000
    assert (quick.out / "ring.xdmf").exists()
