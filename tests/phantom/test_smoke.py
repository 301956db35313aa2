"""Smoke takes contrast and drifts; a dome rises in the middle."""

import numpy as np
import pytest

from surgisim.config.phantom import Phantom
from surgisim.phantom.case import invent
from surgisim.phantom.smoke import smoke


def test_smoke_brings_light_to_its_own_grey_and_moves_on():
    light = np.random.default_rng(0).random((48, 64, 3))
    lay = smoke((48, 64), 0.4, np.random.default_rng(1))
    first, later = lay(light, 0.0), lay(light, 0.5)
    share = 1 - np.std(first) / np.std(light)
    assert 0.2 < share < 0.6
    assert np.abs(later - first).mean() > 0.005
    assert lay(light, 0.0) == pytest.approx(first)
    assert smoke((48, 64), 0.0, np.random.default_rng(1))(light, 0.0) == pytest.approx(light)


def test_a_dome_is_as_high_as_asked_in_the_middle_and_nothing_at_the_corners():
    flat, dome = (invent(Phantom(dome=high)).shape for high in (0.0, 4e-3))
    uv = np.stack([dome.low, 0.5 * (dome.low + dome.high), dome.high])
    assert dome.relief(uv) - flat.relief(uv) == pytest.approx([0.0, 4e-3, 0.0], abs=1e-9)
