"""Follow the whole surface once, for everything that asks where it went."""

from collections.abc import Callable

import cv2
import numpy as np

from surgisim.artifacts.correspondence import Correspondence
from surgisim.artifacts.frames import Frames
from surgisim.artifacts.masks import Masks
from surgisim.config import correspondence as config
from surgisim.perception.flow import pixel_grid
from surgisim.perception.optical_flow import Flow
from surgisim.perception.optical_flow.choice import chosen
from surgisim.perception.optical_flow.dis import dense_flow
from surgisim.perception.tracking.warp import follow_surface
from surgisim.problem import Problem


def correspond(
    frames: Frames,
    masks: Masks,
    settings: config.Correspondence,
    *,
    progress: Callable[[float, float, str], None] | None = None,
) -> Correspondence:
    """Where frame 0's pixels are in every frame, but for the instrument's."""
    rgb = frames.rgb
    if masks.tool.shape != rgb.shape[:3]:
        raise Problem(
            f"correspondence: masks are {masks.tool.shape} and frames {rgb.shape[:3]}; pass files of one clip and size."
        )
    by = max(1, round(settings.margin * max(rgb.shape[1:3])))
    flow = chosen(settings.flow, settings.flow_weights, stage="correspondence")
    hidden = np.stack([widen(mask, by) for mask in masks.tool])
    # The frames' own steps are short, where DIS is the better one: docs/benchmarks/learned.md.
    return between(rgb, hidden, far=None if flow is dense_flow else flow, progress=progress)


def between(
    rgb: np.ndarray,
    hidden: np.ndarray,
    *,
    far: Flow | None = None,
    progress: Callable[[float, float, str], None] | None = None,
) -> Correspondence:
    """Between frame 0 and every frame.

    rgb: sRGB, (T, H, W, 3) uint8. hidden: pixels that do not show the surface, (T, H, W) bool. far: flow to look for
    the surface by straight from frame 0, too.
    """
    moved = np.empty((*hidden.shape, 2), np.float16)
    seen, error = np.empty(hidden.shape, bool), np.empty(hidden.shape, np.float16)
    grid = pixel_grid(*hidden.shape[1:])
    for t, warp in enumerate(follow_surface(rgb, hidden, far=far, progress=progress)):
        moved[t], seen[t], error[t] = warp.position - grid, warp.seen, warp.error
    return Correspondence(moved, seen, error, hidden)


def widen(mask: np.ndarray, by: int) -> np.ndarray:
    """`mask` (H, W) grown by `by` px all round, bool."""
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * by + 1, 2 * by + 1))
    return cv2.dilate(mask.astype(np.uint8), disc) > 0
