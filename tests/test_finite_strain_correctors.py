"""Every correction finds what the paper's loop finds, node after node on the nonlinear forces."""

import numpy as np
import pytest

from forms import Hyperelasticity, NeoHookean, Support
from geometry import Body, Plane, box, ring
from model import BodyOnRoad, EnergyMomentum, FiniteBody, FiniteContact, LosslessContact

pytestmark = pytest.mark.filterwarnings("ignore::model.UnresolvedWaves")


def landing_ring(mu):
    body = Body.from_grid(ring(0.5, 0.2, 12, 2, lowest=(0.0, 0.001)), refinements=1)
    elastic = Hyperelasticity(body, NeoHookean(E=1000.0, nu=0.3))
    load = elastic.body_force((0.0, -9.81))
    moving = FiniteBody.from_forms(elastic, 1.0, load, Plane(), "outer", friction=mu)
    return moving, np.zeros_like(body.coordinates) + [3.0, -2.0], 0.005


def landing_block(mu):
    body = Body.from_grid(box(0.4, 0.3, 0.3, 2, 2, 2, corner=(0.0, 0.0, 0.001)), refinements=1)
    elastic = Hyperelasticity(body, NeoHookean(E=1e4, nu=0.4))
    road, load = Plane((0, 0, 0), (0, 0, 1)), elastic.body_force((0, 0, -9.81))
    moving = FiniteBody.from_forms(elastic, 1.0, load, road, "bottom", friction=mu)
    spin = np.cross([1.0, 2.0, 3.0], body.coordinates - body.coordinates.mean(axis=0))
    return moving, spin + [1.0, 0.5, -3.0], 1e-3


def ridden(made, method, correction, steps):
    moving, velocity, dt = made
    scheme = method(moving, dt, correction=correction)
    state = scheme.run(scheme.start(velocity=velocity), steps)
    return state, scheme.iterations


@pytest.mark.parametrize("method", [EnergyMomentum, LosslessContact])
@pytest.mark.parametrize(
    "made, mu, steps", [(landing_ring, 0.3, 4), (landing_ring, None, 4), (landing_block, 0.4, 2)]
)
def test_all_corrections_find_what_the_loop_finds(made, mu, steps, method):
    wanted, sweeps = ridden(made(mu), method, "none", steps)
    assert wanted.count > 2 and sweeps > 20
    force = np.abs(wanted.contact_force).max()
    for correction in ("direct", "multigrid", "algebraic"):
        found, _ = ridden(made(mu), method, correction, steps)
        assert np.array_equal(found.status > 0, wanted.status > 0), correction
        assert np.abs(found.displacement - wanted.displacement).max() < 1e-8, correction
        assert np.abs(found.contact_force - wanted.contact_force).max() < 1e-6 * force, correction


@pytest.mark.parametrize("mu", [None, 0.3])
def test_statics_by_every_correction(mu):
    body = Body.from_grid(box(0.4, 0.3, 0.3, 2, 2, 2), refinements=1)
    elastic = Hyperelasticity(body, NeoHookean(E=1e3, nu=0.4))
    support = Support(body).fix("top", x=0.03, y=0.0, z=-0.06)
    system = elastic.system(elastic.body_force((0, 0, 0)), support)
    contact = BodyOnRoad(system, "bottom", Plane((0, 0, 0), (0, 0, 1)), friction=mu)
    wanted = FiniteContact(contact).solve(steps=2)
    for correction in ("none", "multigrid", "algebraic"):
        found = FiniteContact(contact, correction=correction).solve(steps=2)
        assert np.array_equal(found.status > 0, wanted.status > 0), correction
        off = np.abs(found.contact_force - wanted.contact_force).max()
        assert off < 1e-7 * np.abs(wanted.contact_force).max(), correction
