"""Courses in time that laws are tried with."""

from types import SimpleNamespace

import numpy as np
import pytest

from surgisim.diagnosis import pushes
from surgisim.diagnosis.candidates.hidden_contact import course
from surgisim.diagnosis.form import hats, knots


def filmed(fps: float, seconds: float = 3.0):
    frames = round(fps * seconds)
    return SimpleNamespace(fps=fps, until=frames, time=np.arange(frames) / fps)


@pytest.mark.parametrize("fps", [15.0, 25.0, 60.0])
@pytest.mark.parametrize("onset", [0.75, 0.787, 0.81])
def test_a_push_is_tried_as_steep_as_it_comes_and_goes(fps, onset):
    clip = filmed(fps)
    at = pushes.times(clip)
    true = course(clip.time, onset, onset + 0.76)
    assert np.linalg.norm(course(at, onset, onset + 0.76) @ hats(at, clip) - true) < 0.1 * np.linalg.norm(true)


def test_knots_are_no_closer_than_frames():
    clip = filmed(10.0)
    assert np.diff(knots(clip, 0.01)) == pytest.approx(0.1, rel=0.05)
