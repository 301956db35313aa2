"""The moved region is where the tissue that moves is seen."""

import numpy as np
from slab import slab

from surgisim.artifacts.camera import Camera
from surgisim.artifacts.replay import Replay
from surgisim.measure.moved import moved_region

CAMERA = Camera(64, 48, 80.0, 80.0, 31.5, 23.5, 25.0, 2, "known", "given", "slab", [64, 48], [0, 0, 64, 48])


def test_the_half_that_moves_is_found_where_it_went_and_stillness_has_no_region():
    body = slab()
    position = np.stack([body.rest, body.rest, body.rest])
    right = body.rest[:, 0] > 0
    position[1, right] += [0.0, 0.006, 0.0]
    position[2, right] += [0.0, 1e-5, 0.0]
    replay = Replay(
        np.arange(3) / 25, position, np.zeros((3, 8, 3)), np.zeros(3), np.array([2, 2, 2]), body.spacing,
        np.ones(3), np.zeros((3, 2)), np.zeros((0, 48, 64, 3), np.uint8),
    )  # fmt: skip
    still, moved, hardly = moved_region(replay, body, CAMERA)
    assert not still.any()
    assert not hardly.any()
    assert moved[10:, 36:60].all()
    assert not moved[:, :28].any()
