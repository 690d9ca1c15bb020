"""The rod against a wall: what a teacher shows of each integrator."""

import numpy as np
import pytest
from bodies_in_motion import NEVER_GAIN, rod, steps

from model import CentralDifferences, History, Newmark, Status, integrate
from model.closed_forms.rod import RodImpact

exact = RodImpact()


def impact(scheme, start, until=3.0):
    first = scheme.start(start)
    history = History(scheme, first, {"end": int(np.argmin(scheme.body.coordinates[:, 0]))})
    for _ in integrate(scheme, first, round(until / scheme.dt), history):
        pass
    return history


@pytest.mark.parametrize("scheme", [*NEVER_GAIN, CentralDifferences])
def test_pressure_and_release(scheme):
    moving, start = rod(200)
    scheme = scheme(moving, 0.004 if scheme is CentralDifferences else 0.01)
    history = impact(scheme, start, 2.2)
    time, pressure = history["time"], history["force_x"]
    steady = (time > 1.1) & (time < 1.9)
    assert np.abs(pressure[steady] - 0.5).max() < 0.05 * 0.5
    touching = time[history["contacts"] > 0]
    assert abs(touching[-1] - 2.0) <= 1.0001 * 0.01
    assert len(history.touches("end")) == 1


@pytest.mark.parametrize("scheme", NEVER_GAIN)
def test_energy_never_grows(scheme):
    moving, start = rod(100)
    history = impact(scheme(moving, 0.01), start)
    assert history["gain"].max() < 1e-12 * exact.energy
    assert abs(history["total"][-1] / exact.energy - 1.0) < 0.012


def test_plain_newmark_kicks():
    moving, start = rod(100)
    history = impact(Newmark(moving, 0.005), start)
    assert np.abs(history["gain"] - history["numerical"]).max() < 1e-12 * exact.energy
    assert history["gain"].max() > 1e-3 * exact.energy
    assert len(history.touches("end")) > 5


def test_a_held_node_keeps_its_speed_in_newmark():
    moving, start = rod(50)
    scheme = Newmark(moving, 0.02)
    held = 0
    for before, after in steps(scheme, scheme.start(start), 100):
        end = moving.contact_nodes[(before.status != Status.FREE) & (after.status != Status.FREE)]
        assert np.abs(after.velocity[end] + before.velocity[end]).max(initial=0.0) < 1e-12
        held += end.size
    assert held >= 10  # nodes; it lets go so often that both are held for two steps on end only five times


@pytest.mark.parametrize("scheme", NEVER_GAIN)
def test_orders_of_convergence(scheme):
    errors = []
    for elements in (50, 100):
        moving, start = rod(elements)
        integrator = scheme(moving, 2.0 / elements)
        x, state, squares = moving.coordinates[:, 0], integrator.start(start), []
        for _ in range(round(1.9 / integrator.dt)):
            state = integrator.step(state)
            squares.append(np.mean((state.displacement[:, 0] - exact.displacement(x, state.time)) ** 2))
        errors.append(np.sqrt(np.mean(squares)))
    assert np.log2(errors[0] / errors[1]) > 0.9
