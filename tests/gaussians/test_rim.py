"""Tissue drawn inward leaves no black border."""

from dataclasses import replace

import numpy as np
from clouds import camera

from surgisim.gaussians.attributes import drawn
from surgisim.gaussians.initialise import initialise
from surgisim.gaussians.rasterise import render
from surgisim.gaussians.rim import beyond

H, W = 40, 60
VIEW = camera(W, H)
ROW, COL = np.mgrid[:H, :W]
RGB = np.stack([80 + COL, 60 + ROW * 2, 40 + 0 * COL], 2)[None].astype(np.uint8)
EVERYWHERE = np.ones((1, H, W), bool)
SCENE = initialise(RGB, 0.06 + 1e-4 * COL[None], ~EVERYWHERE, EVERYWHERE, VIEW)


def continued(scene):
    """The scene and what is put beyond its edges."""
    more = vars(beyond(scene, VIEW))
    return replace(scene, **{name: np.concatenate([value, more[name]]) for name, value in vars(scene).items()})


def moved(scene, by):
    """The scene shifted in the picture [px]."""
    step = np.array([by[0] / VIEW.fx, by[1] / VIEW.fy]) * scene.mean[:, 2:]
    return replace(scene, mean=(scene.mean + np.pad(step, ((0, 0), (0, 1)))).astype(np.float32))


def test_the_rest_picture_stays_and_its_rim_is_filled():
    plain, wide = (render(*drawn(s), VIEW) for s in (SCENE, continued(SCENE)))
    assert np.abs(wide.rgb - plain.rgb)[3:-3, 3:-3].max() < 0.01
    assert np.abs(wide.rgb - RGB[0] / 255).max() < 0.04
    assert wide.alpha.min() > plain.alpha.min() > 0.97


def test_tissue_drawn_inward_from_any_side_or_corner_leaves_no_hole():
    for by in ((4, 0), (-4, 0), (0, 4), (0, -4), (4, -4)):
        assert render(*drawn(moved(SCENE, by)), VIEW).alpha.min() < 0.01
        seen = render(*drawn(moved(continued(SCENE), by)), VIEW)
        assert seen.alpha.min() > 0.97
        assert np.abs(seen.rgb - RGB[0] / 255).max() < 0.15


def test_a_slanted_gaussian_is_mirrored_with_its_slant():
    one = replace(
        SCENE,
        mean=VIEW.lift(np.array([[2.0, 20.0]]), np.array([0.06])).astype(np.float32),
        opacity=np.array([4.0], np.float32),
        scale=np.log(np.array([[6e-3, 5e-4, 5e-4]])).astype(np.float32),
        rotation=np.array([[np.cos(0.3), 0, 0, np.sin(0.3)]], np.float32),
        color=np.ones((1, 3), np.float32),
    )
    shown = render(*drawn(moved(continued(one), (20, 0))), VIEW).alpha
    left, right = shown[:, :20], shown[:, 20:40]
    assert right.max() > 0.9
    assert np.abs(left[:, ::-1] - right)[:, :12].max() < 0.1
