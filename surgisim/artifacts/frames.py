"""The recording at its working size."""

from dataclasses import dataclass

import numpy as np

from surgisim.artifacts.base import Artifact, check

USED, BETWEEN, AFTER = 0, 1, 2


@dataclass(frozen=True)
class Frames(Artifact):
    rgb: np.ndarray
    """Colour, sRGB, (T, H, W, 3) uint8."""
    split: np.ndarray
    """USED for fitting, held out BETWEEN used frames, or held out AFTER them, (T,) uint8."""

    UNITS = {"rgb": "sRGB 0-255"}

    def __post_init__(self) -> None:
        check(
            self.rgb.ndim == 4 and self.rgb.shape[3] == 3 and self.rgb.dtype == np.uint8,
            f"Frames: rgb is {self.rgb.dtype} {self.rgb.shape}, but uint8 (T, H, W, 3) is wanted.",
        )
        check(self.split.shape == self.rgb.shape[:1], f"Frames: split {self.split.shape} must be ({len(self.rgb)},).")
