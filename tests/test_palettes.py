"""Colours of figures: told apart in grey and by colour-blind readers."""

from itertools import combinations

import numpy as np
import pytest
from matplotlib import colormaps
from matplotlib.colors import to_rgb

from model.figures.contact_map import MARKS
from model.figures.figures import COLOUR_MAP, STYLES

# G. Machado, M. Oliveira, L. Fernandes, IEEE Trans. Vis. Comput. Graph. 15 (2009) 1291-1298, full severity.
EYES = {
    "all colours": np.eye(3),
    "no red": [
        [0.152286, 1.052583, -0.204868],
        [0.114503, 0.786281, 0.099216],
        [-0.003882, -0.048116, 1.051998],
    ],
    "no green": [
        [0.367322, 0.860646, -0.227968],
        [0.280085, 0.672501, 0.047413],
        [-0.011820, 0.042940, 0.968881],
    ],
    "no blue": [
        [1.255528, -0.076749, -0.178779],
        [-0.078411, 0.930809, 0.147602],
        [0.004733, 0.691367, 0.303900],
    ],
    "grey": np.tile([0.2126, 0.7152, 0.0722], (3, 1)),
}
XYZ = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])


def lab(colour, eyes):
    """CIE L*a*b* (3,) of a colour as seen by such eyes."""
    rgb = np.array(to_rgb(colour))
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    seen = np.clip(np.asarray(EYES[eyes]) @ linear, 0, 1)
    x, y, z = np.cbrt(np.maximum(XYZ @ seen / XYZ.sum(axis=1), 1e-4))
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])


def apart(one, other, eyes):
    """Difference of two colours; about 2 is just noticed, 20 is plain."""
    return np.linalg.norm(lab(one, eyes) - lab(other, eyes))


@pytest.mark.parametrize("eyes", EYES)
def test_stick_and_slip_are_told_apart(eyes):
    (stick, _), (slip, _) = MARKS.values()
    assert apart(stick, slip, eyes) > 40 and apart(slip, "white", eyes) > 20


@pytest.mark.parametrize("eyes", EYES)
def test_the_colour_map_rises_in_lightness(eyes):
    lightness = [lab(colour, eyes)[0] for colour in colormaps[COLOUR_MAP](np.linspace(0, 1, 33))[:, :3]]
    assert (np.diff(lightness) > 0).all() and np.ptp(lightness) > 60


@pytest.mark.parametrize("eyes", EYES)
def test_lines_are_told_apart(eyes):
    for one, other in combinations(STYLES, 2):
        assert one["marker"] != other["marker"] and one["linestyle"] != other["linestyle"]
    if eyes != "grey":  # where mark and dash must do
        for one, other in combinations(STYLES[:4], 2):
            assert apart(one["color"], other["color"], eyes) > 15
    assert all(apart(style["color"], "white", eyes) > 25 for style in STYLES)
