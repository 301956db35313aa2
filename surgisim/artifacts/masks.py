"""What each pixel shows: instrument, tissue, highlight."""

from dataclasses import dataclass

import numpy as np

from surgisim.artifacts.base import Artifact, check


@dataclass(frozen=True)
class Masks(Artifact):
    tool: np.ndarray
    """Instrument, (T, H, W) bool."""
    tissue: np.ndarray
    """Tissue that may be learned from, (T, H, W) bool; never overlaps `tool`."""
    specular: np.ndarray
    """Highlights, (T, H, W) bool; colour there is the lamp's, not the tissue's."""
    confidence: np.ndarray
    """How sure the instrument's outline is, 0-1, (T,) float32."""

    UNITS = {"confidence": "1"}

    def __post_init__(self) -> None:
        shapes = [a.shape for a in (self.tool, self.tissue, self.specular)]
        check(len(set(shapes)) == 1 and len(shapes[0]) == 3, f"Masks: shapes {shapes} must be one (T, H, W).")
        check(self.confidence.shape == shapes[0][:1], f"Masks: confidence {self.confidence.shape} must be (T,).")
        check(not (self.tool & self.tissue).any(), "Masks: a pixel is both tool and tissue.")
