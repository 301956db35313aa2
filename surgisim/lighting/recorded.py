"""What the recording shows along the way of carried surface points."""

import cv2
import numpy as np

from surgisim.artifacts.frames import Frames
from surgisim.artifacts.masks import Masks
from surgisim.lighting.headlight import to_linear
from surgisim.perception.tracking.between import sample

SURE = 0.5
"""Share of the blur around a point that has to be tissue without a highlight."""
DARK, BRIGHT = 8, 250
"""Grey levels outside of which a pixel tells no brightness, as in `perception.depth.near_light`."""


def shown(frame: int, pixels: np.ndarray, frames: Frames, masks: Masks, blur: float) -> tuple[np.ndarray, np.ndarray]:
    """Linear light around `pixels` [px], (Q, 2), of a frame, (Q, 3), and whether it is the tissue's own, (Q,).

    Averaged by a Gaussian of `blur` [px] over tissue that is neither dark, nor saturated, nor in or beside a highlight.
    """
    rgb = frames.rgb[frame]
    usable = masks.tissue[frame] & ~beside(masks.specular[frame]) & (rgb.max(-1) < BRIGHT) & (rgb.max(-1) > DARK)
    light = to_linear(rgb.astype(np.float32) / 255) * usable[..., None]
    share = cv2.GaussianBlur(usable.astype(np.float32), (0, 0), blur)
    mean = cv2.GaussianBlur(light.astype(np.float32), (0, 0), blur) / np.maximum(share, 1e-6)[..., None]
    height, width = usable.shape
    inside = (pixels >= 0).all(-1) & (pixels[:, 0] <= width - 1) & (pixels[:, 1] <= height - 1)
    known = sample(share[..., None], pixels[:, None])[:, 0, 0] > SURE
    return sample(mean, pixels[:, None])[:, 0].astype(float), inside & known


def beside(mask: np.ndarray) -> np.ndarray:
    """A mask (H, W) and the pixels next to it: a highlight's skirt."""
    return cv2.dilate(mask.astype(np.uint8), np.ones((3, 3), np.uint8)) > 0
