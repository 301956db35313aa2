"""Pictures for a README: whole, moving, small, or refused in one sentence."""

import dataclasses
import io

import numpy as np
import pytest
from PIL import Image
from report.made_up import invent

from surgisim.problem import Problem
from surgisim.report.small_pictures import MOVING, STILL, moving, still


@pytest.fixture(scope="module")
def made():
    return invent((40, 48), 12, 0)


def test_the_moving_picture_has_every_frame_of_recording_and_replay(made):
    content = moving(made["frames"], made["replay"], made["camera"])
    picture = Image.open(io.BytesIO(content))
    assert picture.n_frames == 12
    assert picture.size == (640, 267)
    assert len(content) < MOVING


def test_a_replay_that_was_not_drawn_is_refused_in_a_sentence(made):
    blind = dataclasses.replace(made["replay"], rgb=made["replay"].rgb[:0])
    with pytest.raises(Problem, match=r"Run with simulation\.render on"):
        moving(made["frames"], blind, made["camera"])


def test_the_scene_is_shown_from_two_sides(made):
    content = still(made["scene"], made["camera"])
    picture = np.asarray(Image.open(io.BytesIO(content)))
    assert picture.shape == (267, 640, 3)
    assert np.abs(picture[:, :320].astype(int) - picture[:, 320:]).mean() > 2
    assert len(content) < STILL
