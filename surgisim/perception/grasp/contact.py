"""How near an instrument is to the tissue, and which motion in the picture is its own."""

from itertools import pairwise

import cv2
import numpy as np

from surgisim.perception.optical_flow.dis import dense_flow
from surgisim.side_by_side import in_order


def frame_flow(rgb: np.ndarray) -> np.ndarray:
    """Flow of each frame to the next [px], (T - 1, H, W, 2) float32."""
    return np.stack(list(in_order(dense_flow, pairwise(rgb))))


def distance(tool: np.ndarray, xy: np.ndarray) -> np.ndarray:
    """From tissue points xy (K, T, 2) [px] to the nearest pixel of `tool` (T, H, W) bool, 0 behind it, (K, T) [px]."""
    height, width = tool.shape[1:]
    away = np.full(xy.shape[:2], np.hypot(height, width))
    for t in np.flatnonzero(tool.any((1, 2))):
        far = cv2.distanceTransform((~tool[t]).astype(np.uint8), cv2.DIST_L2, 5)
        inside = np.clip(xy[:, t], 0, [width - 1, height - 1])
        near = np.rint(inside).astype(int)
        # Tissue that left the image is as far from a seen instrument as it is from the edge, and more.
        away[:, t] = far[near[:, 1], near[:, 0]] + np.linalg.norm(xy[:, t] - inside, axis=-1)
    return away


def own_flow(flow: np.ndarray, tool: np.ndarray, tool_next: np.ndarray) -> np.ndarray:
    """Pixels whose `flow` (H, W, 2) is the instrument's own: inside its outline here and where they go, (H, W) bool."""
    core = cv2.erode(tool.astype(np.uint8), np.ones((3, 3), np.uint8)) > 0
    core = core if core.any() else tool
    end = np.rint(np.stack(np.meshgrid(np.arange(tool.shape[1]), np.arange(tool.shape[0])), -1) + flow).astype(int)
    end = np.clip(end, 0, np.array(tool.shape[::-1]) - 1)
    return core & tool_next[end[..., 1], end[..., 0]]
