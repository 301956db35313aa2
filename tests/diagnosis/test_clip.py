"""Which points of a recording a diagnosis can use."""

from dataclasses import replace

import numpy as np
import pytest
from planted import GRID, edged, recording

from surgisim.diagnosis.clip import clip_of
from surgisim.problem import Problem


def test_points_in_another_unit_than_the_body_are_refused_with_how_far_they_are():
    made = recording()
    with pytest.raises(Problem, match=r"0 of 48 points lie on the body.* begin 1?[0-9] m or more from it"):
        clip_of(replace(made, points=1e3 * made.points, place=1e3 * made.place), share=GRID)


def test_points_that_are_hardly_seen_are_not_said_to_be_elsewhere():
    made = recording()
    hidden = made.visible.copy()
    hidden[3:, 2:] = False
    with pytest.raises(Problem, match=r"are needed to tell what was left out\.$"):
        clip_of(replace(made, visible=hidden), share=GRID)


def test_the_edge_of_a_picture_drives_what_was_measured_and_no_body_of_a_video_that_something_else_holds():
    filmed = edged(recording())
    clip = clip_of(filmed, share=GRID)
    assert not len(clip.motion.rim)
    assert np.array_equal(clip.edge.position, filmed.motion.rim)
    clip = clip_of(replace(filmed, doubts={}), share=GRID)
    assert np.array_equal(clip.motion.rim, filmed.motion.rim)
    assert clip.edge is None


def test_what_only_its_edge_holds_is_carried_by_that_as_far_as_it_goes_with_the_pull():
    filmed = edged(recording())
    motion, time = filmed.motion, np.arange(filmed.frames)
    breath = 2e-3 * np.sin(2 * np.pi * time / 6)[:, None] * [1.0, 0.0, 0.0]
    breathing = replace(filmed, boxes=filmed.boxes[:0], motion=replace(motion, rim=motion.rim + breath))
    clip = clip_of(breathing, share=GRID)
    assert clip.edge is None
    moved = clip.motion.rim - clip.motion.rim[:, :1]
    expected = motion.rim - motion.rim[:, :1]
    assert np.abs(moved - expected).max() < 0.15 * 2e-3
    assert not moved[:, ~motion.active[0]].any()
