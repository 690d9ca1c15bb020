"""Friction by hand: Coulomb's law at a node, and slip in a rod as the closed form has it."""

import numpy as np
import pytest

DEMO = "sticks_or_slips"


def test_quick_demo(quick):
    results = quick.results
    assert abs(results["last_that_sticks"] - 0.4) <= 1.0001 / 20
    assert results["displacement_of_the_end"] == pytest.approx(0.09, rel=1e-9)
    assert results["largest_error_of_u"] < 1e-12
    assert results["friction_beyond_mu_p"] < 1e-12
    assert results["package_against_hand"] < 1e-10
    assert quick.summary["cost"]["residual"] < 1e-12
    for name in ("one_node.png", "rod.png", "problem.npz"):
        assert (quick.out / name).stat().st_size > 1000


def test_the_file_shows_what_sticks(quick):
    grid = pytest.importorskip("pyvista").read(quick.out / "rod.xdmf")
    order = np.argsort(grid.points[:, 0])
    status = np.asarray(grid["status"])[order]
    assert len(status) == 21 and list(status) == sorted(status, reverse=True)
    assert set(status) == {1, 2}
    assert np.allclose(np.asarray(grid["contact_pressure"]), 1.0)


@pytest.mark.parametrize("pull", np.linspace(-2, 2, 9))
def test_one_node_obeys_coulomb(quick, pull):
    k, b = np.array([[2.0, 0.3], [0.3, 1.0]]), np.array([pull, -2.0])
    u, force, status = quick.names["one_node_with_friction"](k, b, 1.0, 0.5)
    assert np.allclose(k @ u, b + force)
    assert abs(force[0]) <= 0.5 * force[1] + 1e-14 and u[1] == -1.0
    assert u[0] == 0.0 if status == "stick" else u[0] * force[0] < 0
