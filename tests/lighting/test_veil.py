"""Grey light before the tissue is told from the tissue's own."""

import numpy as np
import pytest

from surgisim.lighting.headlight import to_srgb
from surgisim.lighting.veil import veil, veil_of

RED = np.array([1.0, 0.45, 0.35])


def painted(rng, count=4000, wet=0.0):
    """Light of tissue in many shades of red, a wet film's sheen on what is bright."""
    bright = rng.uniform(0.1, 0.8, count)
    paint = RED * np.exp(0.1 * rng.standard_normal((count, 3)))
    return bright[:, None] * paint + wet * bright[:, None] ** 3


@pytest.mark.parametrize("grey", [0.03, 0.1])
def test_a_veil_is_found_with_and_without_a_wet_film(grey):
    rng = np.random.default_rng(0)
    assert veil(0.9 * painted(rng) + grey) == pytest.approx(grey, abs=0.01)
    assert 0.4 * grey < veil(0.9 * painted(rng, wet=0.1) + grey) < grey


@pytest.mark.parametrize("wet", [0.0, 0.1, 0.3])
def test_where_there_is_none_none_is_found(wet):
    assert veil(painted(np.random.default_rng(1), wet=wet)) < 0.006


def test_too_few_pixels_grey_ones_and_those_of_one_brightness_tell_none():
    rng = np.random.default_rng(2)
    assert veil(painted(rng, count=100) + 0.1) == 0.0
    assert veil(rng.uniform(0.1, 0.8, (4000, 1)) * np.ones(3) + 0.05) == 0.0
    assert veil(np.full((4000, 3), 0.3)) == 0.0


def test_in_a_recording_what_is_spoilt_does_not_count():
    rng = np.random.default_rng(3)
    rgb = np.rint(255 * to_srgb(np.clip(painted(rng, 3 * 48 * 64).reshape(3, 48, 64, 3) + 0.06, 0, 1))).astype(np.uint8)
    tool = np.zeros(rgb.shape[:3], bool)
    rgb[:, :20], tool[:, :20] = 90, True
    assert veil_of(rgb, tool) == pytest.approx(0.06, abs=0.015)
    assert veil_of(rgb, np.ones_like(tool)) == 0.0
