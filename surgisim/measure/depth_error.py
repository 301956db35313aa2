"""Depth error, after the one factor that a single camera cannot know."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class DepthError:
    relative: float
    """Mean of |z - z_true| / z_true [1]."""
    median: float
    """Median of |z - z_true| [m]."""
    rms: float
    """Root mean square [m]."""


def scale_between(found: np.ndarray, true: np.ndarray, counted: np.ndarray) -> float:
    """Median of z_true / z over the pixels counted [1]; NaN without a pixel."""
    counted = counted & (true > 0)
    if not counted.any():
        return float("nan")
    return float(np.median(true[counted].astype(np.float64) / found[counted]))


def depth_error(found: np.ndarray, true: np.ndarray, counted: np.ndarray, *, scale: float = 1.0) -> DepthError | None:
    """Error of `scale` x `found` [m] over the pixels counted where the truth is known (> 0), (..., H, W)."""
    counted = counted & (true > 0)
    if not counted.any():
        return None
    wanted = true[counted].astype(np.float64)
    apart = np.abs(scale * found[counted].astype(np.float64) - wanted)
    return DepthError(float((apart / wanted).mean()), float(np.median(apart)), float(np.sqrt((apart**2).mean())))
