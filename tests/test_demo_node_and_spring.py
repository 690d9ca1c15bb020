"""The loop by hand: it meets the closed form of the string, and the package."""

import numpy as np
import pytest

DEMO = "node_and_spring"


def test_quick_demo(quick):
    out, summary, results = quick.out, quick.summary, quick.results
    assert abs(results["contact_begins"] - np.sqrt(0.2)) < 2.0 / 32
    assert results["largest_error_of_u"] < 3 / 32**2
    assert results["equilibrium_error"] < 1e-14
    assert results["min_gap"] == results["min_force"] == 0.0
    assert results["package_against_hand"] < 1e-10
    assert summary["cost"]["residual"] < 1e-12
    for name in ("one_node.png", "string.png", "problem.npz", "string.xdmf", "string_road.xdmf"):
        assert (out / name).stat().st_size > 500


@pytest.mark.parametrize("b", [-3.0, -1.0, -0.2, 2.0])
def test_one_node_obeys_the_conditions(quick, b):
    u, p = quick.names["one_node"](2.0, b, 0.4)
    assert p >= 0 and 0.4 + u >= 0 and p * (0.4 + u) == 0
    assert 2.0 * u - b - p == 0
