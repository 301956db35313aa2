"""Normals of the seen surface at rest, and how a deformation turns them."""

import cv2
import numpy as np
from scipy import ndimage

from surgisim.artifacts.camera import Camera


def rest_normals(z: np.ndarray, camera: Camera, spacing: float) -> np.ndarray:
    """Unit normals toward the camera, (H, W, 3), of a height map z [m], (H, W), smoothed over `spacing` [m].

    A simulation turns nothing finer than its grid, so finer relief at rest belongs to the colour.
    """
    width = spacing * camera.fx / float(np.median(z))
    smooth = cv2.GaussianBlur(z.astype(np.float64), (0, 0), max(width, 0.5), borderType=cv2.BORDER_REPLICATE)
    y, x = np.mgrid[: z.shape[0], : z.shape[1]].astype(float)
    points = camera.lift(np.stack([x, y], -1), smooth)
    normal = np.cross(np.gradient(points, axis=0), np.gradient(points, axis=1))
    return normal / np.linalg.norm(normal, axis=-1, keepdims=True)


def at_pixels(field: np.ndarray, pixels: np.ndarray) -> np.ndarray:
    """A field (H, W, C) between pixels [px], (Q, 2), edge values repeated, (Q, C)."""
    where = pixels[:, ::-1].T
    return np.stack(
        [ndimage.map_coordinates(field[..., c], where, order=1, mode="nearest") for c in range(field.shape[-1])], -1
    )


def turned(F: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Normals (Q, 3) of material surfaces after a deformation gradient F (Q, 3, 3); not of unit length.

    n da = cof(F) N dA (Nanson's formula); the columns of cof(F) are cross products of those of F.
    """
    a, b, c = F[..., 0], F[..., 1], F[..., 2]
    n = normals[..., None, :]
    return n[..., 0] * np.cross(b, c) + n[..., 1] * np.cross(c, a) + n[..., 2] * np.cross(a, b)
