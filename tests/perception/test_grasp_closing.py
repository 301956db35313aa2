"""Jaws that are seen to close and open hold tissue, though all of it goes with them."""

import cv2
import numpy as np
import pytest
from pulled_points import H, W, course

from surgisim.perception.grasp.closing import closes
from surgisim.perception.grasp.find import LIKELY, find
from surgisim.perception.grasp.instruments import Instrument, instruments

T, BEGIN, END = 44, 8, 34
WAY = course(T, 12, 22, (9.0, -6.0))
"""The tissue's [px]; jaws come before they take it and go after they let go."""
TOOL = WAY + course(T, 0, 6, (-14.0, 0.0)) + course(T, 36, T - 1, (14.0, 0.0)) + (14.0, 0.0)


def forked(opening: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """tool (T, H, W) and its flow (T - 1, H, W, 2): a shaft with two jaws so far apart at their ends [px], (T,)."""
    tool, flow = np.zeros((T, H, W), bool), np.zeros((T - 1, H, W, 2), np.float32)
    for t in range(T):
        mask = np.zeros((H, W), np.uint8)
        pivot = np.array([80.0, 48.0]) + TOOL[t]
        cv2.line(mask, np.rint(pivot).astype(int).tolist(), [W - 1, 48 + round(TOOL[t, 1])], 1, 5)
        for side in (-0.5, 0.5):
            end = pivot + np.array([-12.0, side * opening[t]])
            cv2.line(mask, np.rint(pivot).astype(int).tolist(), np.rint(end).astype(int).tolist(), 1, 3)
        tool[t] = mask > 0
        if t + 1 < T:
            flow[t] = TOOL[t + 1] - TOOL[t]
    return tool, flow


def shut(begin: int, end: int) -> np.ndarray:
    return np.where((np.arange(T) >= begin) & (np.arange(T) <= end), 2.0, 16.0)


def seen(opening: np.ndarray) -> Instrument:
    tool, flow = forked(opening)
    (found,) = instruments(tool, np.ones((H, W), bool), flow)
    return found


NEVER = np.full(T, 2.0)
GAPING = np.full(T, 16.0)
WAVERING = np.where(shut(BEGIN, END) < 16, 2.0 + 6.0 * (np.arange(T) % 3), 16.0)


@pytest.mark.parametrize(
    ("opening", "said"),
    [(shut(BEGIN, END), True), (shut(BEGIN, T), False), (NEVER, False), (GAPING, False), (WAVERING, False)],
)
def test_jaws_close_stay_so_and_open(opening, said):
    assert closes(seen(opening), BEGIN, END, W) == said


def carried(opening: np.ndarray, least: float, way: np.ndarray) -> list:
    """Grips where tissue goes the whole way at the jaws and `least` of it far from them."""
    tool, flow = forked(opening)
    x, y = np.meshgrid(np.arange(3.0, W, 4.0), np.arange(3.0, H, 4.0))
    start = np.stack([x.ravel(), y.ravel()], -1)
    share = least + (1 - least) * np.exp(-((np.linalg.norm(start - [66, 48], axis=-1) / 18) ** 2))
    xy = start[:, None] + share[:, None, None] * way
    at = np.clip(np.rint(xy).astype(int), 0, [W - 1, H - 1])
    visible = ~tool[np.arange(T), at[..., 1], at[..., 0]]
    return find(xy, visible, instruments(tool, np.ones((H, W), bool), flow), flow, W, 16.0)


@pytest.mark.parametrize(("opening", "believed"), [(shut(BEGIN, END), True), (NEVER, False)])
def test_tissue_that_slides_nearly_as_a_whole_is_held_where_jaws_close_on_it(opening, believed):
    assert any(g.confidence > LIKELY for g in carried(opening, 0.7, WAY)) == believed


def test_what_springs_back_as_it_is_let_go_went_along_until_then():
    back = np.where(np.arange(T) > END, -0.5, 1.0)[:, None]
    (grip,) = carried(shut(BEGIN, END), 0.0, WAY * back)
    assert abs(grip.end - END) <= 1
    assert grip.confidence > 0.95
