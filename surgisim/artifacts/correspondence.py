"""Where the surface that frame 0 shows went, pixel by pixel."""

from dataclasses import dataclass

import numpy as np

from surgisim.artifacts.base import Artifact, check


@dataclass(frozen=True)
class Correspondence(Artifact):
    """Dense correspondence between frame 0 and every frame."""

    moved: np.ndarray
    """How far frame 0's pixels have gone [px], (T, H, W, 2) float16: a two-thousandth of it; a guess where not seen."""
    seen: np.ndarray
    """Whether the frame shows them, and they are followed by it, (T, H, W) bool."""
    error: np.ndarray
    """Standard deviation of each coordinate of `moved` [px], (T, H, W) float16."""
    hidden: np.ndarray
    """Pixels of each frame that do not show the surface: the instrument and its rim, (T, H, W) bool."""

    UNITS = {"moved": "px", "error": "px"}

    def __post_init__(self) -> None:
        thw = self.hidden.shape
        shapes = [self.moved.shape, self.seen.shape, self.error.shape]
        check(
            len(thw) == 3 and shapes == [(*thw, 2), thw, thw],
            f"Correspondence: shapes {shapes} do not fit hidden {thw}; (T, H, W, 2), (T, H, W), (T, H, W) are wanted.",
        )

    def position(self, frame: int) -> np.ndarray:
        """Where frame 0's pixels are in a frame [px], x then y, (H, W, 2) float32."""
        y, x = np.indices(self.hidden.shape[1:], np.float32)
        return np.stack([x, y], -1) + self.moved[frame]
