"""The recording with the instrument taken out."""

from dataclasses import dataclass

import numpy as np

from surgisim.artifacts.base import Artifact, check

SEEN, COPIED, INVENTED = 0, 1, 2


@dataclass(frozen=True)
class Inpainted(Artifact):
    rgb: np.ndarray
    """Colour, sRGB, (T, H, W, 3) uint8."""
    origin: np.ndarray
    """Where each pixel comes from: SEEN here, COPIED from another frame, or INVENTED, (T, H, W) uint8."""

    UNITS = {"rgb": "sRGB 0-255"}

    def __post_init__(self) -> None:
        check(
            self.rgb.ndim == 4 and self.rgb.shape[3] == 3 and self.rgb.dtype == np.uint8,
            f"Inpainted: rgb is {self.rgb.dtype} {self.rgb.shape}, but uint8 (T, H, W, 3) is wanted.",
        )
        check(self.origin.shape == self.rgb.shape[:3], f"Inpainted: origin {self.origin.shape} must be (T, H, W).")
