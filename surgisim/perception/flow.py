"""What is done with the optical flow between two frames: displacement of each pixel, x then y [px], (H, W, 2)."""

import cv2
import numpy as np


def carry(field: np.ndarray, flow: np.ndarray, *, nearest: bool = False) -> np.ndarray:
    """`field` read where `flow` points: out(x) = field(x + flow(x)), edge values repeated, (H, W, ...)."""
    xy = (pixel_grid(*flow.shape[:2]) + flow).astype(np.float32)
    way = cv2.INTER_NEAREST if nearest else cv2.INTER_LINEAR
    return cv2.remap(field, xy[..., 0], xy[..., 1], way, borderMode=cv2.BORDER_REPLICATE)


def chain(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Flow a -> c from flows a -> b and b -> c [px], (H, W, 2) float32."""
    return first + carry(second, first)


def round_trip(forward: np.ndarray, backward: np.ndarray) -> np.ndarray:
    """How far a pixel ends from where it began when it goes there and back [px], (H, W) float32."""
    return np.linalg.norm(chain(forward, backward), axis=-1)


def agrees(forward: np.ndarray, backward: np.ndarray, *, within: float = 1.0) -> np.ndarray:
    """Whether forward and backward flow meet: to `within` px, looser where the motion is large, (H, W) bool.

    A pixel that leaves the image does not agree.
    """
    height, width = forward.shape[:2]
    end = pixel_grid(height, width) + forward
    inside = (end >= 0).all(-1) & (end[..., 0] <= width - 1) & (end[..., 1] <= height - 1)
    return inside & (round_trip(forward, backward) < within + 0.05 * np.linalg.norm(forward, axis=-1))


def pixel_grid(height: int, width: int) -> np.ndarray:
    """Every pixel's own position, x then y [px], (H, W, 2) float32."""
    return np.stack(np.meshgrid(np.arange(width), np.arange(height)), -1).astype(np.float32)
