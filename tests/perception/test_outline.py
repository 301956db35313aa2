"""How an instrument goes and grows, on drawn ones whose way is known."""

import cv2
import numpy as np
import pytest
from pulled_sheet import camera

from surgisim.perception.grasp.instruments import instruments
from surgisim.perception.grasp.outline import Outline, outlines

WIDTH, HEIGHT, FINE = 160, 128, 8
SHAFT = np.array([[0, 2.5], [12, 5.5], [14, 4.5], [24, 4.5], [26, 7.0], [140, 7.0]])
"""Along the instrument from its tip, and half its width [px]."""


def test_an_instrument_that_comes_nearer_is_as_much_wider():
    ways = [(60, 60, 0.3, 1.0), (64, 58, 0.3, 1.03), (70, 55, 0.32, 1.06), (78, 50, 0.35, 1.1)]
    (found,) = _drawn(ways)
    way = found.carried(np.arange(len(ways)), 0)
    assert way[:, 2] == pytest.approx(-np.log([size for *_, size in ways]), abs=0.01)
    tip = way[:, :2] * found.camera.fx + [found.camera.cx, found.camera.cy]
    moved = np.array([place for *place, _, _ in ways], float)
    assert tip - tip[0] == pytest.approx(moved - moved[0], abs=0.5)


def test_an_instrument_that_only_leans_is_no_wider():
    ways = [(60, 60, 0.3, 1.0), (64, 58, 0.3, 1.0), (67, 57, 0.33, 1.0), (70, 55, 0.35, 1.0)]
    (found,) = _drawn(ways, lean=(1.0, 0.97, 0.95, 0.93))
    assert found.carried(np.arange(4), 0)[:, 2] == pytest.approx(np.zeros(4), abs=0.01)


def test_jaws_that_open_do_not_pass_for_an_instrument_that_comes_nearer():
    (found,) = _drawn([(60, 60, 0.3, 1.0)] * 3 + [(66, 57, 0.3, 1.0)], wider=(13, (1, 1, 1, 1.6)))
    assert found.carried(np.array([3]), 0)[0, 2] == pytest.approx(0, abs=0.01)


def test_where_only_a_part_grows_its_stretches_contradict_each_other():
    rest, after = [(60, 60, 0.3, 1.0)] * 3, (66, 57, 0.3, 1.0)
    alike, half = (
        _drawn([*rest, after], wider=(end, (1, 1, 1, 1.2)))[0].carried(np.array([3]), 0)[0, 3:] for end in (150, 30)
    )
    assert half.std() > 4 * alike.std()


def test_frames_without_an_instrument_tell_nothing():
    (found,) = _drawn([(60, 60, 0.3, 1.0)] * 5, hidden=2)
    told = np.isfinite(found.carried(np.arange(5), 0)).all(1)
    assert told.tolist() == [True, True, False, True, True]


def _drawn(ways, *, lean=None, wider=None, hidden=None) -> list[Outline]:
    """Grey on mottled red: tip [px], angle and size of every frame; how much shorter; up to where how much wider."""
    rng = np.random.default_rng(0)
    mottle = cv2.GaussianBlur(rng.standard_normal((HEIGHT, WIDTH)), (0, 0), 2)
    ground = np.clip(np.array([165, 75, 65]) * (1 + 0.8 * mottle[..., None]), 0, 255)
    rgb, tool = [], []
    for t, (x, y, angle, size) in enumerate(ways):
        share = _share((x, y), angle, size, lean[t] if lean else 1.0, (wider[0], wider[1][t]) if wider else (0, 1))
        share = share * (t != hidden)
        picture = share[..., None] * np.array([150, 152, 155]) + (1 - share[..., None]) * ground
        rgb.append(np.rint(picture + rng.normal(0, 2, picture.shape)).clip(0, 255).astype(np.uint8))
        tool.append(share > 0.5)
    tool = np.stack(tool)
    found = instruments(tool, np.ones((HEIGHT, WIDTH), bool), np.zeros((len(tool) - 1, HEIGHT, WIDTH, 2)))
    return outlines(np.stack(rgb), found, camera(WIDTH, HEIGHT, len(ways)))


def _share(tip, angle, size, lean, wider) -> np.ndarray:
    """How much of each pixel an instrument covers, 0-1, (H, W)."""
    along = np.arange(141.0)
    half = np.interp(along, *SHAFT.T) * np.where(along <= wider[0], wider[1], 1.0)
    side = np.concatenate([np.stack([along * lean, half], -1), np.stack([along * lean, -half], -1)[::-1]])
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    corners = ((size * side @ turn + tip + 0.5) * FINE - 0.5).round().astype(np.int32)
    fine = cv2.fillPoly(np.zeros((HEIGHT * FINE, WIDTH * FINE), np.uint8), [corners], 1)
    return cv2.resize(fine.astype(np.float32), (WIDTH, HEIGHT), interpolation=cv2.INTER_AREA)
