"""What a pixel's colour says: redness, highlights, what the lamp reaches."""

import cv2
import numpy as np

OFFSET = 8.0
"""Added to channels before ratios, so that dark noise has no hue [0-255]."""
BLACK = 24
"""Brightest channel of what the lamp never reaches [0-255]."""


def features(rgb: np.ndarray) -> np.ndarray:
    """Logarithms of red over green, green over blue, and brightest channel, (H, W, 3) float32.

    Ratios do not change when a surface turns from the lamp; red over green tells blood-filled tissue from metal.
    """
    level = cv2.GaussianBlur(rgb, (0, 0), 0.5).astype(np.float32) + OFFSET
    red, green, blue = level[..., 0], level[..., 1], level[..., 2]
    return np.stack([np.log(red / green), np.log(green / blue), np.log(level.max(-1))], -1)


def lit(rgb: np.ndarray) -> np.ndarray:
    """Pixels inside the endoscope's picture: the connected surround that is black in every frame is not, (T, H, W)."""
    dark = (rgb.max((0, 3)) <= BLACK).astype(np.uint8)
    _, label, stats, _ = cv2.connectedComponentsWithStats(dark, connectivity=4)
    height, width = dark.shape
    x, y, w, h = (stats[:, i] for i in range(4))
    outside = (x == 0) | (y == 0) | (x + w == width) | (y + h == height)
    outside[0] = False
    return np.broadcast_to(~outside[label], rgb.shape[:3]).copy()


def specular(rgb: np.ndarray, tool: np.ndarray) -> np.ndarray:
    """Highlights on tissue: bright, nearly colourless, brighter than what surrounds them, (T, H, W) bool."""
    return np.stack([highlights(frame) & ~held for frame, held in zip(rgb, tool, strict=True)])


def highlights(frame: np.ndarray) -> np.ndarray:
    """Highlights of one frame, on tissue or not, (H, W) bool."""
    high, low = frame.max(-1).astype(np.float32), frame.min(-1).astype(np.float32)
    radius = max(frame.shape[:2]) // 16 * 2 + 1
    around = cv2.blur(low, (radius, radius))
    # White surfaces are bright and colourless too, but not against their own surroundings.
    spots = (high > 180) & (low > 0.78 * high) & (low > around + 50)
    spots |= low > 240
    cross = cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3))
    return cv2.dilate(spots.astype(np.uint8), cross).astype(bool)
