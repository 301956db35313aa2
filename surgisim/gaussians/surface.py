"""The seen surface as a height map: how far the canonical scene is at every pixel."""

from dataclasses import dataclass

import cv2
import numpy as np
from scipy import ndimage

from surgisim.artifacts.camera import Camera
from surgisim.artifacts.scene import Scene
from surgisim.gaussians.attributes import drawn
from surgisim.gaussians.rasterise import render
from surgisim.problem import Problem


@dataclass(frozen=True)
class Surface:
    z: np.ndarray
    """Depth of the surface at every pixel, filled where nothing was seen [m], (H, W)."""
    color: np.ndarray
    """Colour there, sRGB 0-1, (H, W, 3)."""
    seen: np.ndarray
    """Pixels the scene covers, holes closed, (H, W) bool."""

    def at(self, camera: Camera, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Surface depth [m] (...), colour (..., 3) and whether the pixel is covered (...), along the ray to points."""
        pixel = camera.project(points)
        where = np.moveaxis(pixel[..., ::-1], -1, 0).reshape(2, -1)
        z = ndimage.map_coordinates(self.z, where, order=1, mode="nearest").reshape(points.shape[:-1])
        row = np.clip(np.rint(where[0]), 0, self.z.shape[0] - 1).astype(int)
        column = np.clip(np.rint(where[1]), 0, self.z.shape[1] - 1).astype(int)
        inside = (np.abs(row - where[0]) <= 0.5 + 1e-6) & (np.abs(column - where[1]) <= 0.5 + 1e-6)
        seen = (self.seen[row, column] & inside).reshape(points.shape[:-1])
        return z, self.color[row, column].reshape(points.shape), seen


def surface_of(scene: Scene, camera: Camera, *, least_cover: float = 0.5, smooth: float = 0.03) -> Surface:
    """Height map of the canonical scene as the camera sees it; see `surface_from`."""
    image = render(*drawn(scene), camera)
    cover = np.maximum(image.alpha, np.finfo(np.float32).tiny)
    return surface_from(
        image.depth / cover, image.rgb / cover[..., None], image.alpha, least_cover=least_cover, smooth=smooth
    )


def surface_from(
    z: np.ndarray, color: np.ndarray, cover: np.ndarray, *, least_cover: float = 0.5, smooth: float = 0.03
) -> Surface:
    """Height map of a rendered scene.

    z: depth [m], (H, W), believed where `cover` (H, W, 0-1) reaches `least_cover`; color: (H, W, 3); smooth: width of
    the median filter, share of the longest side. The largest covered piece is kept and its holes (an instrument hid
    what is behind) are filled smoothly from their rims. Raises Problem where nothing is covered.
    """
    believed = cover >= least_cover
    if not believed.any():
        raise Problem("thickening: the canonical scene covers no pixel of the camera. Check scene and camera.")
    side = max(z.shape)
    # Pinholes between Gaussians are not holes of the tissue.
    closed = ndimage.binary_closing(np.pad(believed, 4), iterations=2)[4:-4, 4:-4] | believed
    labels, count = ndimage.label(closed)
    largest = np.argmax(ndimage.sum_labels(closed, labels, np.arange(1, count + 1))) + 1
    seen = ndimage.binary_fill_holes(labels == largest)
    believed &= seen
    width = int(round(smooth * side)) // 2 * 2 + 1
    flat = _filled(z, believed)
    if width > 1:
        flat = ndimage.median_filter(flat, width, mode="nearest")
        # The median leaves terraces; a little blur takes them away without moving the surface.
        flat = cv2.GaussianBlur(flat, (0, 0), width / 4, borderType=cv2.BORDER_REPLICATE)
    return Surface(flat, np.stack([_filled(color[..., c], believed) for c in range(3)], -1), seen)


def _filled(values: np.ndarray, believed: np.ndarray) -> np.ndarray:
    """Values where believed; elsewhere a smooth sheet from the rim, coarse to fine."""
    if min(values.shape) <= 2 or believed.all():
        known = values[believed]
        return np.where(believed, values, known.mean() if len(known) else 0.0).astype(np.float64)
    h, w = values.shape
    size = ((w + 1) // 2, (h + 1) // 2)
    weight = cv2.resize(believed.astype(np.float64), size, interpolation=cv2.INTER_AREA)
    total = cv2.resize(np.where(believed, values, 0.0).astype(np.float64), size, interpolation=cv2.INTER_AREA)
    some = weight > 1e-6
    coarse = _filled(np.where(some, total / np.where(some, weight, 1.0), 0.0), some)
    sheet = cv2.resize(coarse, (w, h), interpolation=cv2.INTER_LINEAR)
    return np.where(believed, values, sheet)
