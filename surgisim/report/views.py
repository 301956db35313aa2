"""Particles seen from where no camera was: as balls, or the surface around them; the nearest in front."""

from dataclasses import dataclass

import numpy as np
from numba import njit

from surgisim.skin import normals

DARKEST = 0.4
"""How bright a surface is that is looked along, as a share of one that faces who looks [1]."""


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


def surface(points: np.ndarray, faces: np.ndarray, color: np.ndarray, view: View) -> np.ndarray:
    """Picture (H, W, 3) uint8 on white of triangles (F, 3) between points (Q, 3) in colours (Q, 3) 0-255, lit from
    where it is looked at."""
    points = np.asarray(points, float)
    pixels, far = view.place(points)
    facing = abs(normals(points, faces) @ np.cross(view.right, view.down))
    lit = np.asarray(color, float) * (DARKEST + (1 - DARKEST) * facing[:, None])
    picture = np.full((view.height, view.width, 3), 255, np.uint8)
    _fill(picture, np.full(picture.shape[:2], np.inf), pixels, far, np.clip(lit, 0, 255), faces)
    return picture


@njit(cache=True, nogil=True)
def _fill(picture, nearest, pixels, far, color, faces):
    """Every pixel keeps the nearest triangle that covers it, its corners' colours mixed by how near they are."""
    height, width = nearest.shape
    for f in range(len(faces)):
        a, b, c = faces[f]
        ax, ay = pixels[a]
        bx, by = pixels[b]
        cx, cy = pixels[c]
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        if area == 0:
            continue
        top, bottom = max(int(np.ceil(min(ay, by, cy))), 0), min(int(np.floor(max(ay, by, cy))), height - 1)
        left, right = max(int(np.ceil(min(ax, bx, cx))), 0), min(int(np.floor(max(ax, bx, cx))), width - 1)
        for row in range(top, bottom + 1):
            for column in range(left, right + 1):
                v = ((column - ax) * (cy - ay) - (row - ay) * (cx - ax)) / area
                w = ((bx - ax) * (row - ay) - (by - ay) * (column - ax)) / area
                u = 1 - v - w
                if u < 0 or v < 0 or w < 0:
                    continue
                skin = u * far[a] + v * far[b] + w * far[c]
                if skin < nearest[row, column]:
                    nearest[row, column] = skin
                    for k in range(3):
                        picture[row, column, k] = np.uint8(u * color[a, k] + v * color[b, k] + w * color[c, k])


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
