"""Make measured depth whole: holes filled, frames without any bridged, steps and specks smoothed."""

import cv2
import numpy as np

from surgisim.perception.tracking.spread import spread

TOO_FEW = 0.1
"""Share of usable pixels that must have a depth for a frame to count as measured."""
ROUGH = 0.02
"""Differences below this share of the depth are taken for noise or for steps of the file's format."""


def complete(z: np.ndarray, known: np.ndarray, usable: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Depth > 0 everywhere [m] and how far to trust it 0-1, (T, H, W) float32 each.

    z: measured [m]; known: where; usable: pixels that show tissue, all (T, H, W). Frames with hardly any measurement
    take the nearest measured frames' depth, weighted by how near they are in time.
    """
    known = known & usable
    known &= _plausible(z, known)
    measured = np.flatnonzero(known.sum((1, 2)) > TOO_FEW * np.maximum(usable.sum((1, 2)), 1))
    if not len(measured):
        raise ValueError("no frame has enough measured depth")
    whole = {t: _settle(spread(np.log(np.where(known[t], z[t], 1.0)), known[t].astype(np.float32))) for t in measured}
    steady = {t: _steady(whole, t, measured) for t in measured}
    out, trust = np.empty(z.shape, np.float32), np.empty(z.shape, np.float32)
    for t in range(len(z)):
        before, after = measured[measured <= t], measured[measured >= t]
        first = before[-1] if len(before) else after[0]
        second = after[0] if len(after) else before[-1]
        share = (t - first) / (second - first) if second > first else 0.0
        out[t] = np.exp((1 - share) * steady[first] + share * steady[second])
        near = np.exp(-min(abs(t - first), abs(second - t)) / 5)
        trust[t] = near * cv2.GaussianBlur(np.where(known[first if share < 0.5 else second], 1.0, 0.15), (0, 0), 1.0)
    return out, trust


def _plausible(z: np.ndarray, known: np.ndarray) -> np.ndarray:
    """Not a stray value: within a factor of three of the recording's median."""
    middle = np.median(z[known]) if known.any() else 1.0
    return (z > middle / 3) & (z < 3 * middle)


def _settle(log_z: np.ndarray) -> np.ndarray:
    """Smoothed over a few pixels, not across edges."""
    radius = max(1.0, 0.008 * max(log_z.shape))
    specks = cv2.medianBlur(log_z.astype(np.float32), 5)
    return cv2.bilateralFilter(specks, -1, 1.5 * ROUGH, radius, borderType=cv2.BORDER_REPLICATE)


def _steady(whole: dict[int, np.ndarray], t: int, measured: np.ndarray) -> np.ndarray:
    """Mean with the neighbouring frames that agree, after their median took the flicker out."""
    near = [whole[s] for s in measured if abs(s - t) <= 2]
    middle = np.median(near, axis=0)
    close = [np.exp(-(((part - middle) / ROUGH) ** 2)) for part in near]
    return (sum(c * p for c, p in zip(close, near, strict=True)) + 1e-3 * middle) / (sum(close) + 1e-3)
