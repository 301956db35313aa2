"""Intersection over union: how well one mask covers another."""

import numpy as np


def overlap(found: np.ndarray, true: np.ndarray) -> float:
    """Shared pixels over pixels of either, masks (..., H, W) bool [1]; NaN when both are empty."""
    either = np.count_nonzero(found | true)
    return np.count_nonzero(found & true) / either if either else float("nan")
