"""A textured plane of tissue whose middle is pushed sideways and comes back, passed by an instrument."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter, map_coordinates

from surgisim.artifacts.camera import Camera
from surgisim.artifacts.correspondence import Correspondence
from surgisim.artifacts.depth import Depth
from surgisim.artifacts.frames import Frames
from surgisim.artifacts.inpainted import Inpainted
from surgisim.artifacts.masks import Masks
from surgisim.config.reconstruction import Reconstruction

T, H, W, Z, PUSH = 17, 32, 40, 0.05, 3.0


def push(x, y, t):
    """How far the tissue resting at a pixel has moved to the right [px]."""
    return PUSH * np.sin(np.pi * t / (T - 1)) * np.exp(-((x - W / 2) ** 2 + (y - H / 2) ** 2) / (2 * 8.0**2))


def unfollowed() -> Correspondence:
    """Nothing is seen to go anywhere: only pictures tell."""
    none = np.zeros((T, H, W), bool)
    return Correspondence(np.zeros((T, H, W, 2), np.float16), none, np.ones((T, H, W), np.float16), none)


@pytest.fixture(scope="session")
def clip():
    rng = np.random.default_rng(3)
    texture = gaussian_filter(rng.random((H, W, 3)), (1.5, 1.5, 0))
    texture = 0.2 + 0.6 * (texture - texture.min()) / np.ptp(texture)
    y, x = np.mgrid[0:H, 0:W].astype(float)
    rgb = np.empty((T, H, W, 3))
    for t in range(T):
        rest = x.copy()
        for _ in range(30):
            rest = x - push(rest, y, t)
        rgb[t] = np.stack([map_coordinates(texture[..., c], [y, rest], order=3, mode="nearest") for c in range(3)], -1)
    clean = np.rint(np.clip(rgb, 0, 1) * 255).astype(np.uint8)
    tool = np.zeros((T, H, W), bool)
    for t in range(4, 12):
        tool[t, : t + 2, 30:36] = True
    seen = clean.copy()
    seen[tool] = 128
    split = np.zeros(T, np.uint8)
    split[1::8] = 1
    split[-1] = 2
    return SimpleNamespace(
        push=push,
        z=Z,
        frames=Frames(seen, split),
        inpainted=Inpainted(clean, tool.astype(np.uint8)),
        masks=Masks(tool, ~tool, np.zeros_like(tool), np.ones(T, np.float32)),
        correspondence=unfollowed(),
        depth=Depth(np.full((T, H, W), Z, np.float32), np.ones((T, H, W), np.float32), "known"),
        camera=Camera(W, H, 50.0, 50.0, (W - 1) / 2, (H - 1) / 2, 25.0, T, "known", "given", "x", [W, H], [0, 0, W, H]),
        # Pictures alone need a longer coarse phase and less of the trajectory term.
        settings=Reconstruction(
            iterations=400,
            phases=(0.5, 0.7, 0.9),
            trajectory=0.02,
            most_gaussians=900,
            knots=(6, 12),
            knots_in_depth=(2, 2),
            threads=1,
        ),
    )


@pytest.fixture
def fit(clip):
    """A Fit at its start."""
    from surgisim.gaussians.fit import Fit
    from surgisim.gaussians.initialise import initialise
    from surgisim.gaussians.observations import observe

    seen = observe(clip.frames, clip.inpainted, clip.masks, clip.correspondence, clip.depth, clip.settings)
    start = initialise(clip.inpainted.rgb, clip.depth.z, clip.masks.tool, clip.masks.tissue, clip.camera, most=500)
    return Fit(start, seen, clip.camera, T, clip.settings)
