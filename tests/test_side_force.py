"""A rubber ring that rolls at a slip angle: its side force is odd, grows linearly, and ends at friction's."""

import numpy as np
import pytest
from harness.tyres import side_force

pytestmark = pytest.mark.filterwarnings("ignore::model.UnresolvedWaves")


def test_side_force_over_slip_angle():
    found = {}
    for degrees in (0.0, 0.5, -0.5, 1.0, 12.0):
        run = side_force(np.radians(degrees), mu=0.2, way=0.24, mesh=(32, 2, 2))
        last = len(run.way) // 4
        found[degrees] = np.mean(run.side[-last:] / run.load[-last:]) / 0.2
    assert abs(found[0.0]) < 1e-9
    assert found[-0.5] == pytest.approx(-found[0.5], rel=1e-6)
    assert found[1.0] / found[0.5] == pytest.approx(2.0, abs=0.1)
    assert 0.6 < found[12.0] <= 1.0 + 1e-9  # of three rows in contact one has just landed, and sticks yet
