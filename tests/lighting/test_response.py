"""What tissue's light does beyond its lamp is learned from how far each place goes, and only as far as it holds."""

import numpy as np
import pytest

from surgisim.lighting.response import fit_response

STRIDE, CELL, FRAMES = 5.0, 10.0, 40
PIXELS = np.stack(np.meshgrid(np.arange(0, 100, STRIDE), np.arange(0, 80, STRIDE)), -1).reshape(-1, 2)
WAY = np.sin(np.linspace(0, 3 * np.pi, FRAMES))[:, None] * [3e-3, 1e-3, 0] + np.linspace(0, 1, FRAMES)[:, None] * [
    0,
    0,
    -4e-3,
]
NEAR = np.exp(-0.5 * (np.linalg.norm(PIXELS - [50, 40], axis=1) / 20) ** 2)
GONE = NEAR[:, None, None] * WAY
ANSWERS = NEAR[:, None] * [200.0, 0.0, -100.0]
SEEN = np.ones((len(PIXELS), FRAMES), bool)


def noisy(change):
    return change + np.random.default_rng(1).normal(0, 0.03, change.shape)


def found(change, seen=SEEN):
    return fit_response(PIXELS, STRIDE, CELL, GONE, noisy(change), seen)


def test_a_planted_answer_is_found_also_in_frames_left_out():
    change = np.einsum("kd,ktd->kt", ANSWERS, GONE)
    seen = SEEN.copy()
    seen[:, 5::8] = False
    response = found(np.where(seen, change, 5.0), seen)
    for t in range(5, FRAMES, 8):
        left = change[:, t] - response.change(PIXELS, GONE[:, t])
        assert np.sqrt((left**2).mean()) < 0.25 * np.sqrt((change[:, t] ** 2).mean())


def test_light_that_has_nothing_to_do_with_the_way_is_left_alone():
    flicker = np.random.default_rng(2).normal(0, 0.3, FRAMES)
    response = found(np.broadcast_to(flicker, SEEN.shape))
    assert response.choice is None
    assert not response.change(PIXELS, GONE[:, -1]).any()


def test_no_place_gets_brighter_than_it_was_seen():
    change = np.einsum("kd,ktd->kt", ANSWERS, GONE)
    response = found(change)
    farther = response.change(PIXELS, 20 * GONE[:, -1])
    assert farther.max() <= response.range[..., 1].max() < 1.2 * change.max()
    assert response.change(PIXELS, 0 * GONE[:, 0]) == pytest.approx(0.0)


def test_what_comes_into_view_instead_of_the_tissue_does_not_count():
    change = np.einsum("kd,ktd->kt", ANSWERS, GONE)
    other = np.random.default_rng(3).random(change.shape) < 0.05
    clean, dirty = found(change), found(np.where(other, 2.5, change))
    last = GONE[:, -1]
    assert np.abs(clean.change(PIXELS, last) - dirty.change(PIXELS, last)).max() < 0.1


def test_a_body_that_stays_gains_nothing():
    response = fit_response(PIXELS, STRIDE, CELL, 0 * GONE, noisy(0 * GONE[..., 0]), SEEN)
    assert response.choice is None
    assert not response.change(PIXELS, GONE[:, -1]).any()
