"""Where each hidden pixel of each frame can be seen: another frame and a place in it."""

from dataclasses import dataclass

import numpy as np

from surgisim.perception.flow import agrees, carry, pixel_grid
from surgisim.perception.inpainting.smooth import continued


@dataclass(frozen=True)
class Source:
    """For every pixel of one frame: which frame shows it (-1 none) and where in that frame."""

    frame: np.ndarray
    """(H, W) int32."""
    xy: np.ndarray
    """[px], (H, W, 2) float32."""

    @property
    def found(self) -> np.ndarray:
        return self.frame >= 0


def seen(index: int, hole: np.ndarray) -> Source:
    """Every pixel outside the hole is its own source."""
    return Source(np.where(hole, -1, index).astype(np.int32), pixel_grid(*hole.shape))


def followed(before: Source, flow: np.ndarray, index: int, hole: np.ndarray) -> Source:
    """Sources of frame `index` whose hidden pixels are looked up where `flow` leads in a neighbour.

    Places are handed on, not colours: however long the chain, a colour is interpolated once.
    """
    height, width = hole.shape
    here = seen(index, hole)
    end = pixel_grid(height, width) + flow
    near = np.rint(end).astype(int)
    inside = (near >= 0).all(-1) & (near[..., 0] < width) & (near[..., 1] < height)
    x, y = np.clip(near[..., 0], 0, width - 1), np.clip(near[..., 1], 0, height - 1)
    chained = before.xy[y, x] + (end - near)
    on_picture = (chained >= -1).all(-1) & (chained[..., 0] <= width) & (chained[..., 1] <= height)
    chained = np.clip(chained, 0, [width - 1, height - 1])
    usable = hole & inside & on_picture & (before.frame[y, x] >= 0)
    return Source(
        np.where(usable, before.frame[y, x], here.frame), np.where(usable[..., None], chained, here.xy).astype("f4")
    )


def behind(flow: np.ndarray, back: np.ndarray, hole_here: np.ndarray, hole_there: np.ndarray) -> np.ndarray:
    """Motion of the tissue alone [px], (H, W, 2): measured where both frames show it, continued behind the tool."""
    landing = carry(hole_there.astype(np.float32), flow)
    trusted = ~hole_here & (landing < 0.01) & agrees(flow, back)
    return continued(flow, trusted) if trusted.any() else np.zeros_like(flow)
