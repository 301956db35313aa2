"""Choose the points of frame 0 that are worth following."""

import cv2
import numpy as np


def spread_points(usable: np.ndarray, count: int) -> np.ndarray:
    """About `count` pixels of `usable` (H, W) bool on an even grid, (K, 2) float [px]."""
    height, width = usable.shape
    margin = 2
    inside = np.zeros_like(usable)
    inside[margin : height - margin, margin : width - margin] = True
    spacing = max(np.sqrt((usable & inside).sum() / max(count, 1)), 1.0)
    x = np.arange(margin + spacing / 2, width - margin, spacing)
    y = np.arange(margin + spacing / 2, height - margin, spacing)
    grid = np.stack(np.meshgrid(x, y), -1).reshape(-1, 2)
    return grid[at(usable & inside, grid)]


def at(mask: np.ndarray, points: np.ndarray) -> np.ndarray:
    """`mask` (H, W) at the pixel nearest to each of `points` (K, 2) [px]; False outside."""
    near = np.rint(points).astype(int)
    inside = (near >= 0).all(-1) & (near[:, 0] < mask.shape[1]) & (near[:, 1] < mask.shape[0])
    out = np.zeros(len(points), bool)
    out[inside] = mask[near[inside, 1], near[inside, 0]]
    return out


def shrink(mask: np.ndarray, by: int) -> np.ndarray:
    """`mask` (H, W) less a rim of `by` px, bool."""
    return cv2.erode(mask.astype(np.uint8), np.ones((2 * by + 1, 2 * by + 1), np.uint8)) > 0
