"""Multigrid by hand: cycles do not grow with the mesh, no step goes uphill, the answer is the package's."""

import numpy as np
import pytest
from harness.string_multigrid import cycle
from harness.strings import string

DEMO = "multigrid_by_hand"


def test_quick_demo(quick):
    results = quick.results
    for n in (31, 63, 127, 255, 511):
        assert results[f"cycles[n={n}]"] <= 12
    assert results["left_by_a_cycle"] < 0.5 * results["left_by_a_sweep"] < 0.5
    assert results["largest_error_of_u[n=63]"] < 3 / 64**2
    assert results["package_against_hand"] < 1e-10
    for name in ("cycles.png", "string.xdmf", "problem.npz"):
        assert (quick.out / name).stat().st_size > 1000


@pytest.mark.parametrize("truncate", [True, False])
def test_no_cycle_goes_uphill_or_below_the_road(truncate):
    K, b, lower, *_ = string(63)
    u = np.random.default_rng(0).uniform(lower, 0.1)
    energy = []
    for _ in range(10):
        cycle(K, b, lower, u, truncate)
        energy.append(0.5 * u @ K @ u - b @ u)
        assert (u >= lower).all()
    assert (np.diff(energy) <= 1e-14).all()
