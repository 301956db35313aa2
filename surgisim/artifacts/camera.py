"""The camera and the clock of a clip."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from surgisim.artifacts.base import JsonArtifact, check


@dataclass(frozen=True)
class Camera(JsonArtifact):
    """A pinhole at the origin looking along +z; x right, y down; pixel centres at whole numbers."""

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    fps: float
    frames: int
    scale: Literal["known", "arbitrary"]
    """Whether one metre of the scene is one metre of the world."""
    focal_from: Literal["given", "assumed"]
    source: str
    """Name of the clip, without its folder."""
    source_size: list[int]
    """Width and height before cropping and resizing [px]."""
    crop: list[int]
    """Left, top, width and height of what was kept [source px]."""

    UNITS = {"width": "px", "height": "px", "fx": "px", "fy": "px", "cx": "px", "cy": "px", "fps": "1/s"}

    def __post_init__(self) -> None:
        check(min(self.fx, self.fy, self.fps) > 0, f"Camera: fx {self.fx}, fy {self.fy}, fps {self.fps} must be > 0.")

    @property
    def matrix(self) -> np.ndarray:
        """Intrinsics [px], (3, 3)."""
        return np.array([[self.fx, 0, self.cx], [0, self.fy, self.cy], [0, 0, 1.0]])

    @property
    def _resized(self) -> np.ndarray:
        """Working pixels a recorded one, along x and y."""
        return np.array([self.width / self.crop[2], self.height / self.crop[3]])

    def from_recording(self, pixels: np.ndarray) -> np.ndarray:
        """Working pixels of the recording's own [px], (..., 2)."""
        return (np.asarray(pixels, float) - self.crop[:2] + 0.5) * self._resized - 0.5

    def to_recording(self, pixels: np.ndarray) -> np.ndarray:
        """The recording's own pixels of working ones [px], (..., 2)."""
        return (np.asarray(pixels, float) + 0.5) / self._resized - 0.5 + self.crop[:2]

    def project(self, points: np.ndarray) -> np.ndarray:
        """Pixels of points, camera frame [m], (..., 3) -> [px], (..., 2)."""
        return np.stack(
            [self.fx * points[..., 0] / points[..., 2] + self.cx, self.fy * points[..., 1] / points[..., 2] + self.cy],
            -1,
        )

    def lift(self, pixels: np.ndarray, z: np.ndarray) -> np.ndarray:
        """Points of pixels [px], (..., 2) at depths z [m], (...) -> camera frame [m], (..., 3)."""
        x = (pixels[..., 0] - self.cx) / self.fx * z
        y = (pixels[..., 1] - self.cy) / self.fy * z
        return np.stack([x, y, z], -1)
