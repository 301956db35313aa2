"""A textured sheet under a lamp on the camera, pulled by a bar: every answer known in closed form."""

from dataclasses import dataclass

import cv2
import numpy as np

from surgisim.artifacts.camera import Camera


@dataclass(frozen=True)
class PulledSheet:
    camera: Camera
    rgb: np.ndarray
    tool: np.ndarray
    position: np.ndarray
    """Where each pixel of frame 0 is in the image [px], (T, H, W, 2)."""
    xyz: np.ndarray
    """And in space [m], (T, H, W, 3)."""
    depth: np.ndarray
    """[m], (T, H, W)."""
    grip: np.ndarray
    """Centre of the grip [m], (T, 3)."""
    radius: float
    active: np.ndarray
    """(T,) bool."""


def camera(width: int, height: int, frames: int) -> Camera:
    return Camera(
        width=width,
        height=height,
        fx=1.1 * width,
        fy=1.1 * width,
        cx=(width - 1) / 2,
        cy=(height - 1) / 2,
        fps=25.0,
        frames=frames,
        scale="arbitrary",
        focal_from="given",
        source="sheet",
        source_size=[width, height],
        crop=[0, 0, width, height],
    )


def pull_sheet(
    *,
    frames: int = 20,
    begin: int = 6,
    release: int = 15,
    pull: tuple[float, float, float] = (0.006, -0.004, -0.004),
    size: tuple[int, int] = (128, 96),
    seed: int = 0,
) -> PulledSheet:
    """A sheet 70 mm away; a grip of 4 mm radius is carried by `pull` [m] and let go before frame `release`."""
    width, height = size
    cam, radius = camera(width, height, frames), 0.004
    grid = np.stack(np.meshgrid(np.arange(width), np.arange(height)), -1).astype(float)
    rest = cam.lift(grid, 0.07 + 0.01 * (grid[..., 1] / height - 0.5))
    center = rest[int(0.55 * height), int(0.5 * width)]
    away = np.maximum(np.linalg.norm(rest - center, axis=-1) - radius, 0)
    falloff = np.exp(-((away / 0.009) ** 2))
    time = np.arange(frames)
    course = np.clip((time - begin) / max(release - begin - 3, 1), 0, 1)
    gone = np.maximum(time - release + 1.0, 0.0)
    amount = np.where(time < release, course, course[min(release, frames) - 1] * np.exp(-gone))
    active = (time >= begin) & (time < release)
    xyz = rest + amount[:, None, None, None] * falloff[..., None] * np.array(pull)
    grip = center + course[:, None] * np.array(pull)
    grip[release:] += (time[release:] - release + 1)[:, None] * np.array([0.006, 0.002, -0.001])
    approach = np.maximum(begin - 1 - time, 0)[:, None] * np.array([0.004, 0.002, 0.0])
    position = cam.project(xyz).astype(np.float32)
    albedo = _texture(height, width, np.random.default_rng(seed))
    shown, tool, depth = [], [], []
    for t in range(frames):
        back = _inverse(position[t], grid)
        light = _sample(_shade(xyz[t]), back)
        image = _sample(albedo, back) * light[..., None]
        mask = _bar(cam.project(grip[t] + approach[t]), width, height)
        image = np.where(mask[..., None], 0.25 * _stripes(cam.project(grip[t] + approach[t]), grid)[..., None], image)
        shown.append(np.rint(255 * np.clip(_encode(image), 0, 1)).astype(np.uint8))
        tool.append(mask)
        depth.append(_sample(np.ascontiguousarray(xyz[t, ..., 2]), back))
    return PulledSheet(cam, np.stack(shown), np.stack(tool), position, xyz, np.stack(depth), grip, radius, active)


def _texture(height: int, width: int, rng: np.random.Generator) -> np.ndarray:
    grain = sum(s * cv2.GaussianBlur(rng.standard_normal((height, width)), (0, 0), s) for s in (1.2, 3.0, 6.0))
    level = np.clip(0.5 + 0.25 * grain, 0.1, 1.0)
    return np.stack([0.9 * level**0.6, 0.5 * level**1.3, 0.4 * level**1.3], -1)


def _shade(xyz: np.ndarray) -> np.ndarray:
    normal = np.cross(np.gradient(xyz, axis=1), np.gradient(xyz, axis=0))
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    away = np.linalg.norm(xyz, axis=-1)
    return 0.6 * np.abs((normal * xyz).sum(-1)) / away * (0.07 / away) ** 2


def _inverse(position: np.ndarray, grid: np.ndarray) -> np.ndarray:
    back = grid.copy()
    for _ in range(60):
        back = back - (_sample(position, back) - grid)
    return back


def _sample(image: np.ndarray, at: np.ndarray) -> np.ndarray:
    x, y = at[..., 0].astype(np.float32), at[..., 1].astype(np.float32)
    return cv2.remap(image.astype(np.float32), x, y, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REFLECT)


def _bar(tip: np.ndarray, width: int, height: int) -> np.ndarray:
    mask = np.zeros((height, width), np.uint8)
    tail = tip + np.array([0.9, 0.35]) * width
    cv2.line(mask, np.rint(tip).astype(int).tolist(), np.rint(tail).astype(int).tolist(), 1, max(width // 14, 3))
    return mask > 0


def _stripes(tip: np.ndarray, grid: np.ndarray) -> np.ndarray:
    along = (grid - tip) @ np.array([0.93, 0.36])
    return 0.8 + 0.5 * np.sin(along / 2.5) + 0.3 * np.sin(along / 5.3)


def _encode(linear: np.ndarray) -> np.ndarray:
    linear = np.clip(linear, 0, 1)
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
