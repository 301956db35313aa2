"""Each instrument is followed on its own, and its tip is the end away from where it enters."""

import numpy as np
from pulled_points import H, Pull, W, course, pulled

from surgisim.perception.grasp.instruments import instruments

LIT = np.ones((H, W), bool)
FREE = np.zeros(20, bool)


def still(entry, tip) -> Pull:
    return Pull(entry, tip, np.zeros((20, 2)), FREE)


def test_the_tip_is_the_end_away_from_the_border():
    tool, flow, _, _ = pulled([Pull((127, 40), (60, 50), course(20, 5, 15, (-12, 6)), FREE)])
    (found,) = instruments(tool, LIT, flow)
    assert np.linalg.norm(found.tip[0] - (60, 50)) < 4
    assert np.linalg.norm(found.tip[19] - (48, 56)) < 4


def test_two_bars_are_two_instruments_even_where_they_meet():
    one = Pull((127, 30), (90, 40), course(20, 3, 10, (-20, 8)) - course(20, 10, 17, (-20, 8)), FREE)
    tool, flow, _, _ = pulled([one, still((0, 60), (68, 50))])
    found = instruments(tool, LIT, flow)
    assert len(found) == 2
    assert sorted(round(i.tip[19, 0] / 10) for i in found) == [7, 9]


def test_jaws_that_the_mask_loses_for_some_frames_are_where_they_were():
    tool, flow, _, _ = pulled([Pull((127, 40), (50, 50), course(20, 0, 19, (0, 8)), FREE)])
    tool[8:12, :, :64] = False
    (found,) = instruments(tool, LIT, flow)
    assert np.linalg.norm(found.tip[10] - (50, 54)) < 6


def test_an_instrument_that_is_not_masked_for_some_frames_stays_one():
    tool, flow, _, _ = pulled([Pull((127, 40), (50, 50), course(20, 0, 19, (0, 8)), FREE)])
    tool[8:12] = False
    (found,) = instruments(tool, LIT, flow)
    assert np.isnan(found.tip[10]).all()
    assert np.linalg.norm(found.tip[15] - (50, 56)) < 6


def test_a_piece_that_does_not_come_from_the_border_is_no_instrument():
    tool, flow, _, _ = pulled([still((127, 40), (90, 50))])
    tool[:, 70:80, 20:30] = True
    assert len(instruments(tool, LIT, flow)) == 1


def test_the_border_is_that_of_the_picture_the_lamp_reaches():
    y, x = np.mgrid[:H, :W]
    lit = np.hypot(x - 64, y - 48) < 44
    tool, flow, _, _ = pulled([still((127, 48), (70, 48))])
    (found,) = instruments(tool & lit, lit, flow)
    assert abs(found.entry[0, 0] - 105) < 6
    assert abs(found.tip[0, 0] - 68) < 5
