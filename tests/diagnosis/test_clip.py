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


def test_the_edge_of_a_picture_drives_what_was_measured_and_what_nothing_else_holds_and_no_other_body():
    filmed = edged(recording())
    clip = clip_of(filmed, share=GRID)
    assert not len(clip.motion.rim)
    assert np.array_equal(clip.edge.position, filmed.motion.rim)
    for driven in (replace(filmed, doubts={}), replace(filmed, boxes=filmed.boxes[:0])):
        clip = clip_of(driven, share=GRID)
        assert np.array_equal(clip.motion.rim, filmed.motion.rim)
        assert clip.edge is None
