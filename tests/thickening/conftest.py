"""A tilted plane in front of a camera whose body is known in closed form."""

import numpy as np
import pytest

from surgisim.artifacts.camera import Camera
from surgisim.gaussians.surface import surface_from


@pytest.fixture
def camera():
    return Camera(64, 48, 80.0, 80.0, 31.5, 23.5, 25.0, 1, "known", "given", "plane", [64, 48], [0, 0, 64, 48])


def plane(camera, slope, distance=0.05):
    """Depth of z = distance + slope x at every pixel [m], (H, W)."""
    x = (np.arange(camera.width) - camera.cx) / camera.fx
    return np.tile(distance / (1 - slope * x), (camera.height, 1))


@pytest.fixture
def slab(camera):
    def make(slope=0.3, cover=None, bumps=0.0):
        z = plane(camera, slope)
        z[20, 30] += bumps
        color = np.stack([z / z.max(), 0 * z, 1 + 0 * z], -1)
        return surface_from(z, color, np.ones_like(z) if cover is None else cover, smooth=0.0 if not bumps else 0.1)

    return make
