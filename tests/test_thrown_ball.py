"""A ball thrown in space: momentum, spin and energy of the whole way."""

import numpy as np
import pytest
from harness.thrown_ball import GRAVITY, RADIUS, thrown

from model import EnergyMomentum, LosslessContact

pytestmark = pytest.mark.filterwarnings("ignore::model.UnresolvedWaves")


@pytest.mark.parametrize("method", [EnergyMomentum, LosslessContact])
def test_in_flight_and_without_friction_its_spin_stays(method):
    spinning = {"mu": None, "cells": 6, "height": 0.02, "method": method}
    ride = thrown((1.0, 0.5, -1.0), (1.0, -2.0, 5.0), 0.1, **spinning)
    assert ride.history["contacts"].max() >= 1
    assert np.abs(ride.spin[:, 2] - 5.0).max() < 5.0 * 1e-9
    assert np.abs(ride.velocity[:, :2] - [1.0, 0.5]).max() < 1e-9
    before = ride.time < 0.012
    assert np.abs(ride.spin[before] - [1.0, -2.0, 5.0]).max() < 1e-11 * 5.0
    assert ride.velocity[before, 2] == pytest.approx(-1.0 - GRAVITY * ride.time[before])


def test_friction_turns_speed_into_spin_about_the_road():
    """k R (omega - omega0) = v0 - v for a rigid ball: angular momentum about the road's line under it."""
    ride = thrown((2.0, 0.0, 0.0), (0.0, -1.0, 0.0), 0.15, cells=6)
    k = 1.0 / ride.rolling - 1.0
    lost, turned = 2.0 - ride.velocity[-1, 0], k * RADIUS * (ride.spin[-1, 1] + 1.0)
    assert 0.1 < lost < 1.0 and turned == pytest.approx(lost, rel=0.1)
    assert np.abs(ride.velocity[:, 1]).max() < 1e-8
    kinetic = ride.history["kinetic"][0]
    assert abs(ride.history["total"][0] - ride.history["total"][-1]) < 1e-9 * kinetic
    assert ride.history["gain"].max() < 1e-10 * kinetic
