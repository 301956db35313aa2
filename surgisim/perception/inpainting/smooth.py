"""Smooth continuation of a field into where it is not known."""

import cv2
import numpy as np


def continued(field: np.ndarray, known: np.ndarray) -> np.ndarray:
    """`field` (H, W) or (H, W, C) with its unknown pixels filled from coarser and coarser averages of the known.

    Push-pull: Gortler, Grzeszczuk, Szeliski and Cohen, The Lumigraph, SIGGRAPH 1996.
    """
    values = np.atleast_3d(field).astype(np.float32)
    filled = _pushed(values * known[..., None], known.astype(np.float32))
    return np.where(known[..., None], values, filled).reshape(field.shape)


def _pushed(weighted: np.ndarray, weight: np.ndarray) -> np.ndarray:
    height, width = weight.shape
    mean = weighted / np.maximum(weight, 1e-6)[..., None]
    if min(height, width) <= 2 or weight.min() >= 1:
        return np.where(weight[..., None] > 1e-6, mean, weighted.sum((0, 1)) / max(weight.sum(), 1e-6))
    size = ((width + 1) // 2, (height + 1) // 2)
    coarse = np.atleast_3d(cv2.pyrDown(weighted, dstsize=size))
    share = cv2.pyrDown(weight, dstsize=size)
    # A coarse cell that saw any known pixel is known: dividing by its share keeps the mean unbiased.
    below = _pushed(
        coarse / np.maximum(share, 1e-6)[..., None] * (share > 1e-3)[..., None], (share > 1e-3).astype("f4")
    )
    up = np.atleast_3d(cv2.pyrUp(below, dstsize=(size[0] * 2, size[1] * 2)))[:height, :width]
    full = weight[..., None]
    return full * mean + (1 - full) * up
