"""Crop and resize, of pictures and of the numbers that belong to them."""

from dataclasses import dataclass

import cv2
import numpy as np
from scipy.ndimage import distance_transform_edt


@dataclass(frozen=True)
class Window:
    """What is kept of the source and the size it is brought to."""

    left: int
    top: int
    width: int
    height: int
    to_width: int
    to_height: int

    def colour(self, image: np.ndarray) -> np.ndarray:
        """Area-averaged, (H, W, 3) uint8."""
        kept = self._kept(image)
        if kept.shape[:2] == (self.to_height, self.to_width):
            return np.ascontiguousarray(kept)
        return cv2.resize(kept, (self.to_width, self.to_height), interpolation=cv2.INTER_AREA)

    def mask(self, image: np.ndarray) -> np.ndarray:
        """The source pixel under each pixel's centre, (H, W)."""
        rows, columns = self._centres()
        return self._kept(image)[np.ix_(rows, columns)]

    def depth(self, steps: np.ndarray) -> np.ndarray:
        """The nearest source pixel with a depth > 0, no farther than one working pixel away, else 0, (H, W)."""
        kept = self._kept(steps)
        away, nearest = distance_transform_edt(kept == 0, return_indices=True)
        filled = np.where(away <= self.width / self.to_width, kept[tuple(nearest)], 0)
        rows, columns = self._centres()
        return filled[np.ix_(rows, columns)]

    def pixel(self, x: float, y: float) -> tuple[float, float]:
        """Where a source pixel comes to lie [px]."""
        across, down = self.to_width / self.width, self.to_height / self.height
        return (x - self.left + 0.5) * across - 0.5, (y - self.top + 0.5) * down - 0.5

    def _kept(self, image: np.ndarray) -> np.ndarray:
        return image[self.top : self.top + self.height, self.left : self.left + self.width]

    def _centres(self) -> tuple[np.ndarray, np.ndarray]:
        rows = (np.arange(self.to_height) + 0.5) * self.height / self.to_height
        columns = (np.arange(self.to_width) + 0.5) * self.width / self.to_width
        return rows.astype(int), columns.astype(int)


def window(crop: tuple[int, int, int, int], *, size: int) -> Window:
    """`crop` (left, top, width, height) brought to a longest side of `size`, never enlarged [px]."""
    left, top, width, height = crop
    scale = min(1.0, size / max(width, height))
    return Window(left, top, width, height, max(round(width * scale), 1), max(round(height * scale), 1))
