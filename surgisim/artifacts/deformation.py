"""The field that moves the canonical Gaussians through the clip."""

from dataclasses import dataclass

import numpy as np

from surgisim.artifacts.base import Artifact


@dataclass(frozen=True)
class Deformation(Artifact):
    planes: np.ndarray
    """All feature planes laid end to end, float32; `layout` says how."""
    weights: np.ndarray
    """The head's weights laid end to end, float32."""
    layout: str
    """JSON: scales, resolutions, channels, widths."""
    low: np.ndarray
    """Lower corner of the space-time box: x, y, z [m], t [s], (4,)."""
    high: np.ndarray
    """Upper corner, (4,)."""
    moments: np.ndarray
    """When the frames were taken that were looked at, (M,)."""
    tint: np.ndarray
    """What is added to each Gaussian's colour in those frames but the first, straight between them, sRGB 0-1,
    (M - 1, G, 3) float16; see surgisim.gaussians.tint."""
    history: np.ndarray
    """Iteration, loss, PSNR [dB] on used frames, Gaussians, phase, (R, 5) float32."""

    UNITS = {"low": "m, m, m, s", "high": "m, m, m, s", "moments": "s"}
