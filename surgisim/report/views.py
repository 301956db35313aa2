"""Particles seen from where no camera was: painted balls, the nearest in front."""

from dataclasses import dataclass

import numpy as np
from numba import njit


@dataclass(frozen=True)
class View:
    """An orthographic look along `right` x `down`."""

    right: np.ndarray
    """Unit vector that points right in the picture, camera frame, (3,)."""
    down: np.ndarray
    """Unit vector that points down, (3,)."""
    low: np.ndarray
    """Left and top edge along them [m], (2,)."""
    high: np.ndarray
    """Right and bottom edge [m], (2,)."""
    width: int
    """[px]"""
    height: int
    """[px]"""

    @property
    def zoom(self) -> float:
        """[px/m]"""
        return self.width / float(self.high[0] - self.low[0])

    def place(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Pixels (..., 2) and distance along the look [m], (...), of points (..., 3)."""
        flat = np.stack([points @ self.right, points @ self.down], -1)
        return (flat - self.low) * self.zoom, points @ np.cross(self.right, self.down)


def look(points: np.ndarray, yaw: float, pitch: float, size: tuple[int, int], margin: float = 0.05) -> View:
    """A view of `size`, width and height [px], that holds all points (..., 3), turned by yaw and pitch [degrees].

    Yaw 90 looks at the body's flank: the camera is on the left, away from it is right.
    """
    a, b = np.radians([yaw, pitch])
    right = np.array([np.cos(a), 0, np.sin(a)])
    forward = np.array([-np.sin(a) * np.cos(b), np.sin(b), np.cos(a) * np.cos(b)])
    down = np.cross(forward, right)
    flat = np.stack([points @ right, points @ down], -1).reshape(-1, 2)
    low, high = flat.min(0), flat.max(0)
    pixel = (1 + 2 * margin) * float(((high - low) / size).max())
    middle, half = (low + high) / 2, pixel * np.array(size) / 2
    return View(right, down, middle - half, middle + half, *size)


def balls(points: np.ndarray, color: np.ndarray, radius: float, view: View) -> np.ndarray:
    """Picture (H, W, 3) uint8 on white of balls of one radius [m]: points (Q, 3), colour (Q, 3) 0-255."""
    pixels, far = view.place(np.asarray(points, float))
    picture = np.full((view.height, view.width, 3), 255, np.uint8)
    nearest = np.full(picture.shape[:2], np.inf)
    _paint(picture, nearest, pixels, far, np.asarray(color, float), radius, max(radius * view.zoom, 0.75))
    return picture


@njit(cache=True, nogil=True)
def _paint(picture, nearest, pixels, far, color, radius, size):
    """Every pixel keeps the ball whose skin is nearest; a ball is darker towards its rim."""
    height, width = nearest.shape
    for q in range(len(pixels)):
        x, y = pixels[q]
        for row in range(max(int(np.ceil(y - size)), 0), min(int(np.floor(y + size)), height - 1) + 1):
            for column in range(max(int(np.ceil(x - size)), 0), min(int(np.floor(x + size)), width - 1) + 1):
                off = ((column - x) ** 2 + (row - y) ** 2) / size**2
                if off > 1:
                    continue
                rise = np.sqrt(1 - off)
                skin = far[q] - radius * rise
                if skin < nearest[row, column]:
                    nearest[row, column] = skin
                    for c in range(3):
                        picture[row, column, c] = np.uint8(min(max(color[q, c] * (0.55 + 0.45 * rise), 0.0), 255.0))
