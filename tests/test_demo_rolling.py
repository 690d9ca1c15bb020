"""The lesson on the ring that rolls, in its quick form."""

import numpy as np
import pytest

DEMO = "rolling"


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
    for at in (linear, finite):
        assert results[f"momentum_error[{at}]"] < 1e-9
    assert results["rolling_speed"] == pytest.approx(1.266, rel=0.01)
    assert results["sliding_to_rolling_time"] == pytest.approx(0.748, rel=0.01)
    assert results["incline_acceleration"] == pytest.approx(1.0772, rel=0.01)
    assert results["incline_threshold"] == pytest.approx(0.0648, rel=0.03)
    assert results["final_speed[paper ring]"] == pytest.approx(6.329, rel=0.08)
    assert results["creepage"] == pytest.approx(1.697e-3, rel=0.15)
    assert results["max_energy_gain"] < 1e-10 and results["spin_error"] < 1e-11
    assert results["newton_iterations_median"] <= 8 and results["cost_ratio_to_linear_step"] > 1.0
    assert abs(results["rolling_energy_loss"]) < 1e-10
    assert results["rolling_energy_loss[energy-momentum]"] > 1e-3
    assert abs(results["rolling_energy_loss[energy-momentum, lossless contact]"]) < 1e-10
    for name in ("outlines", "swelling", "sliding_to_rolling"):
        assert (quick.out / f"{name}.png").stat().st_size > 10_000
    with np.load(quick.out / "problem.npz") as problem:
        assert problem["contact_force"][:, 1].max() > 0.0


def test_series_for_paraview(quick):
    reader = pytest.importorskip("pyvista").get_reader(quick.out / "ring.xdmf")
    reader.set_active_time_value(0.36)
    data = reader.read().point_data
    touches = np.asarray(data["status"]) > 0
    assert touches.any() and not np.asarray(data["gap"])[touches].any()
    assert np.asarray(data["contact_pressure"])[touches].max() > 0.0
    assert not np.asarray(data["contact_pressure"])[~touches].any()
    assert (quick.out / "ring_road.xdmf").exists()
