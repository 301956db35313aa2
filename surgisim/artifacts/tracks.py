"""Where points of the tissue's surface went, in pixels and in space."""

from dataclasses import dataclass

import numpy as np

from surgisim.artifacts.base import Artifact, check


@dataclass(frozen=True)
class Tracks(Artifact):
    """Every point starts on the tissue in frame 0."""

    xy: np.ndarray
    """Pixel position [px], (K, T, 2) float32; a best guess where not visible."""
    visible: np.ndarray
    """Whether the point was seen, (K, T) bool."""
    sigma: np.ndarray
    """Standard deviation of each coordinate of xy [px], (K, T) float32."""
    xyz: np.ndarray
    """Position, camera frame [m], (K, T, 3) float32, NaN where not seen."""
    sigma_xyz: np.ndarray
    """Standard deviation across and along the view [m], (K, T, 2) float32."""

    UNITS = {"xy": "px", "sigma": "px", "xyz": "m", "sigma_xyz": "m"}

    def __post_init__(self) -> None:
        kt = self.visible.shape
        shapes = [self.xy.shape, self.sigma.shape, self.xyz.shape, self.sigma_xyz.shape]
        check(
            len(kt) == 2 and shapes == [(*kt, 2), kt, (*kt, 3), (*kt, 2)],
            f"Tracks: shapes {shapes} do not fit visible {kt}; (K, T, 2), (K, T), (K, T, 3), (K, T, 2) are wanted.",
        )
