"""What perception is held against where the truth of a real frame is known."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from surgisim.artifacts.frames import Frames
from surgisim.artifacts.masks import Masks
from surgisim.config.inpainting import Inpainting
from surgisim.problem import Problem
from surgisim.proof.depths import off, plane
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
