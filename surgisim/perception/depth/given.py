"""Depth that came with the recording; what it lacks is taken from a right view, or filled in."""

import numpy as np

from surgisim.artifacts.camera import Camera
from surgisim.artifacts.given import Given
from surgisim.perception.depth import stereo
from surgisim.perception.depth.complete import complete
from surgisim.problem import Problem


def estimate(
    given: Given, hidden: np.ndarray, camera: Camera, rgb: np.ndarray, *, distance: float
) -> tuple[np.ndarray, np.ndarray, str]:
    """Depth [m], confidence (T, H, W), and its scale, which is known.

    hidden: pixels that do not show tissue, (T, H, W) bool. rgb: left view, sRGB (T, H, W, 3) uint8.
    """
    if given.depth.shape != hidden.shape:
        raise Problem(
            f"depth: the given depth is {given.depth.shape} and the frames {hidden.shape}; "
            "pass one depth image a frame, of the frames' size."
        )
    z = given.depth.astype(np.float32)
    known = np.isfinite(z) & (z > 0)
    if known.sum() < 0.01 * known.size:
        raise Problem(
            f"depth: only {100 * known.mean():.1f} % of the given depth is > 0. "
            "Check its unit and folder, or set depth.backend to 'near_light'."
        )
    if len(given.right):
        z, known = _helped(z, known, given, camera, rgb)
    z, trust = complete(np.where(known, z, 1.0), known, ~hidden)
    return z, 0.95 * trust, "known"


def _helped(z: np.ndarray, known: np.ndarray, given: Given, camera: Camera, rgb: np.ndarray):
    """Holes filled by stereo, brought to the given depth's size by the pixels that have both."""
    disparity = np.stack([stereo.match(left, right) for left, right in zip(rgb, given.right, strict=True)])
    second = stereo.measured(disparity, 1.0, camera)
    both = known & (second > 0)
    if both.sum() < 0.01 * both.size:
        return z, known
    ratio = z[both] / second[both]
    low, middle, high = np.percentile(ratio, [25, 50, 75])
    if high / low > 1.2:
        return z, known
    return np.where(known, z, middle * second), known | (second > 0)
