"""Which pixels show tissue that the simulation moved."""

import numpy as np
from scipy.spatial import cKDTree

from surgisim.artifacts.body import Body
from surgisim.artifacts.camera import Camera
from surgisim.artifacts.replay import Replay
from surgisim.side_by_side import in_order

MOVED = 0.25
"""Share of the frame's largest displacement from which the visible surface counts as moved."""
LEAST = 0.5
"""Largest displacement below which nothing counts as moved in a frame [px at its depth]."""
REACH = 1.5
"""A pixel further than so many grid spacings from every particle of the surface shows no surface."""


def moved_region(replay: Replay, body: Body, camera: Camera) -> np.ndarray:
    """(T, H, W) bool: pixels whose nearest particle of the seen surface, where it is then, moved from its rest place by
    at least `MOVED` of the frame's largest displacement of the surface."""
    y, x = np.mgrid[: camera.height, : camera.width]
    pixels = np.stack([x.ravel(), y.ravel()], 1)
    rest = body.rest[body.surface].astype(float)

    def region(position: np.ndarray) -> np.ndarray:
        moved = np.linalg.norm(position - rest, axis=1)
        pixel = camera.fx / position[:, 2]
        if len(moved) == 0 or (moved * pixel).max() < LEAST:
            return np.zeros(x.shape, bool)
        away, near = cKDTree(camera.project(position)).query(pixels)
        return ((moved[near] >= MOVED * moved.max()) & (away <= REACH * body.spacing * pixel[near])).reshape(x.shape)

    return np.stack(list(in_order(region, zip(replay.position[:, body.surface]))))
