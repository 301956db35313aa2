"""Brightness of a Lambertian surface under a lamp at the camera.

A surface of albedo rho at distance d whose normal makes the angle theta with the way to the lamp shows

    I = rho (a + (1 - a) max(cos theta, 0)) / d^2

a is the ambient share: light that comes back from the walls of the cavity, which falls with the distance as the lamp's
does but not with the angle. What is turned away from the lamp gets that share only. It is the model by which
`perception.depth.near_light` reads depth from brightness (there a = 0).
"""

import numpy as np

MATTE = 0.7
"""How far the brightness of tissue follows the angle, against a wholly matte surface without other light: what is
expected where it is not fitted. Tried against .85 on twelve clips of family 8086 in depth's change: 56 % off for 61."""


def facing(points: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Cosine of the angle between normals (..., 3) and the way from points [m], (..., 3), to the camera; (...)."""
    length = np.linalg.norm(points, axis=-1) * np.linalg.norm(normals, axis=-1)
    return -(points * normals).sum(-1) / length


def log_brightness(points: np.ndarray, normals: np.ndarray, ambient: float = 0.0) -> np.ndarray:
    """Natural logarithm of linear light over albedo, (...), of surface points.

    points: camera frame [m], (..., 3); normals: any length, out of the tissue, (..., 3). ambient: 0-1; at 0 a surface
    turned away is black (-inf).
    """
    lit = ambient + (1 - ambient) * np.maximum(facing(points, normals), 0.0)
    with np.errstate(divide="ignore"):
        return np.log(lit) - np.log((points**2).sum(-1))


def log_brightness_change(
    rest: np.ndarray,
    rest_normals: np.ndarray,
    moved: np.ndarray,
    moved_normals: np.ndarray,
    ambient: float = 0.0,
) -> np.ndarray:
    """How many natural logarithms brighter surface points are once moved, (...); the albedo cancels.

    rest, moved: positions, camera frame [m], (..., 3); rest_normals, moved_normals: out of the tissue, any length,
    (..., 3). Exactly 0 where nothing moved.
    """
    return log_brightness(moved, moved_normals, ambient) - log_brightness(rest, rest_normals, ambient)


def to_linear(srgb: np.ndarray) -> np.ndarray:
    """sRGB 0-1 as linear light 0-1 (IEC 61966-2-1)."""
    return np.where(srgb <= 0.04045, srgb / 12.92, ((np.maximum(srgb, 0.0) + 0.055) / 1.055) ** 2.4)


def linear_light(rgb: np.ndarray) -> np.ndarray:
    """sRGB uint8 of any shape as linear light, 0-1, float32."""
    level = np.arange(256, dtype=np.float32) / 255
    return to_linear(level).astype(np.float32)[rgb]


def to_srgb(light: np.ndarray) -> np.ndarray:
    """Linear light >= 0 as sRGB; above 1 it goes on by the same formula."""
    return np.where(light <= 0.0031308, 12.92 * light, 1.055 * np.maximum(light, 0.0) ** (1 / 2.4) - 0.055)
