"""Where each pixel of one frame went in another: dense optical flow without weights.

Dense inverse search (Kroeger, Timofte, Dai and Van Gool, Fast optical flow using dense inverse search,
ECCV 2016) as OpenCV has it.
"""

import cv2
import numpy as np

# The search walks in one stripe per thread, so its result would depend on the number of cores. Once and for all: frames
# are worked on side by side, and a process may end where the number changes while another thread computes.
cv2.setNumThreads(1)


def dense_flow(a: np.ndarray, b: np.ndarray, *, start: np.ndarray | None = None) -> np.ndarray:
    """Displacement of each pixel of frame `a` on its way to frame `b`, x then y [px], (H, W, 2) float32.

    Frames are sRGB (H, W, 3) or grey (H, W), uint8, of one size. `start` is a first guess of the result.
    """
    first, second = _grey(a), _grey(b)
    height, width = first.shape
    search = cv2.DISOpticalFlow.create(cv2.DISOPTICAL_FLOW_PRESET_MEDIUM)
    # The coarsest level must hold a patch of 8 px: small frames need fewer levels.
    room = max(int(np.floor(np.log2(max(min(height, width), 16) / 16))), 0)
    search.setFinestScale(min(1, room))
    guess = None if start is None else start.astype(np.float32).copy()
    return search.calc(first, second, guess)


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


def _grey(frame: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(frame if frame.ndim == 2 else cv2.cvtColor(frame, cv2.COLOR_RGB2GRAY))
