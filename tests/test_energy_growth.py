"""Energy that an integrator adds is said once, with the number and the remedy."""

import warnings

import numpy as np
import pytest

from forms import Elasticity, Isotropic, Support
from geometry import Body, Plane, rectangle
from model import ContactStabilised, EnergyGrowth, History, MassRedistribution, MovingBody, Newmark, integrate


def thrown_rod():
    """A rod thrown at a wall, 10 long and 5 away, its energy 500."""
    body = Body.from_grid(rectangle(10.0, 1.0, 100, 1))
    elasticity = Elasticity(body, Isotropic(900.0, 0.0), "plane stress")
    support = Support(body).fix("top", y=0.0).fix("bottom", y=0.0)
    nothing = np.zeros_like(body.coordinates)
    road = Plane((-5.0, 0.0), (1.0, 0.0))
    moving = MovingBody.from_forms(elasticity, 1.0, nothing, road, "left", support)
    velocity = nothing.copy()
    velocity[:, 0] = -10.0
    return moving, velocity


def said(scheme, recorded, steps=300):
    moving, velocity = thrown_rod()
    scheme = scheme(moving, 0.0032)
    state = scheme.start(velocity=velocity)
    history = History(scheme, state) if recorded else None
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        for _ in integrate(scheme, state, steps, history, progress=False):
            pass
    return [str(w.message) for w in caught if w.category is EnergyGrowth], history


@pytest.mark.parametrize("recorded", [True, False])
def test_newmark_at_a_wall_says_what_it_adds(recorded):
    words, history = said(Newmark, recorded)
    assert len(words) == 1
    assert words[0].endswith(".")
    assert "MassRedistribution" in words[0]
    assert "energy of 500" in words[0]
    if recorded:
        added = history["total"] - history["total"][0]
        assert added.max() > 15.0  # joules of 500


@pytest.mark.parametrize("scheme", [ContactStabilised, MassRedistribution])
def test_schemes_that_never_gain_have_nothing_to_say(scheme):
    assert said(scheme, True)[0] == []


def test_what_no_identity_explains_is_said_too():
    moving, velocity = thrown_rod()
    scheme = Newmark(moving, 0.0032)
    state = scheme.start(velocity=velocity)
    history = History(scheme, state)
    after = scheme.step(state)
    after.velocity = 0.999 * after.velocity  # loses what no contact has taken
    with pytest.warns(EnergyGrowth, match="beyond its own identity"):
        history.record(state, after)
