"""Carry values from where they are known to where they are not, smoothly."""

import cv2
import numpy as np


def spread(values: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """`values` (H, W) or (H, W, C) kept where `weight` (H, W) is 1 and filled from around where it is 0.

    Values are averaged into coarser and coarser images and brought back where finer ones know nothing
    (Gortler, Grzeszczuk, Szeliski and Cohen, The lumigraph, 1996). With no weight anywhere the result is 0.
    """
    known = [weight.astype(np.float32)]
    sums = [values.astype(np.float32) * _like(known[0], values)]
    while min(known[-1].shape) > 2:
        known.append(cv2.pyrDown(known[-1]))
        sums.append(cv2.pyrDown(sums[-1]))
    total = float(known[-1].sum())
    shape = sums[-1].shape
    mean = sums[-1].reshape(-1, *shape[2:]).sum(0) / total if total > 0 else np.zeros(shape[2:], np.float32)
    out = np.broadcast_to(mean, shape).astype(np.float32)
    for have, sum_ in zip(known[::-1], sums[::-1], strict=True):
        if out.shape[:2] != have.shape:
            out = cv2.pyrUp(out, dstsize=have.shape[::-1])
        here = sum_ / _like(np.maximum(have, 1e-6), sum_)
        out = out + _like(np.minimum(have, 1.0), sum_) * (here - out)
    return out


def _like(flat: np.ndarray, values: np.ndarray) -> np.ndarray:
    return flat.reshape(flat.shape + (1,) * (values.ndim - 2))
