"""Steady rolling under torque: Carter's creepage, where it sticks, and what friction takes."""

import pytest
from harness.driven_wheel import creepage, rolled

from model import HertzCylinder

SMALL = 100.0  # N/mm


def test_creepage_is_carters_as_mesh_and_step_go_to_zero():
    coarse, fine = (creepage(SMALL, 0.49, *sizes, finite=False) for sizes in ((4, 1), (8, 2)))
    assert fine.closed.creepage == pytest.approx(1.697e-3, rel=1e-3)
    assert abs(fine.off) < 0.05 and abs(fine.off) < 0.5 * abs(coarse.off)
    assert fine.stick == pytest.approx(0.5, abs=0.03)
    assert fine.work == pytest.approx(1.0, abs=0.01)


def test_coupling_takes_creep_away():
    off = [creepage(SMALL, nu, 6, 2, way=2.5, finite=False).off for nu in (0.3, 0.45, 0.49)]
    assert off[0] < off[1] < off[2] < 0.0


def test_free_rolling_slips_nowhere_without_coupling():
    free = rolled(HertzCylinder(P=SMALL, R=10.0, E=210e3, nu=0.499), 0.0, 0.5, 6, 1, 2.5, finite=False)
    assert free.stick == 1.0 and abs(free.work) < 1e-4 * 0.5 * SMALL * 1.697e-3
    assert abs(free.creep) < 0.05 * 1.697e-3


def test_finite_strain_says_the_same():
    linear, finite = (creepage(SMALL, 0.49, 4, 1, way=2.25, finite=kind) for kind in (False, True))
    assert finite.creepage == pytest.approx(linear.creepage, rel=0.03)
