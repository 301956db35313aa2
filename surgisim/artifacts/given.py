"""What came with the recording and need not be estimated: masks, depth, a right view."""

from dataclasses import dataclass

import numpy as np

from surgisim.artifacts.base import Artifact, check


@dataclass(frozen=True)
class Given(Artifact):
    """An array that was not given has no frames: its first axis is 0."""

    tool: np.ndarray
    """Instrument pixels, (T or 0, H, W) bool."""
    depth: np.ndarray
    """Depth along z, 0 where unknown [m], (T or 0, H, W) float32."""
    right: np.ndarray
    """Right view of a rectified stereo pair, sRGB, (T or 0, H, W, 3) uint8."""
    baseline: float
    """Distance between the two views [m], 0 when there is one."""

    UNITS = {"depth": "m", "right": "sRGB 0-255", "baseline": "m"}

    def __post_init__(self) -> None:
        sizes = {a.shape[1:3] for a in (self.tool, self.depth, self.right)}
        check(len(sizes) == 1, f"Given: tool, depth and right have different sizes {sorted(sizes)}.")
