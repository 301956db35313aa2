"""How near the instrument is to a point, and how it moves there."""

from dataclasses import dataclass

import cv2
import numpy as np

from surgisim.perception.flow import dense_flow
from surgisim.perception.tracking.between import sample


@dataclass(frozen=True)
class Contact:
    """The instrument as K tissue points meet it."""

    away: np.ndarray
    """Distance to the nearest instrument pixel [px], 0 behind it, (K, T)."""
    body: np.ndarray
    """Which connected piece of instrument that is, -1 when there is none, (K, T) int."""
    velocity: np.ndarray
    """The instrument's motion there to the next frame [px], NaN where there is none, (K, T, 2)."""

    def mean_velocity(self, held: np.ndarray) -> np.ndarray:
        """Its motion at points `held` (K,) to the next frame [px], NaN where it is not seen, (T, 2)."""
        there = self.velocity[held]
        out = np.full(there.shape[1:], np.nan)
        for t in range(len(out)):
            known = np.isfinite(there[:, t]).all(-1)
            if known.any():
                out[t] = np.median(there[known, t], axis=0)
        return out


def contact(rgb: np.ndarray, tool: np.ndarray, xy: np.ndarray) -> Contact:
    """rgb: sRGB (T, H, W, 3) uint8. tool: (T, H, W) bool. xy: tissue points [px], (K, T, 2)."""
    frames, (height, width) = len(rgb), rgb.shape[1:3]
    away = np.full(xy.shape[:2], np.hypot(height, width))
    body = np.full(xy.shape[:2], -1)
    velocity = np.full(xy.shape, np.nan)
    for t in range(frames):
        if not tool[t].any():
            continue
        _, pieces = cv2.connectedComponents(tool[t].astype(np.uint8))
        distance, label = cv2.distanceTransformWithLabels(
            (~tool[t]).astype(np.uint8), cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL
        )
        owner = np.zeros(label.max() + 1, int)
        owner[label[tool[t]]] = pieces[tool[t]]
        inside = np.clip(xy[:, t], 0, [width - 1, height - 1])
        near = np.rint(inside).astype(int)
        # Tissue that left the image is as far from a seen instrument as it is from the edge, and more.
        away[:, t] = distance[near[:, 1], near[:, 0]] + np.linalg.norm(xy[:, t] - inside, axis=-1)
        body[:, t] = owner[label[near[:, 1], near[:, 0]]]
        if t + 1 < frames and tool[t + 1].any():
            flow = _near_tool(rgb[t], rgb[t + 1], tool[t], tool[t + 1])
            velocity[:, t] = sample(flow, inside[:, None].astype(np.float32))[:, 0]
    return Contact(away, body, velocity)


def _near_tool(first: np.ndarray, second: np.ndarray, tool: np.ndarray, tool_next: np.ndarray) -> np.ndarray:
    """The instrument's flow, averaged over the instrument pixels around each pixel, (H, W, 2)."""
    flow = dense_flow(first, second)
    core = cv2.erode(tool.astype(np.uint8), np.ones((3, 3), np.uint8)) > 0
    core = core if core.any() else tool
    end = np.rint(np.stack(np.meshgrid(np.arange(tool.shape[1]), np.arange(tool.shape[0])), -1) + flow).astype(int)
    end = np.clip(end, 0, np.array(tool.shape[::-1]) - 1)
    weight = (core & tool_next[end[..., 1], end[..., 0]]).astype(np.float32)
    radius = 0.05 * max(tool.shape)
    total = cv2.GaussianBlur(weight, (0, 0), radius)
    mean = cv2.GaussianBlur(flow * weight[..., None], (0, 0), radius)
    return np.where(total[..., None] > 0.01, mean / np.maximum(total, 0.01)[..., None], np.nan).astype(np.float32)
