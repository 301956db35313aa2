"""How near an instrument is to the tissue, and how it moves there."""

from dataclasses import dataclass
from itertools import pairwise

import cv2
import numpy as np

from surgisim.perception.flow import dense_flow
from surgisim.perception.tracking.between import sample


@dataclass(frozen=True)
class Contact:
    """One instrument as K tissue points meet it."""

    away: np.ndarray
    """Distance to its nearest pixel [px], 0 behind it, (K, T)."""
    velocity: np.ndarray
    """Its motion there to the next frame [px], NaN where there is none, (K, T, 2)."""

    def mean_velocity(self, held: np.ndarray) -> np.ndarray:
        """Its motion at points `held` (K,) to the next frame [px], NaN where it is not seen, (T, 2)."""
        there = self.velocity[held]
        out = np.full(there.shape[1:], np.nan)
        for t in range(len(out)):
            known = np.isfinite(there[:, t]).all(-1)
            if known.any():
                out[t] = np.median(there[known, t], axis=0)
        return out


def frame_flow(rgb: np.ndarray) -> np.ndarray:
    """Flow of each frame to the next [px], (T - 1, H, W, 2) float32."""
    return np.stack([dense_flow(a, b) for a, b in pairwise(rgb)])


def contact(flow: np.ndarray, tool: np.ndarray, xy: np.ndarray) -> Contact:
    """How tissue points meet an instrument.

    flow: of each frame to the next [px], (T - 1, H, W, 2). tool: (T, H, W) bool. xy: the points [px], (K, T, 2).
    """
    frames, height, width = tool.shape
    away = np.full(xy.shape[:2], np.hypot(height, width))
    velocity = np.full(xy.shape, np.nan)
    for t in np.flatnonzero(tool.any((1, 2))):
        distance = cv2.distanceTransform((~tool[t]).astype(np.uint8), cv2.DIST_L2, 5)
        inside = np.clip(xy[:, t], 0, [width - 1, height - 1])
        near = np.rint(inside).astype(int)
        # Tissue that left the image is as far from a seen instrument as it is from the edge, and more.
        away[:, t] = distance[near[:, 1], near[:, 0]] + np.linalg.norm(xy[:, t] - inside, axis=-1)
        if t + 1 < frames and tool[t + 1].any():
            mean = _near_tool(flow[t], tool[t], tool[t + 1])
            velocity[:, t] = sample(mean, inside[:, None].astype(np.float32))[:, 0]
    return Contact(away, velocity)


def own_flow(flow: np.ndarray, tool: np.ndarray, tool_next: np.ndarray) -> np.ndarray:
    """Pixels whose `flow` (H, W, 2) is the instrument's own: inside its outline here and where they go, (H, W) bool."""
    core = cv2.erode(tool.astype(np.uint8), np.ones((3, 3), np.uint8)) > 0
    core = core if core.any() else tool
    end = np.rint(np.stack(np.meshgrid(np.arange(tool.shape[1]), np.arange(tool.shape[0])), -1) + flow).astype(int)
    end = np.clip(end, 0, np.array(tool.shape[::-1]) - 1)
    return core & tool_next[end[..., 1], end[..., 0]]


def _near_tool(flow: np.ndarray, tool: np.ndarray, tool_next: np.ndarray) -> np.ndarray:
    """The instrument's flow, averaged over the instrument pixels around each pixel, (H, W, 2)."""
    weight = own_flow(flow, tool, tool_next).astype(np.float32)
    radius = 0.05 * max(tool.shape)
    total = cv2.GaussianBlur(weight, (0, 0), radius)
    mean = cv2.GaussianBlur(flow * weight[..., None], (0, 0), radius)
    return np.where(total[..., None] > 0.01, mean / np.maximum(total, 0.01)[..., None], np.nan).astype(np.float32)
