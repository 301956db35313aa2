"""Track error: how far points are from where they should be."""

from dataclasses import dataclass
from typing import Literal

import numpy as np


@dataclass(frozen=True)
class Distance:
    median: float
    mean: float
    count: int
    """Point-frames compared."""


def distance(found: np.ndarray, true: np.ndarray, counted: np.ndarray) -> Distance:
    """Euclidean distance of positions (K, T, D), in their unit, over the point-frames `counted` (K, T) bool.

    A NaN in either position takes that point-frame out. Median and mean are NaN when none is left.
    """
    apart = np.linalg.norm(np.asarray(found, np.float64) - true, axis=-1)
    apart = apart[counted & np.isfinite(apart)]
    if not len(apart):
        return Distance(float("nan"), float("nan"), 0)
    return Distance(float(np.median(apart)), float(apart.mean()), len(apart))


def distance_over_time(
    found: np.ndarray, true: np.ndarray, counted: np.ndarray, which: Literal["median", "mean"] = "median"
) -> np.ndarray:
    """The same in each frame, (T,), NaN where no point counts."""
    each = [distance(found[:, [t]], true[:, [t]], counted[:, [t]]) for t in range(found.shape[1])]
    return np.array([getattr(d, which) for d in each])
