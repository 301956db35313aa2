"""The first guess of the scene."""

import numpy as np
import pytest
from clouds import camera

from surgisim.gaussians.attributes import drawn, stored
from surgisim.gaussians.initialise import initialise, source_frame
from surgisim.gaussians.rasterise import render
from surgisim.problem import Problem

T, H, W = 3, 40, 60
VIEW = camera(W, H)
ROW, COL = np.mgrid[:H, :W]
RGB = np.stack([np.stack([80 + COL, 60 + ROW * 2, np.full((H, W), 40 * t)], 2) for t in range(T)]).astype(np.uint8)
Z = np.stack([0.06 + 1e-4 * COL + 1e-3 * t for t in range(T)])
TOOL = np.zeros((T, H, W), bool)
TOOL[0, 10:20, 10:30] = TOOL[1, 10:24, 20:40] = TOOL[2, 10:20, 25:50] = True


def scene(tool=TOOL, **settings):
    return initialise(RGB, Z, tool, ~tool, VIEW, **settings)


def test_the_scene_seen_again_is_the_first_frame():
    nothing = np.zeros_like(TOOL)
    seen = render(*drawn(scene(nothing)), VIEW)
    error = np.abs(seen.rgb - RGB[0] / 255)[3:-3, 3:-3]
    assert error.max() < 0.02
    assert np.abs(seen.depth / seen.alpha / Z[0] - 1)[3:-3, 3:-3].max() < 0.02
    assert seen.alpha.min() > 0.8


def test_what_a_tool_hides_comes_from_the_first_frame_that_shows_it():
    source = source_frame(TOOL, ~TOOL)
    assert (source[10:20, 10:20] == 1).all()
    assert (source[10:20, 20:25] == 2).all()
    assert (source[10:20, 25:30] == 0).all()
    assert (source_frame(TOOL, ~TOOL, unseen=False)[10:20, 25:30] == -1).all()
    assert (np.delete(source, np.s_[10:20], 0) == 0).all()


def test_a_pixel_shown_once_is_not_added_again():
    assert len(scene().mean) == H * W
    assert len(scene(unseen=False).mean) == H * W - 50


def test_each_gaussian_projects_to_its_pixel_with_its_depth_and_colour():
    made = scene()
    pixel = np.rint(VIEW.project(made.mean.astype(float))).astype(int)
    source = source_frame(TOOL, ~TOOL)
    x, y = pixel.T
    assert np.allclose(made.mean[:, 2], Z[source[y, x], y, x], rtol=1e-5)
    assert np.allclose(made.color, RGB[source[y, x], y, x] / 255, atol=1e-5)


def test_no_more_gaussians_than_asked_for_and_wider_ones_instead():
    few = scene(most=500)
    assert 400 < len(few.mean) <= 500
    assert np.exp(few.scale).mean() == pytest.approx(np.exp(scene().scale).mean() * (H * W / 500) ** 0.5, rel=0.1)


def test_background_that_is_neither_tool_nor_tissue_gets_no_gaussians():
    tissue = ~TOOL
    tissue[:, :, :5] = False
    made = initialise(RGB, Z, TOOL, tissue, VIEW)
    assert VIEW.project(made.mean.astype(float))[:, 0].min() > 4.4


def test_masks_without_tissue_are_refused():
    with pytest.raises(Problem, match="no frame shows a pixel of tissue"):
        scene(np.ones_like(TOOL), unseen=False)


def test_storing_and_drawing_are_inverse():
    made = scene(stride=4.0)
    again = stored(*drawn(made))
    for name in ("mean", "opacity", "scale", "rotation", "color"):
        assert np.allclose(getattr(made, name), getattr(again, name), atol=1e-5)
