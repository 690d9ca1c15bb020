"""A rubber ring that rolls at a slip angle: its side force is odd, grows linearly, and ends at friction's."""

import numpy as np
import pytest
from harness.tyres import side_force

pytestmark = pytest.mark.filterwarnings("ignore::model.UnresolvedWaves")


def test_side_force_over_slip_angle():
    found = {}
    for degrees in (0.0, 1.0, -1.0, 2.0, 12.0):
        run = side_force(np.radians(degrees), mu=0.3, way=0.16, mesh=(32, 2, 2))
        last = len(run.way) // 4
        found[degrees] = np.mean(run.side[-last:] / run.load[-last:]) / 0.3
    assert abs(found[0.0]) < 1e-9
    assert found[-1.0] == pytest.approx(-found[1.0], rel=1e-6)
    assert found[2.0] / found[1.0] == pytest.approx(2.0, abs=0.1)
    assert 0.8 < found[12.0] <= 1.0 + 1e-9
