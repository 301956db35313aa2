"""Which frames are new, which are shown again, and which are held out."""

import cv2
import numpy as np

from surgisim.artifacts.frames import AFTER, BETWEEN, USED
from surgisim.perception.optical_flow.dis import dense_flow

THUMBNAIL = 160
"""Width at which frames are compared [px]."""


def thumbnail(frame: np.ndarray) -> np.ndarray:
    """A small grey copy to compare frames by, (h, w) uint8."""
    height, width = frame.shape[:2]
    scale = min(1.0, THUMBNAIL / width)
    size = (max(round(width * scale), 16), max(round(height * scale), 16))
    return cv2.cvtColor(cv2.resize(frame, size, interpolation=cv2.INTER_AREA), cv2.COLOR_RGB2GRAY)


def shown_again(thumbnails: np.ndarray) -> tuple[np.ndarray, int]:
    """Frames to keep when a container shows every frame k times, and k; all of them and 1 when it does not.

    A frame is a copy when it differs from the one before much less than its neighbours do. Stretches where
    nothing moves cannot tell, so there every k-th frame is kept and time runs on as elsewhere.
    `thumbnails` (T, h, w) uint8; returns indices (T',).
    """
    count = len(thumbnails)
    everything = np.arange(count)
    if count < 6:
        return everything, 1
    change = np.abs(np.diff(thumbnails.astype(np.float32), axis=0)).mean((1, 2))
    around = np.maximum(np.r_[change[1:], 0], np.r_[0, change[:-1]])
    moving = np.maximum(change, around) > 0.15
    copied = moving & (change < 0.3 * around)
    steps = np.diff(np.flatnonzero(moving & ~copied))
    if moving.sum() < 4 or len(steps) < 2:
        return everything, 1
    repeat = int(np.median(steps))
    if repeat < 2 or (steps == repeat).mean() < 0.8 or copied.sum() < 0.8 * moving.sum() * (1 - 1 / repeat):
        return everything, 1
    kept = [0]
    for index in range(1, count):
        if index - kept[-1] >= repeat or (moving[index - 1] and not copied[index - 1]):
            kept.append(index)
    return np.array(kept), repeat


def is_still(frames: np.ndarray) -> bool:
    """Whether nothing moves: no part of the picture is ever displaced by a third of a pixel.

    `frames` sRGB (T, H, W, 3) uint8. Such a clip can be reconstructed, but teaches no physics.
    """
    others = np.unique(np.linspace(0, len(frames) - 1, min(len(frames), 9)).astype(int))[1:]
    return all(_largest_motion(frames[0], frames[t]) < 0.33 for t in others)


def _largest_motion(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.quantile(np.linalg.norm(dense_flow(a, b), axis=-1), 0.995))


def split(count: int, *, every: int, first: int, tail: float) -> np.ndarray:
    """USED, BETWEEN or AFTER for each frame, (T,) uint8; at least two frames, the first among them, stay USED."""
    index = np.arange(count)
    kind = np.where(index % every == first % every, BETWEEN, USED).astype(np.uint8)
    kind[count - min(round(tail * count), count - 1) :] = AFTER
    kind[0] = USED
    for spare in index:
        if (kind == USED).sum() < 2:
            kind[spare] = USED
    return kind
