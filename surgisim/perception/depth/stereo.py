"""Depth from a second, rectified view: semi-global matching, registration below the pixel, light and motion as a guide.

Hirschmueller, Stereo processing by semiglobal matching and mutual information, 2008, as OpenCV has it: right to a
quarter of a pixel, and drawn to whole ones. How depth changes shows in less, so each pixel's neighbourhood is then
shifted to where it fits the other view best (Lucas and Kanade, An iterative image registration technique with an
application to stereo vision, 1981). What is left of noise is averaged away along the shape that light and motion
suggest (guided.py).
"""

import cv2
import numpy as np

from surgisim.artifacts.camera import Camera
from surgisim.artifacts.given import Given
from surgisim.perception.depth.guided import guided
from surgisim.perception.tracking.spread import spread
from surgisim.problem import Problem

NEAREST = 0.25
"""Largest disparity looked for, as a share of the image's width."""
WINDOW, LEAST_WINDOW = 0.02, 4.0
"""Standard deviation of the neighbourhood that is registered, as a share of the image's width; in pixels at least;
chosen on five clips of family 16180."""
NOISE = 2.0
"""Brightness of a picture that tells nothing [0-255]."""
EDGE = 2
"""Columns at the other view's edge that nothing is matched with."""
ROUNDS = 5
"""Of registration."""
STRAYS = 1.5
"""How far from its match a neighbourhood may fit best [px]: what ends farther off fits by chance. In a clip of family
281134 at 320 px 95 of 100 end within .35, and one corner that strays held a third of the squared error; chosen there
and on EndoNeRF's right view, where matches of what moves fast are a pixel off that are set right."""
SURE = 0.9
"""Confidence of what is measured all around."""


def estimate(
    rgb: np.ndarray, hidden: np.ndarray, given: Given, camera: Camera, guide: tuple[np.ndarray, np.ndarray], *,
    distance: float,
) -> tuple[np.ndarray, np.ndarray, str]:  # fmt: skip
    """Depth [m], confidence (T, H, W) and whether its scale is known.

    rgb: left view as it was filmed, sRGB (T, H, W, 3) uint8. hidden: pixels that are not tissue's own, (T, H, W) bool.
    guide: depth to any scale and its confidence by light and motion, (T, H, W) each.
    Without a baseline, or with a focal length that is only assumed, the median depth of frame 0 becomes `distance` [m].
    """
    if given.right.shape != rgb.shape:
        raise Problem(
            f"depth: the right view is {given.right.shape} and the left {rgb.shape}; pass views of the same frames."
        )
    disparity = np.stack([match(left, right) for left, right in zip(rgb, given.right, strict=True)])
    # What lies left of the right view's edge was matched with nothing.
    known = (disparity > 0.5) & (np.arange(rgb.shape[2]) - disparity >= EDGE) & ~hidden
    fitted = np.stack([registered(*views) for views in zip(rgb, given.right, disparity, known, strict=True)])
    known &= (np.abs(fitted - disparity) < STRAYS) & (fitted > 0.5)
    share = known.sum() / max((~hidden).sum(), 1)
    if share < 0.05:
        raise Problem(
            f"depth: only {100 * share:.0f} % of the left view is found in the right one. "
            "Check that the two views are rectified and in order, or set depth.backend to 'near_light'."
        )
    z, share = guided(guide[0], measured(fitted, given.baseline or 1.0, camera), known)
    confidence = SURE * share + (1 - share) * guide[1]
    if given.baseline > 0 and camera.focal_from == "given":
        return z, confidence, "known"
    return z * (distance / np.median(z[0][~hidden[0]] if (~hidden[0]).any() else z[0])), confidence, "arbitrary"


def match(left: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Disparity of each pixel of `left`, sRGB (H, W, 3) uint8 [px], (H, W) float32; <= 0 where not found."""
    height, width = left.shape[:2]
    most = max(16, 16 * round(NEAREST * width / 16))
    block = 5
    matcher = cv2.StereoSGBM.create(
        minDisparity=0,
        numDisparities=most,
        blockSize=block,
        P1=8 * 3 * block**2,
        P2=32 * 3 * block**2,
        disp12MaxDiff=1,
        uniquenessRatio=8,
        speckleWindowSize=max(height * width // 800, 20),
        speckleRange=2,
        mode=cv2.STEREO_SGBM_MODE_HH,
    )
    # The matcher knows nothing of the leftmost columns, where the right view may not reach.
    pads = [np.pad(np.ascontiguousarray(v), ((0, 0), (most, 0), (0, 0)), mode="edge") for v in (left, right)]
    found = matcher.compute(*pads)[:, most:]
    return found.astype(np.float32) / 16


def registered(left: np.ndarray, right: np.ndarray, disparity: np.ndarray, known: np.ndarray) -> np.ndarray:
    """Disparity (H, W) [px] where it is known (H, W), to where neighbourhoods of both views (H, W, 3) agree best."""
    width = max(LEAST_WINDOW, WINDOW * left.shape[1])

    def around(field: np.ndarray, times: float = 1.0) -> np.ndarray:
        return cv2.GaussianBlur(field, (0, 0), times * width)

    # What is alike over the whole neighbourhood is the lamp's and the lens's doing.
    left, right = (v.astype(np.float32) - around(v.astype(np.float32), 3.0) for v in (left, right))
    steep = cv2.Sobel(right, cv2.CV_32F, 1, 0, scale=1 / 8)
    y, x = np.indices(disparity.shape, np.float32)
    shift = spread(disparity, known.astype(np.float32)).astype(np.float32)
    for _ in range(ROUNDS):
        at = x - shift
        there, slope = (cv2.remap(v, at, y, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE) for v in (right, steep))
        inside = known & (at >= 0)
        miss, sharp = (((a * slope).sum(-1) * inside).astype(np.float32) for a in (left - there, slope))
        shift = shift - np.clip(around(miss) / (around(sharp) + NOISE**2), -0.5, 0.5)
    return shift


def measured(disparity: np.ndarray, baseline: float, camera: Camera) -> np.ndarray:
    """z [m] of a disparity [px]; 0 where there is none."""
    return np.where(disparity > 0.5, camera.fx * baseline / np.maximum(disparity, 0.5), 0.0)
