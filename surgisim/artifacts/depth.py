"""Distance of the tissue along the viewing axis, in every frame."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from surgisim.artifacts.base import Artifact, check


@dataclass(frozen=True)
class Depth(Artifact):
    z: np.ndarray
    """Depth along z [m], (T, H, W) float32, > 0 everywhere."""
    confidence: np.ndarray
    """How far to trust it, 0-1, (T, H, W) float32."""
    scale: Literal["known", "arbitrary"]
    follows: bool = True
    """Whether its change from frame to frame is measured, as in stereo; a guess from brightness alone is not."""

    UNITS = {"z": "m", "confidence": "1"}

    def __post_init__(self) -> None:
        check(
            self.z.ndim == 3 and self.z.shape == self.confidence.shape,
            f"Depth: z {self.z.shape} and confidence {self.confidence.shape} must be one (T, H, W).",
        )
        check(bool(np.all(np.isfinite(self.z)) and np.all(self.z > 0)), "Depth: z must be finite and > 0 everywhere.")
