"""The endoscope: a pinhole at the origin, and a z-buffer for triangles seen through it."""

from dataclasses import dataclass

import numpy as np
from numba import njit


@dataclass(frozen=True)
class View:
    """x right, y down, z forward; the centre of the top left pixel is (0, 0)."""

    width: int
    height: int
    focal: float
    """[px]."""

    @property
    def center(self) -> tuple[float, float]:
        """Principal point [px]."""
        return (self.width - 1) / 2, (self.height - 1) / 2

    def project(self, points: np.ndarray) -> np.ndarray:
        """Points [m], (..., 3), to pixels, (..., 2)."""
        return points[..., :2] / points[..., 2:] * self.focal + np.array(self.center)

    def rays(self, pixels: np.ndarray) -> np.ndarray:
        """Points at z = 1 m on the rays through pixels, (..., 2) to (..., 3)."""
        flat = (pixels - np.array(self.center)) / self.focal
        return np.concatenate([flat, np.ones((*flat.shape[:-1], 1))], -1)

    def grid(self, samples: int) -> np.ndarray:
        """Pixel coordinates of samples x samples evenly spaced rays per pixel, (H s, W s, 2)."""
        x = (np.arange(self.width * samples) + 0.5) / samples - 0.5
        y = (np.arange(self.height * samples) + 0.5) / samples - 0.5
        return np.stack(np.meshgrid(x, y), -1)


@dataclass(frozen=True)
class Hits:
    """What each ray of a grid meets first."""

    z: np.ndarray
    """Depth [m], inf where nothing, (H, W)."""
    triangle: np.ndarray
    """Its number, -1 where nothing, (H, W)."""
    weights: np.ndarray
    """Barycentric, of the triangle's three corners, (H, W, 3)."""


def look(view: View, points: np.ndarray, triangles: np.ndarray, samples: int) -> Hits:
    """Nearest triangle on every ray; points [m], (N, 3); triangles (F, 3); both sides are seen."""
    at = (view.project(points) + 0.5) * samples - 0.5
    size = view.height * samples, view.width * samples
    nearest, triangle = np.zeros(size), np.full(size, -1, np.int64)
    weights = np.zeros((*size, 3))
    _scan(at, 1.0 / points[:, 2], triangles, nearest, triangle, weights)
    with np.errstate(divide="ignore"):
        return Hits(1.0 / nearest, triangle, weights)


@njit(cache=True)
def _scan(at, inverse, triangles, nearest, triangle, weights):
    """`nearest` holds 1 / z, which is linear on the screen; 0 where nothing was met."""
    height, width = nearest.shape
    for f in range(len(triangles)):
        a, b, c = triangles[f]
        x0, y0, x1, y1, x2, y2 = at[a, 0], at[a, 1], at[b, 0], at[b, 1], at[c, 0], at[c, 1]
        area = (x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)
        if area == 0.0:
            continue
        left = max(int(np.ceil(min(x0, x1, x2))), 0)
        right = min(int(np.floor(max(x0, x1, x2))), width - 1)
        top = max(int(np.ceil(min(y0, y1, y2))), 0)
        low = min(int(np.floor(max(y0, y1, y2))), height - 1)
        for y in range(top, low + 1):
            for x in range(left, right + 1):
                p = ((x1 - x) * (y2 - y) - (x2 - x) * (y1 - y)) / area
                q = ((x2 - x) * (y0 - y) - (x0 - x) * (y2 - y)) / area
                r = 1.0 - p - q
                if p < 0.0 or q < 0.0 or r < 0.0:
                    continue
                near = p * inverse[a] + q * inverse[b] + r * inverse[c]
                if near > nearest[y, x]:
                    nearest[y, x] = near
                    triangle[y, x] = f
                    weights[y, x, 0] = p * inverse[a] / near
                    weights[y, x, 1] = q * inverse[b] / near
                    weights[y, x, 2] = r * inverse[c] / near
