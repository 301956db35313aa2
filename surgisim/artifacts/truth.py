"""What the phantom knows about a clip it invented; opened for scoring only."""

from dataclasses import dataclass

import numpy as np

from surgisim.artifacts.base import Artifact


@dataclass(frozen=True)
class Truth(Artifact):
    tool: np.ndarray
    """Instrument pixels, (T, H, W) bool."""
    depth: np.ndarray
    """Depth of the tissue behind any instrument [m], (T, H, W) float32."""
    pixels: np.ndarray
    """Frame-0 pixel of each tracked point, (K, 2) float32."""
    xyz: np.ndarray
    """Where each point went, camera frame [m], (K, T, 3) float32."""
    visible: np.ndarray
    """Not hidden by instrument or tissue and inside the image, (K, T) bool."""
    center_rest: np.ndarray
    """Grips, camera frame [m], (J, 3)."""
    radius: np.ndarray
    """[m], (J,)."""
    position: np.ndarray
    """[m], (J, T, 3)."""
    active: np.ndarray
    """(J, T) bool."""
    parameters: str
    """JSON: law -> parameter -> value in SI units, and density, thickness, hidden effects."""

    UNITS = {"depth": "m", "xyz": "m", "center_rest": "m", "radius": "m", "position": "m", "pixels": "px"}
