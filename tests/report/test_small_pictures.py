"""Pictures for a README: whole, moving, small, or refused in one sentence."""

import dataclasses
import io

import numpy as np
import pytest
from PIL import Image
from report.made_up import invent

from surgisim.problem import Problem
from surgisim.report.small_pictures import fitted, moving, still


@pytest.fixture(scope="module")
def made():
    return invent((40, 48), 12, 0)


def test_the_moving_picture_has_every_frame_of_recording_and_replay(made):
    content = moving(made["frames"], made["replay"], made["camera"], 1_000_000)
    picture = Image.open(io.BytesIO(content))
    assert picture.n_frames == 12
    assert picture.size == (640, 267)
    assert len(content) < 1_000_000


def test_a_replay_that_was_not_drawn_is_refused_in_a_sentence(made):
    blind = dataclasses.replace(made["replay"], rgb=made["replay"].rgb[:0])
    with pytest.raises(Problem, match=r"Run with simulation\.render on"):
        moving(made["frames"], blind, made["camera"], 1_000_000)


def test_the_scene_is_shown_from_two_sides(made):
    content = still(made["scene"], made["camera"], 200_000)
    picture = np.asarray(Image.open(io.BytesIO(content)))
    assert picture.shape == (267, 640, 3)
    assert np.abs(picture[:, :320].astype(int) - picture[:, 320:]).mean() > 2
    assert len(content) < 200_000


def test_a_film_that_would_be_too_large_has_fewer_frames(made):
    def within(most: int) -> Image.Image:
        picture = Image.open(io.BytesIO(moving(made["frames"], made["replay"], made["camera"], most)))
        picture.load()
        return picture

    most = 1_000_000
    whole = within(most)
    while (fewer := within(most)).n_frames == whole.n_frames:
        most = most * 9 // 10
    assert fewer.n_frames == 6
    assert fewer.info["duration"] == pytest.approx(2 * whole.info["duration"], abs=1)
    with pytest.raises(Problem, match=r"takes \d+ bytes at least, and at most 100 are wanted"):
        within(100)


def test_the_fitted_body_is_shown_whole_and_cut_open(made):
    body = dataclasses.replace(made["body"], volume=np.full(len(made["body"].rest), 2e-8, np.float32))
    content = fitted(body, made["material"], made["motion"], made["replay"], 200_000)
    picture = np.asarray(Image.open(io.BytesIO(content))).astype(int)
    assert picture.shape == (240, 640, 3)
    for half in (picture[:, :320], picture[:, 320:]):
        assert 0.02 < (half.min(-1) < 240).mean() < 0.95
