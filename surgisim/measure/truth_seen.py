"""The truth of an invented clip, in the pixels the stages worked with."""

import json
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np

from surgisim.artifacts.camera import Camera
from surgisim.artifacts.motion import Motion
from surgisim.artifacts.truth import Truth
from surgisim.problem import Problem


@dataclass(frozen=True)
class TruthSeen:
    tool: np.ndarray
    """Instrument, (T, H, W) bool."""
    depth: np.ndarray
    """Depth of the tissue, behind any instrument [m], (T, H, W)."""
    xy: np.ndarray
    """Where each point is [px], (K, T, 2)."""
    xyz: np.ndarray
    """The same in the true camera's frame [m], (K, T, 3)."""
    visible: np.ndarray
    """(K, T) bool."""
    motion: Motion
    """The true grasp [m]."""
    focal: float
    """True focal length at the working size [px]."""
    parameters: dict[str, Any]
    """What the inventor wrote down: law -> parameter -> value, thickness, timeline, SI units."""


def seen(truth: Truth, camera: Camera) -> TruthSeen:
    """Crop and resize as ingest did. The true camera is found from its points' pixels in frame 0."""
    count = camera.frames
    if len(truth.depth) < count:
        raise Problem(
            f"truth: knows {len(truth.depth)} frames, but the clip has {count}. Pass the truth that was made with it."
        )
    left, top, width, height = camera.crop
    shrink = np.array([camera.width / width, camera.height / height])
    source, focal = _project(truth)
    source = source[:, :count]
    # Pixel centres are whole numbers, so a resize moves them by half a pixel.
    xy = (source - [left, top] + 0.5) * shrink - 0.5
    motion = Motion(
        truth.center_rest,
        truth.radius,
        truth.position[:, :count],
        truth.active[:, :count],
        np.ones(len(truth.radius)),
        "given",
    )
    crop = np.s_[:count, top : top + height, left : left + width]
    tool = _resized(truth.tool[crop].astype(np.uint8), camera) > 0
    depth = _resized(truth.depth[crop], camera)
    return TruthSeen(
        tool, depth, xy, truth.xyz[:, :count], truth.visible[:, :count], motion, focal * shrink[0],
        json.loads(truth.parameters),
    )  # fmt: skip


def _project(truth: Truth) -> tuple[np.ndarray, float]:
    """Pixels of the true points [source px], (K, T, 2), and the focal length, by the pinhole that explains frame 0."""
    ratio = truth.xyz[..., :2].astype(np.float64) / truth.xyz[..., 2:]
    pixels = np.empty(ratio.shape)
    for axis in range(2):
        system = np.stack([ratio[:, 0, axis], np.ones(len(ratio))], -1)
        (focal, center), *_ = np.linalg.lstsq(system, truth.pixels[:, axis].astype(np.float64), rcond=None)
        pixels[..., axis] = focal * ratio[..., axis] + center
    worst = float(np.abs(pixels[:, 0] - truth.pixels).max(initial=0))
    if worst > 0.5:
        raise Problem(f"truth: pixels and points disagree by {worst:.2f} px under any pinhole. Make the clip again.")
    return pixels, float(focal)


def _resized(stack: np.ndarray, camera: Camera) -> np.ndarray:
    if stack.shape[1:] == (camera.height, camera.width):
        return stack
    size = (camera.width, camera.height)
    return np.stack([cv2.resize(a, size, interpolation=cv2.INTER_NEAREST) for a in stack])
