"""Take the instrument out of every frame with the chosen backend."""

import importlib
import pkgutil
from collections.abc import Callable

import cv2
import numpy as np

from surgisim.artifacts.frames import Frames
from surgisim.artifacts.inpainted import SEEN, Inpainted
from surgisim.artifacts.masks import Masks
from surgisim.config.inpainting import Inpainting
from surgisim.perception import inpainting
from surgisim.problem import Problem

Progress = Callable[[float, float, str], None]


def without_tool(frames: Frames, masks: Masks, settings: Inpainting, *, progress: Progress) -> Inpainted:
    """Frames with the instrument filled in; pixels outside it are the recording's own, unchanged."""
    if masks.tool.shape != frames.rgb.shape[:3]:
        raise Problem(
            f"masks are {masks.tool.shape} (frames, rows, columns), but the frames are {frames.rgb.shape[:3]}. "
            "Run masking on these frames."
        )
    files = sorted(m.name for m in pkgutil.iter_modules(inpainting.__path__))
    known = [f for f in files if f not in ("removal", "smooth", "source")]
    if settings.backend not in known:
        raise Problem(
            f"config key 'inpainting.backend' is '{settings.backend}', and surgisim/perception/inpainting/ holds "
            f"{known}. Choose one of them."
        )
    if not masks.tool.any():
        return Inpainted(frames.rgb, np.full(masks.tool.shape, SEEN, np.uint8))
    margin = round(0.016 * max(masks.tool.shape[1:])) if settings.margin is None else settings.margin
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * margin + 1, 2 * margin + 1))
    hole = np.stack([cv2.dilate(m.astype(np.uint8), disc) for m in masks.tool]).astype(bool)
    empty = np.flatnonzero(hole.all((1, 2)))
    if len(empty) == len(hole):
        raise Problem("the instrument covers every frame entirely, so there is no tissue to copy. Correct the masks.")
    fill = importlib.import_module(f"{inpainting.__name__}.{settings.backend}").fill
    return Inpainted(*fill(frames.rgb, hole, settings, progress))
