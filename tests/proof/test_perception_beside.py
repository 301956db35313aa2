"""What perception is held against where the truth of a real frame is known."""

import cv2
import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from surgisim.artifacts.correspondence import Correspondence
from surgisim.artifacts.frames import Frames
from surgisim.artifacts.masks import Masks
from surgisim.config.inpainting import Inpainting
from surgisim.phantom.video import encode
from surgisim.problem import Problem
from surgisim.proof.depths import change_off, off, panel_depth, plane
from surgisim.proof.holes import planted

H, W, T = 40, 56, 7


def clip(tool):
    """Texture that stands still, with an instrument on the left that comes and goes."""
    picture = gaussian_filter(np.random.default_rng(0).random((H, W, 3)), (2, 2, 0))
    picture = (255 * (picture - picture.min()) / np.ptp(picture)).astype(np.uint8)
    rgb = np.repeat(picture[None], T, 0)
    return Frames(rgb, np.zeros(T, np.uint8)), Masks(tool, ~tool, np.zeros_like(tool), np.ones(T, np.float32))


def test_a_hole_that_other_frames_see_into_is_filled_better_than_from_its_rim():
    tool = np.zeros((T, H, W), bool)
    for t in range(1, 5):
        tool[t, 8 : 8 + 4 * t, 4:18] = True
    found = planted(*clip(tool), Inpainting())
    there = np.isfinite(found["ours"])
    assert there.tolist() == [False, True, True, True, True, False, False]
    assert (found["ours"] - found["telea"])[there].min() > 3
    assert found["hidden"][4] == pytest.approx(tool[4].mean())


def test_a_clip_without_an_instrument_has_no_hole_to_plant():
    with pytest.raises(Problem, match="no instrument"):
        planted(*clip(np.zeros((T, H, W), bool)), Inpainting())


def test_a_plane_is_fitted_exactly_and_a_dome_is_not():
    row, column = np.indices((H, W))
    tilted = 1 / (10 + 0.05 * column - 0.02 * row)
    counted = np.random.default_rng(1).random((H, W)) < 0.5
    assert np.allclose(plane(tilted, counted), tilted, rtol=1e-9)
    dome = tilted * (1 + 0.1 * np.exp(-((row - 20) ** 2 + (column - 28) ** 2) / 100))
    assert off(1.7 * dome, dome, counted) == 0
    assert off(plane(dome, counted), dome, counted) > 1


def test_the_change_of_depth_is_compared_along_the_way_and_where_tissue_moves():
    """A patch goes 8 px to the right and comes a tenth nearer; what stands still changes, and does not count."""
    moved = np.zeros((T, H, W, 2), np.float32)
    moved[3:, 10:30, 10:30, 0] = 8
    seen = np.ones((T, H, W), bool)
    surface = Correspondence(moved, seen, np.zeros((T, H, W), np.float32), ~seen)
    given = np.full((T, H, W), 0.1)
    given[3:, 10:30, 18:38] = 0.09
    counted = np.ones((T, H, W), bool)
    half, still = given.copy(), np.full((T, H, W), 0.1)
    half[3:, 10:30, 18:38] = 0.095
    half[3:, :5] = 0.05
    assert change_off(given * 3, given, counted, surface) == 0
    assert change_off(still, given, counted, surface) == pytest.approx(100, abs=1)
    assert change_off(half, given, counted, surface) == pytest.approx(50, abs=3)
    # Seen in none of the frames in which it has moved.
    hidden = Correspondence(moved, seen & (np.arange(T) < 3)[:, None, None], np.zeros((T, H, W), np.float32), ~seen)
    assert np.isnan(change_off(half, given, counted, hidden))


def test_a_depth_that_a_panel_shows_is_read_back(tmp_path):
    row, column = np.indices((48, 64))
    z = 0.05 + 0.08 * (column + row) / 110
    film = np.full((3, 96, 128, 3), 255, np.uint8)
    film[:, 48:, :64] = cv2.applyColorMap(np.rint(255 * (z - 0.05) / 0.08).astype(np.uint8), cv2.COLORMAP_JET)[
        ..., ::-1
    ]
    film[:, 48:56, :20] = 255
    (tmp_path / "film.mp4").write_bytes(encode(film, 25, 4))
    found = panel_depth(tmp_path / "film.mp4", [0, 48, 64, 48], [0.05, 0.13], (3, 48, 64))
    assert not found[:, :6, :16].any()
    known = found > 0
    assert known.mean() > 0.85
    assert np.abs(found - z)[known].mean() < 0.002
    with pytest.raises(Problem, match="has 3 frames, and the clip 4"):
        panel_depth(tmp_path / "film.mp4", [0, 48, 64, 48], [0.05, 0.13], (4, 48, 64))
