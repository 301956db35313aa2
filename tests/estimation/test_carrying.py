"""A grip that is moved aside stays on the tissue."""

import numpy as np

from surgisim.artifacts.camera import Camera
from surgisim.artifacts.motion import Motion
from surgisim.artifacts.tracks import Tracks
from surgisim.estimation.carrying import carrying, named

FRAMES = 6


def clip(depth):
    """Points on a surface of this depth [m], from pixels (K, 2), and a grip in the middle that goes right."""
    camera = Camera(
        width=160, height=128, fx=190.0, fy=190.0, cx=79.5, cy=63.5, fps=25.0, frames=FRAMES, scale="known",
        focal_from="given", source="x", source_size=[160, 128], crop=[0, 0, 160, 128],
    )  # fmt: skip
    x, y = np.meshgrid(np.arange(4, 160, 6.0), np.arange(4, 128, 6.0))
    xy = np.repeat(np.stack([x.ravel(), y.ravel()], -1)[:, None], FRAMES, 1)
    z = depth(xy[:, :1])
    xyz = np.repeat(camera.lift(xy[:, :1], z), FRAMES, 1)
    seen, sigma = np.ones(xy.shape[:2], bool), np.full(xy.shape[:2], 0.1, np.float32)
    tracks = Tracks(xy, seen, sigma, xyz, np.full((*xy.shape[:2], 2), 1e-4, np.float32))
    start = np.array([[80.0, 64.0]])
    center = camera.lift(start, depth(start))
    position = np.repeat(center[:, None], FRAMES, 1) + np.linspace(0, 0.005, FRAMES)[None, :, None] * [1.0, 0.0, 0.0]
    motion = Motion(center, np.array([0.004]), position, np.ones((1, FRAMES), bool), np.ones(1), "given")
    return camera, tracks, motion


def moved_by(depth, right):
    """Where the grip's middle is [m], (3,), a share of its distance to the right, how far the surface is there [m], and
    how much farther its path goes than the middle's [m], (T, 3)."""
    camera, tracks, motion = clip(depth)
    at = carrying(motion, tracks, camera, measured=True).at({named(0, "right"): right})
    middle = at.center_rest[0]
    return middle, float(depth(camera.project(middle[None]))[0]), at.position[0] - motion.position[0]


def test_beside_where_it_was_found_a_grip_is_on_the_slope():
    def slope(pixel):
        return 0.07 + 0.0003 * (pixel[..., 0] - 80) - 0.0001 * (pixel[..., 1] - 64)

    middle, surface, aside = moved_by(slope, 0.03)
    np.testing.assert_allclose(middle[2], surface, rtol=2e-4)
    assert middle[2] > slope(np.array([80.0, 64.0])) + 0.001
    # Its path is the same one, from there on.
    np.testing.assert_allclose(aside, np.repeat(aside[:1], FRAMES, 0), atol=1e-12)


def test_beyond_an_edge_a_grip_is_on_what_lies_behind():
    def cliff(pixel):
        return np.where(pixel[..., 0] > 92, 0.09, 0.07)

    middle, surface, _ = moved_by(cliff, 0.15)
    np.testing.assert_allclose(middle[2], 0.09, atol=0.002)
    assert surface == 0.09


def test_where_it_was_found_nothing_changes():
    camera, tracks, motion = clip(lambda pixel: np.full(pixel.shape[:-1], 0.07))
    at = carrying(motion, tracks, camera, measured=True).at({})
    np.testing.assert_array_equal(at.center_rest, motion.center_rest)
    np.testing.assert_allclose(at.position, motion.position, atol=1e-12)
