"""Read images between their pixels, to the last digit.

OpenCV's remap rounds positions to 1/32 px and its cubic kernel shifts slopes, which is too coarse for points that are
followed to a few hundredths of a pixel.
"""

import numpy as np
from numba import njit


def sample(image: np.ndarray, at: np.ndarray) -> np.ndarray:
    """`image` read at `at` (..., 2) [px], x then y, edge values repeated; float32.

    (H, W) by Catmull-Rom's cubic, (H, W, C) between the four nearest pixels.
    """
    where = np.ascontiguousarray(at, np.float64).reshape(-1, 2)
    if image.ndim == 2:
        return _cubic(np.ascontiguousarray(image, np.float32), where).reshape(at.shape[:-1])
    return _linear(np.ascontiguousarray(image, np.float32), where).reshape(*at.shape[:-1], image.shape[2])


@njit(cache=True, nogil=True)
def _cubic(image, at):
    height, width = image.shape
    out = np.empty(len(at), np.float32)
    wx, wy = np.empty(4), np.empty(4)
    for k in range(len(at)):
        x = min(max(at[k, 0], 0.0), width - 1.0)
        y = min(max(at[k, 1], 0.0), height - 1.0)
        left, top = int(np.floor(x)), int(np.floor(y))
        _weights(x - left, wx)
        _weights(y - top, wy)
        total = 0.0
        for j in range(4):
            row = min(max(top - 1 + j, 0), height - 1)
            line = 0.0
            for i in range(4):
                line += wx[i] * image[row, min(max(left - 1 + i, 0), width - 1)]
            total += wy[j] * line
        out[k] = total
    return out


@njit(cache=True)
def _weights(t, w):
    w[0] = ((-0.5 * t + 1.0) * t - 0.5) * t
    w[1] = (1.5 * t - 2.5) * t * t + 1.0
    w[2] = ((-1.5 * t + 2.0) * t + 0.5) * t
    w[3] = (0.5 * t - 0.5) * t * t


@njit(cache=True, nogil=True)
def _linear(image, at):
    height, width, channels = image.shape
    out = np.empty((len(at), channels), np.float32)
    for k in range(len(at)):
        x = min(max(at[k, 0], 0.0), width - 1.0)
        y = min(max(at[k, 1], 0.0), height - 1.0)
        left, top = min(int(x), max(width - 2, 0)), min(int(y), max(height - 2, 0))
        right, below = min(left + 1, width - 1), min(top + 1, height - 1)
        u, v = x - left, y - top
        for c in range(channels):
            above = (1.0 - u) * image[top, left, c] + u * image[top, right, c]
            under = (1.0 - u) * image[below, left, c] + u * image[below, right, c]
            out[k, c] = (1.0 - v) * above + v * under
    return out
