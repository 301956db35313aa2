"""Tissue that springs back without the jaws was let go before."""

import numpy as np
import pytest

from surgisim.perception.grasp.following import Following
from surgisim.perception.grasp.holding import recoiled

T, LET_GO, THOUGHT = 40, 20, 27


def carried(back_in: int) -> np.ndarray:
    """A way out and, from `LET_GO` on, back over so many frames [px], (T, 2)."""
    frames = np.arange(T)
    share = np.clip((frames - 5) / 8, 0, 1) * np.clip(1 - (frames - LET_GO) / back_in, 0, 1)
    return share[:, None] * np.array([12.0, -5.0])


def following(jaws: np.ndarray) -> Following:
    none = np.zeros(T)
    motion = np.concatenate([np.diff(jaws, axis=0), np.full((1, 2), np.nan)])
    return Following(none, none, motion, none, motion)


UNSEEN = np.full((T, 2), np.nan)
"""Where an instrument ends of which that is not seen."""


def standing(way: np.ndarray) -> np.ndarray:
    """Jaws that carry the tissue out and stay there."""
    return way[np.minimum(np.arange(T), LET_GO)]


@pytest.mark.parametrize("back_in", [2, 4])
def test_what_springs_back_while_the_jaws_stand_was_let_go_before(back_in):
    way = carried(back_in)
    assert recoiled(way, following(standing(way)), UNSEEN, 5, THOUGHT) == LET_GO


def test_tissue_that_rushes_by_does_not_drag_an_outline_along():
    way = carried(2)
    dragged = following(standing(way) + 0.65 * (way - standing(way)))
    assert recoiled(way, dragged, UNSEEN, 5, THOUGHT) == THOUGHT
    assert recoiled(way, dragged, 80.0 + standing(way), 5, THOUGHT) == LET_GO


def test_what_the_jaws_carry_back_is_still_held():
    way = carried(4)
    assert recoiled(way, following(way), 80.0 + way, 5, THOUGHT) == THOUGHT


def test_what_creeps_back_does_not_say_that_it_is_free():
    way = carried(18)
    assert recoiled(way, following(standing(way)), UNSEEN, 5, THOUGHT) == THOUGHT


def test_jaws_that_are_not_seen_do_not_say_that_tissue_goes_back_alone():
    way = carried(4)
    unseen = following(standing(way))
    unseen.jaws[LET_GO:] = np.nan
    assert recoiled(way, unseen, UNSEEN, 5, THOUGHT) == THOUGHT
