"""Which tissue is held, from when to when, by which of the instruments."""

import numpy as np
import pytest
from pulled_points import H, Pull, W, course, pulled

from surgisim.perception.grasp.find import LIKELY, find
from surgisim.perception.grasp.instruments import instruments

T = 40
ALWAYS, NEVER = np.ones(T, bool), np.zeros(T, bool)


def between(first: int, last: int) -> np.ndarray:
    return (np.arange(T) >= first) & (np.arange(T) <= last)


def grips(*pulls: Pull, change=None, **more):
    tool, flow, xy, seen = pulled(list(pulls), **more)
    if change is not None:
        change(tool, flow, xy, seen)
    tools = instruments(tool, np.ones((H, W), bool), flow)
    return [g for g in find(xy, seen, tools, flow, W, 16.0) if g.confidence >= LIKELY]


def test_held_from_the_first_frame_and_never_let_go():
    (grip,) = grips(Pull((127, 40), (70, 50), course(T, 12, 30, (14, 4)), ALWAYS))
    assert (grip.begin, grip.end) == (0, T - 1)
    assert np.linalg.norm(grip.center - (70, 50)) < 5


def test_let_go_while_the_instrument_goes_on():
    way = course(T, 8, 20, (14, 4)) + course(T, 24, 36, (14, -10))
    (grip,) = grips(Pull((127, 40), (60, 50), way, between(6, 26)))
    assert abs(grip.end - 26) <= 2


def test_two_instruments_are_two_grips_each_at_its_own_jaws():
    one = Pull((127, 20), (95, 30), course(T, 6, 20, (10, -8)), ALWAYS)
    two = Pull((0, 70), (35, 66), course(T, 16, 32, (-12, 6)), ALWAYS)
    found = sorted(grips(one, two, reach=12.0), key=lambda g: -g.center[0])
    assert len(found) == 2
    assert np.linalg.norm(found[0].center - (95, 30)) < 6
    assert np.linalg.norm(found[1].center - (35, 66)) < 6
    assert found[0].instrument != found[1].instrument


def test_a_second_instrument_that_stands_by_holds_nothing():
    one = Pull((127, 20), (90, 30), course(T, 6, 20, (12, -8)), ALWAYS)
    (grip,) = grips(one, Pull((0, 70), (60, 40), np.zeros((T, 2)), NEVER))
    assert np.linalg.norm(grip.center - (90, 30)) < 6


def test_an_instrument_that_only_passes_holds_nothing():
    assert not grips(Pull((127, 40), (70, 50), course(T, 5, 30, (-20, 10)), NEVER))


def test_breathing_tissue_that_moves_by_itself_is_not_held():
    breath = 4 * np.sin(np.arange(T) / 4)[:, None] * np.array([0.3, 1.0])
    assert not grips(Pull((127, 40), (70, 50), course(T, 5, 30, (-6, 3)), NEVER), breath=breath)


@pytest.mark.parametrize("lost", [slice(14, 19), slice(20, 26)])
def test_a_mask_that_is_lost_for_some_frames_does_not_end_a_grip(lost):
    def lose(tool, flow, xy, seen):
        tool[lost] = False

    (grip,) = grips(Pull((127, 40), (70, 50), course(T, 8, 34, (14, 4)), ALWAYS), change=lose)
    assert (grip.begin <= 9, grip.end) == (True, T - 1)


def test_frames_that_come_twice_do_not_break_a_grip():
    way = course(T // 2, 5, 16, (16, 4)).repeat(2, axis=0)
    (grip,) = grips(Pull((127, 40), (70, 50), way, ALWAYS))
    assert grip.end == T - 1


def test_a_small_pull_is_found_too():
    (grip,) = grips(Pull((127, 40), (70, 50), course(T, 8, 24, (4, -1.5)), ALWAYS))
    assert np.linalg.norm(grip.center - (70, 50)) < 6


def test_soft_tissue_that_comes_along_as_one_is_held_where_it_springs_back_without_the_jaws():
    way = course(T, 8, 18, (14, 4))
    (grip,) = grips(Pull((127, 40), (70, 50), way, between(6, 28)), reach=80.0)
    assert grip.end == 28


def test_a_camera_that_turns_with_its_instrument_at_rest_shows_no_grip():
    pan = course(T, 8, 18, (14, 4)) - course(T, 28, 30, (14, 4))
    assert not grips(Pull((127, 40), (70, 50), pan, ALWAYS), reach=1500.0)
