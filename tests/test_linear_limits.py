"""Where linear strain is not true the run says so, with the numbers."""

import warnings

import numpy as np
import pytest

from forms import Elasticity, Isotropic, Support
from geometry import Body, Plane, box, rectangle
from model import BodyOnRoad, solve
from model.problem.linear_limits import BeyondLinear, linear_limits


@pytest.mark.parametrize(
    "grid", [rectangle(1.0, 1.0, 2, 2), rectangle(1.0, 1.0, 2, 2, "triangle"), box(1, 1, 1, 1, 1, 1)]
)
def test_strain_and_rotation_by_their_formulas(grid):
    body = Body.from_grid(grid)
    elasticity, x = Elasticity(body, Isotropic(1.0, 0.3)), body.coordinates
    stretched, turned = np.zeros_like(x), np.zeros_like(x)
    stretched[:, 0] = -0.03 * x[:, 0]
    turned[:, 0], turned[:, 1] = -0.04 * x[:, 1], 0.04 * x[:, 0]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert linear_limits(elasticity.gradient(stretched)) == pytest.approx((0.03, 0.0), abs=1e-14)
        assert linear_limits(elasticity.gradient(turned)) == pytest.approx((0.0, 0.04), abs=1e-14)
    with pytest.warns(BeyondLinear, match="largest strain is 0.3 "):
        linear_limits(elasticity.gradient(10 * stretched))
    with pytest.warns(BeyondLinear, match="largest rotation 0.4 rad"):
        linear_limits(elasticity.gradient(10 * turned))


def test_pressures_beyond_the_limits_come_with_a_warning():
    body = Body.from_grid(rectangle(2.0, 1.0, 4, 2))
    elasticity = Elasticity(body, Isotropic(1.0, 0.0))
    for strain in (0.01, 0.2):
        load = elasticity.total_force("top", (0.0, -2.0 * strain))
        system = elasticity.system(load, Support(body).platen("top").fix("top", x=0.0))
        pressed = BodyOnRoad(system, "bottom", Plane())
        solution = solve(pressed.problem)
        with warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always")
            assert pressed.pressure(solution) == pytest.approx(strain)
        assert [w.category for w in said] == [BeyondLinear] * (strain > 0.05)
