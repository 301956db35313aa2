"""Optical flow without weights: dense inverse search, as OpenCV has it.

Kroeger, Timofte, Dai and Van Gool, Fast optical flow using dense inverse search, ECCV 2016.
"""

from pathlib import Path

import cv2
import numpy as np

from surgisim.perception.optical_flow import Flow

# The search walks in one stripe per thread, so its result would depend on the number of cores. Once and for all: frames
# are worked on side by side, and a process may end where the number changes while another thread computes.
cv2.setNumThreads(1)


def prepared(weights: Path | None) -> Flow:
    return dense_flow


def dense_flow(a: np.ndarray, b: np.ndarray, *, start: np.ndarray | None = None) -> np.ndarray:
    """Displacement of each pixel of frame `a` on its way to frame `b`, x then y [px], (H, W, 2) float32.

    Frames are sRGB (H, W, 3) or grey (H, W), uint8, of one size. `start` is a first guess of the result.
    """
    first, second = _grey(a), _grey(b)
    height, width = first.shape
    search = cv2.DISOpticalFlow.create(cv2.DISOPTICAL_FLOW_PRESET_MEDIUM)
    # The coarsest level must hold a patch of 8 px: small frames need fewer levels.
    room = max(int(np.floor(np.log2(max(min(height, width), 16) / 16))), 0)
    search.setFinestScale(min(1, room))
    guess = None if start is None else start.astype(np.float32).copy()
    return search.calc(first, second, guess)


def _grey(frame: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(frame if frame.ndim == 2 else cv2.cvtColor(frame, cv2.COLOR_RGB2GRAY))
