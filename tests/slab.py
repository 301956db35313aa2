"""A small tissue slab that is pulled and let go, for tests of the engine."""

import numpy as np

from surgisim.artifacts.body import Body
from surgisim.artifacts.motion import Motion


def slab(size=(0.048, 0.036, 0.018), spacing=0.006, per_axis=2, distance=0.06) -> Body:
    """A block of `size` [m] facing the camera at `distance`, held at its back."""
    n = np.round(np.array(size) / (spacing / per_axis)).astype(int)
    axes = [(np.arange(k) + 0.5) * s / k for k, s in zip(n, size, strict=True)]
    rest = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)
    rest = rest + np.array([-size[0] / 2, -size[1] / 2, distance])
    top = rest[:, 2] < distance + spacing / per_axis
    held = rest[:, 2] > distance + size[2] - spacing / per_axis
    color = np.tile([0.8, 0.4, 0.35], (len(rest), 1))
    volume = np.full(len(rest), np.prod(size) / len(rest))
    return Body(rest.astype(np.float32), volume.astype(np.float32), color.astype(np.float32), top, held, spacing)


def pulled(frames=16, fps=25.0, by=(0.003, 0.0, -0.006), hold=8, radius=0.0065, distance=0.06) -> Motion:
    """A grip at the middle of the slab's face: carried for 5 frames, held, let go after frame `hold`."""
    center = np.array([[0.0, 0.0, distance]])
    s = np.clip(np.arange(frames) / 5, 0, 1)
    s = s * s * (3 - 2 * s)
    active = np.zeros((1, frames), bool)
    active[0, : hold + 1] = True
    return Motion(center, np.array([radius]), (center + s[:, None] * np.array(by))[None], active, np.ones(1), "given")
