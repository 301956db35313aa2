"""Smoke between tissue and camera: it takes light away, lights up itself, and drifts."""

import cv2
import numpy as np

GREY = 0.35
"""Linear light of smoke that nothing is seen through."""
COARSE = 5
"""Puffs across the longer image side."""
DRIFT = 0.15
"""How far it drifts in a second, as a share of the longer side."""


def smoke(shape: tuple[int, int], share: float, rng: np.random.Generator):
    """A function of linear light (H, W, 3) and time [s] that lays smoke of mean opacity `share`, 0-1, over it.

    shape: H, W.
    """
    high, wide = shape
    side = max(shape)
    puffs = cv2.GaussianBlur(rng.standard_normal((6 * COARSE, 6 * COARSE)).astype(np.float32), (0, 0), 1.0)
    puffs = np.clip(1 + 0.6 * puffs / puffs.std(), 0, 2)
    heading = rng.uniform(0, 2 * np.pi)
    way = DRIFT * side * np.array([np.cos(heading), np.sin(heading)])
    y, x = np.mgrid[:high, :wide].astype(np.float32)

    def lay(light: np.ndarray, time: float) -> np.ndarray:
        at = [(a + 2 * side + w * time) * COARSE / side for a, w in zip((x, y), way, strict=True)]
        thick = cv2.remap(puffs, *(a.astype(np.float32) for a in at), cv2.INTER_CUBIC, borderMode=cv2.BORDER_WRAP)
        opaque = np.clip(share * thick, 0, 0.95)[..., None]
        return light * (1 - opaque) + GREY * opaque

    return lay
