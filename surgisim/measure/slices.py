"""Y-T slices: one column of the picture over time, where a rebound shows as a wave."""

import numpy as np


def slice_yt(rgb: np.ndarray, column: int) -> np.ndarray:
    """Column `column` [px] of every frame (T, H, W, 3), as a picture (H, T, 3): y down, time to the right."""
    return np.ascontiguousarray(rgb[:, :, column].transpose(1, 0, 2))


def liveliest_column(rgb: np.ndarray, counted: np.ndarray) -> int:
    """Column where the recording (T, H, W, 3) changes most over the pixels counted (T, H, W) [px]."""
    change = np.abs(np.diff(rgb.astype(np.float64), axis=0)).mean(-1)
    both = counted[1:] & counted[:-1]
    return int(np.argmax((change * both).sum((0, 1))))
