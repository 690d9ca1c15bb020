"""The study of tread blocks, in its quick form: cords, and blocks in space."""

import pytest

DEMO = "reports/tread_blocks"


def test_quick_study(quick):
    out, results = quick.out, quick.results
    for name in ("2-D", "2-D cords", "3-D"):
        assert results[f"off_the_road[{name}]"] <= 1e-12
        assert results[f"residual[{name}]"] <= 1e-8
        assert 0.3 < results[f"real_area[{name}]"] < 1
        assert results[f"friction_at_the_end[{name}]"] == pytest.approx(0.8, rel=0.1)
    assert results["real_area[2-D cords]"] < results["real_area[2-D]"]
    for name in ("area_and_friction.png", "stick_and_slip_3d.png", "on_the_road_3d.png", "tread_3d.h5"):
        assert (out / name).stat().st_size > 1000
