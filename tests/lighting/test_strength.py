"""A model of the light is used as far as it explains the recording."""

import numpy as np
import pytest

from surgisim.lighting.strength import fit_strength

rng = np.random.default_rng(3)
POINTS, FRAMES = 600, 12
PATCH = np.arange(POINTS) // 20
PREDICTED = np.repeat(rng.normal(0, 0.3, POINTS // 20), 20)[:, None] * np.linspace(0, 1, FRAMES)
SEEN = rng.random((POINTS, FRAMES)) < 0.8
SPECKS = np.where(rng.random((POINTS, FRAMES)) < 0.05, 2.0, 0.0)


def noise(size=0.1):
    """Errors that points of a patch share, over all frames, and their own."""
    return np.repeat(rng.normal(0, size, POINTS // 20), 20)[:, None] + rng.normal(0, size, (POINTS, FRAMES))


@pytest.mark.parametrize("slope", [0.4, 1.0])
def test_a_planted_slope_is_found_under_exposure_noise_and_specks(slope):
    gain = rng.normal(0, 0.2, FRAMES)
    found = fit_strength(PREDICTED, slope * PREDICTED + gain + noise() + SPECKS, SEEN, PATCH)
    assert abs(found.slope - slope) < 3 * found.error < 0.5
    assert 0.8 * slope < found.value < 1.2 * slope
    assert np.allclose(found.gain - found.gain[0], gain - gain[0], atol=0.05)


def test_brightness_that_has_nothing_to_do_with_the_model_is_left_alone():
    values = [fit_strength(PREDICTED, noise(), SEEN, PATCH).value for _ in range(30)]
    assert np.mean(np.array(values) == 0) > 0.6
    assert max(values) < 0.4
    assert fit_strength(PREDICTED, -PREDICTED + noise(), SEEN, PATCH).value == 0


def test_the_error_is_that_of_patches_not_of_pixels():
    slopes = [fit_strength(PREDICTED, noise(), SEEN, PATCH) for _ in range(60)]
    assert 0.6 < np.std([s.slope for s in slopes]) / np.median([s.error for s in slopes]) < 1.6


def test_nothing_seen_and_nothing_moved_give_no_strength():
    assert fit_strength(PREDICTED, PREDICTED, np.zeros_like(SEEN), PATCH).value == 0
    assert fit_strength(np.zeros_like(PREDICTED), noise(), SEEN, PATCH).value == 0
