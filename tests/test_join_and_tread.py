"""Several bodies in one mesh, and tread blocks."""

import numpy as np
import pytest

from geometry import Body, box, half_cylinder_nested, join, rectangle, shifted, tread_block


def test_joined_bodies_keep_their_names_regions_and_shapes():
    inclusion = {"core": lambda x: np.abs(x[:, 0] - 3.5) < 0.3}
    grid = join(
        {
            "wheel": shifted(half_cylinder_nested(1.0), (-2, 0.5)),
            "block": rectangle(1, 1, 4, 4, corner=(3, 0), regions=inclusion),
        }
    )
    body = Body.from_grid(grid, refinements=1)
    assert set(body.names) == {
        "wheel arc",
        "wheel top",
        "block left",
        "block right",
        "block bottom",
        "block top",
    }
    assert {name: len(cells) for name, cells in body.regions.items()} == {
        "wheel": 224,
        "block": 64,
        "block core": 32,
    }
    arc = body.coordinates[body.nodes("wheel arc")]
    np.testing.assert_allclose(np.hypot(arc[:, 0] + 2, arc[:, 1] - 1.5), 1, rtol=1e-14)


def test_bodies_that_cannot_be_joined():
    with pytest.raises(ValueError, match="one type"):
        join({"plane": rectangle(1, 1, 1, 1), "solid": box(1, 1, 1, 1, 1, 1)})
    with pytest.raises(ValueError, match="grids is {}"):
        join({})
    with pytest.raises(ValueError, match="it must be 2 finite"):
        shifted(rectangle(1, 1, 1, 1), (0, 0, 0))


@pytest.mark.parametrize("refinements", [0, 1])
def test_tread_in_the_plane(refinements):
    body = Body.from_grid(tread_block((3,), (8,), (2,), 6, 4, 2), refinements)
    x = body.coordinates
    np.testing.assert_allclose([*x.min(axis=0), *x.max(axis=0)], [-14, 0, 14, 10])
    assert len(body.cells) == (3 * 4 * 3 + 14 * 2) * 4**refinements
    assert set(body.names) == {"bottom", "top", "sides", "grooves"}
    assert np.all(x[body.nodes("bottom"), 1] == 0)
    assert {tuple(p) for p in x * [-1, 1] + 0.0} == {tuple(p) for p in x}


def test_tread_in_space():
    body = Body.from_grid(tread_block((3, 2), (8, 6), (2, 2), 6, 4, 2))
    assert len(body.cells) == 6 * 4 * 3 * 3 + 14 * 7 * 2
    assert len(body.facets["bottom"]) == 6 * 4 * 3
    assert len(body.facets["top"]) == 14 * 7
    assert "grooves" not in tread_block((1, 1), (8, 6), (2, 2), 6, 4, 2).facets


@pytest.mark.parametrize(
    "arguments, words",
    [
        (((3,), (8, 8), (2,), 6, 4, 1), r"size is \(8, 8\); it must be 1 finite"),
        (((0,), (8,), (2,), 6, 4, 1), "is 0; it must be a whole number"),
        (((3,), (8,), (-2,), 6, 4, 1), "is -2.0; it must be a finite number greater"),
    ],
)
def test_bad_treads_are_refused(arguments, words):
    with pytest.raises(ValueError, match=words):
        tread_block(*arguments)
