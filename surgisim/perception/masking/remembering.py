"""Where what was marked in some frames is in another: places that look alike are the same thing.

Each place of a frame takes the labels of those places of the remembered frames whose features are most like its own,
among the last frames only near it. Jabri, Owens and Efros, Space-time correspondence as a contrastive random walk,
NeurIPS 2020, tell labels from frame to frame in this way. The numbers below were tried on two clips
(docs/benchmarks/learned.md).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np

ALIKE = 8
"""Places asked."""
SHARP = 0.03
"""How much less a place counts that is less like: exp(-difference of cosines / this)."""
NEAR = 0.25
"""How far a thing may have gone since one of the last frames [longest side]."""


@dataclass(frozen=True)
class Remembered:
    """A frame in which it is known what is where."""

    places: np.ndarray
    """(n, n, C) unit vectors."""
    share: np.ndarray
    """Share of each place that is the thing, (n, n) 0-1."""
    everywhere: bool
    """Whether the thing may be anywhere now; else near where it was."""


def remember(places: np.ndarray, region: np.ndarray, *, everywhere: bool) -> Remembered:
    """region: where the thing is, (H, W) bool."""
    side = places.shape[1::-1]
    return Remembered(places, cv2.resize(region.astype(np.float32), side, interpolation=cv2.INTER_AREA), everywhere)


Asked = dict[tuple[int, bool], tuple[np.ndarray, np.ndarray]]
"""What has been asked of remembered frames: how alike the likest places are, and which they are, (n n, ALIKE)."""


def belief(places: np.ndarray, memory: Sequence[Remembered], size: tuple[int, int], asked: Asked) -> np.ndarray:
    """How likely each pixel of a frame shows the thing, (H, W) float32, about 0-1.

    asked: kept from one thing of this frame to the next, since most remember the same frames; empty at first.
    """
    found, share = [], []
    for frame in memory:
        key = id(frame.places), frame.everywhere
        if key not in asked:
            asked[key] = _likest(places, frame)
        alike, best = asked[key]
        found.append(alike)
        share.append(frame.share.ravel()[best])
    alike, share = np.concatenate(found, 1), np.concatenate(share, 1)
    best = np.argpartition(-alike, ALIKE - 1, axis=1)[:, :ALIKE]
    alike, share = np.take_along_axis(alike, best, 1), np.take_along_axis(share, best, 1)
    weight = np.exp((alike - alike.max(1, keepdims=True)) / SHARP)
    told = ((weight * share).sum(1) / weight.sum(1)).reshape(places.shape[:2])
    return cv2.resize(told.astype(np.float32), size[::-1], interpolation=cv2.INTER_CUBIC)


def _likest(places: np.ndarray, frame: Remembered) -> tuple[np.ndarray, np.ndarray]:
    import torch

    rows, columns, channels = places.shape
    alike = places.reshape(-1, channels) @ frame.places.reshape(-1, channels).T
    if not frame.everywhere:
        alike[~_near(rows, columns)] = -1
    # Eight times as fast as numpy's argpartition.
    values, best = torch.topk(torch.from_numpy(alike), min(ALIKE, alike.shape[1]), dim=1)
    return values.numpy(), best.numpy()


@lru_cache(maxsize=1)
def _near(rows: int, columns: int) -> np.ndarray:
    """Which places are near which, (rows columns, rows columns) bool."""
    y, x = np.divmod(np.arange(rows * columns), columns)
    reach = NEAR * max(rows, columns)
    return (y[:, None] - y) ** 2 + (x[:, None] - x) ** 2 <= reach**2
