"""An error that goes with the pull is integrated out, and only that."""

from dataclasses import replace

import numpy as np
import pytest

from surgisim.estimation.model_error import model_error
from surgisim.estimation.observation import Observation

FRAMES, INDEPENDENT = 12, 0.02
HELD = np.zeros(FRAMES, bool)


def seen(points=60, seed=3):
    rng = np.random.default_rng(seed)
    rest = np.concatenate([rng.uniform(-0.02, 0.02, (points, 2)), np.full((points, 1), 0.06)], 1)
    course = np.concatenate([np.zeros(2), np.linspace(0, 1, 6), np.linspace(0.9, 0.0, 4)])
    far = 0.005 * np.exp(-(np.linalg.norm(rest[:, :2], axis=1) ** 2) / 2 / 0.008**2)
    displacement = far[:, None, None] * course[None, :, None] * np.array([1.0, 0.3, 0.0])
    weight = np.full(displacement.shape, 1 / 1e-4)
    weight[..., 2] = 0.0
    weight[3, 5] = 0.0
    return Observation(rest, displacement, weight, None), course


def test_whitening_is_the_inverse_root_of_the_whole_covariance():
    observation, course = seen()
    error, frames = model_error(observation, course, HELD, INDEPENDENT), np.arange(1, 10)
    r = np.random.default_rng(0).normal(size=(60, len(frames), 3)) * (observation.weight[:, frames] > 0)
    got = error.whiten(r, frames)
    for c in range(2):
        B = (error.size[:, frames, c][:, :, None] * error.modes[0][:, None, :]).reshape(-1, error.modes.shape[-1])
        value, vector = np.linalg.eigh(np.eye(len(B)) + INDEPENDENT * B @ B.T)
        dense = (vector / np.sqrt(value)) @ vector.T @ r[..., c].ravel()
        assert got[..., c].ravel() == pytest.approx(dense, abs=1e-9)
    assert (got[..., 2] == 0).all()


def test_a_field_that_goes_with_the_pull_hardly_counts_and_one_that_does_not_counts_whole():
    observation, course = seen()
    observation = replace(observation, weight=4 * observation.weight)
    error, frames = model_error(observation, course, HELD, INDEPENDENT), np.arange(1, FRAMES)
    field = 0.2 * (
        observation.displacement / np.maximum(np.linalg.norm(observation.displacement, axis=-1), 1e-12)[..., None]
    )
    # The error's own smoothest field: one share for all is none of it.
    field *= (error.modes[0][:, -1] / np.abs(error.modes[0][:, -1]).max())[:, None, None]
    far = np.linalg.norm(observation.displacement, axis=-1).max(1)[:, None, None]
    late = (course[frames] < 0.35)[None, :, None] & (frames > 6)[None, :, None]
    along = observation.weight[:, frames] * field[:, frames] * far * course[None, frames, None]
    after = observation.weight[:, frames] * field[:, frames] * far * late
    assert (error.whiten(along, frames) ** 2).sum() < 0.2 * (along**2).sum()
    assert (error.whiten(after, frames) ** 2).sum() > 0.8 * (after**2).sum()


def test_how_far_all_of_a_pull_goes_counts_whole():
    observation, course = seen()
    error, frames = model_error(observation, course, HELD, INDEPENDENT), np.arange(1, FRAMES)
    far = np.linalg.norm(observation.displacement, axis=-1).max(1)[:, None, None] * np.array([1.0, 0.3, 0.0])
    short = observation.weight[:, frames] * 0.2 * far * course[None, frames, None]
    assert (error.whiten(short, frames) ** 2).sum() > 0.8 * (short**2).sum()
    seen_only = model_error(observation, course, HELD, INDEPENDENT, path_fitted=False)
    assert (seen_only.whiten(short, frames) ** 2).sum() < 0.2 * (short**2).sum()


def test_windows_leave_out_what_they_do_not_see():
    observation, course = seen()
    error = model_error(observation, course, HELD, INDEPENDENT)
    r = np.random.default_rng(1).normal(size=(60, FRAMES - 1, 3)) * (observation.weight[:, 1:] > 0)
    short = error.whiten(r[:, :4], np.arange(1, 5))
    assert (short**2).sum() <= (r[:, :4] ** 2).sum()
    # The longer a window, the surer the field, and the more of it is taken out of the same frames.
    assert np.abs(error.whiten(r, np.arange(1, FRAMES))[:, :4] - short).max() > 0


def test_what_is_let_go_has_a_field_of_its_own_that_swings_with_it():
    observation, course = seen()
    course[8:] = [-0.6, -0.2, 0.4, 0.1]
    free = np.arange(FRAMES) >= 8
    observation = replace(observation, weight=4 * observation.weight)
    error, frames = model_error(observation, course, free, INDEPENDENT), np.arange(1, FRAMES)
    far = np.linalg.norm(observation.displacement, axis=-1).max(1)[:, None, None] * np.array([1.0, 0.3, 0.0])
    weight = observation.weight[:, frames]
    swing = weight * 0.2 * far * (course * free)[None, frames, None]
    # As far off as the error's spread while it swings hardly counts; the same that does not change its sign does.
    assert (error.whiten(swing, frames) ** 2).sum() < 0.2 * (swing**2).sum()
    assert (error.whiten(np.abs(swing), frames) ** 2).sum() > 0.5 * (swing**2).sum()
    # Both fields are told apart: one of the pull takes nothing off the swing.
    driven = weight * 0.2 * far * (course * ~free)[None, frames, None]
    both = error.whiten(driven + swing, frames)
    assert both[:, free[frames]] == pytest.approx(error.whiten(swing, frames)[:, free[frames]])
