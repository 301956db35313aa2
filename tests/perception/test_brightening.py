"""What comes nearer without a pulled layer that explains it."""

import numpy as np
import pytest

from surgisim.perception.depth.brightening import brightened

SHAPE = 48, 64
NEARER = np.log(0.7)


def _loop() -> np.ndarray:
    y, x = np.indices(SHAPE)
    return ((x - 36) / 12) ** 2 + ((y - 20) / 8) ** 2 < 1


def _seen(loop: np.ndarray) -> np.ndarray:
    """Log brightness of a loop that comes nearer, of blotchy albedo."""
    blotches = np.random.default_rng(0).normal(0, 0.1, SHAPE)
    return -2 * NEARER * loop + blotches


def test_a_lost_loop_comes_nearer_by_half_of_how_its_log_brightness_grows():
    loop = _loop()
    found = brightened(_seen(loop), np.ones(SHAPE), 1.0 - loop, np.zeros(SHAPE), 1.0)
    assert np.median(found[loop]) == pytest.approx(NEARER, rel=0.25)
    assert not found[~loop].any()


def test_tissue_that_is_followed_is_told_better_than_tissue_that_is_lost():
    loop = _loop()
    followed, lost = (
        np.median(brightened(_seen(loop), np.ones(SHAPE), s, 5.0 * loop, 1.0)[loop])
        for s in (np.ones(SHAPE), 1.0 - loop)
    )
    assert followed == pytest.approx(NEARER, rel=0.08)
    assert abs(followed - NEARER) < abs(lost - NEARER)


def test_behind_the_jaws_it_is_as_near_as_around_them():
    loop = _loop()
    known = np.ones(SHAPE)
    known[18:22, 30:60] = 0
    light = np.where(known > 0, _seen(loop), -3.0)
    found = brightened(light, known, 1.0 - loop, np.zeros(SHAPE), 1.0)
    assert np.median(found[loop & (known == 0)]) == pytest.approx(np.median(found[loop & (known > 0)]), rel=0.1)


def test_what_a_layer_explains_and_what_stands_still_stays():
    loop = _loop()
    assert not brightened(_seen(loop), np.ones(SHAPE), 1.0 - loop, np.zeros(SHAPE), 0.0).any()
    assert not brightened(_seen(loop), np.ones(SHAPE), np.ones(SHAPE), np.zeros(SHAPE), 1.0).any()
