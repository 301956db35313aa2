"""Small invented recordings: a textured red sheet, and a grey bar that enters from the left and moves."""

import io
import zipfile
from pathlib import Path

import av
import cv2
import numpy as np
from PIL import Image
from scipy.ndimage import gaussian_filter

H, W = 64, 80


def tissue(seed: int = 0, size=(H, W), colour=(190, 90, 80)) -> np.ndarray:
    """A sheet of tissue, sRGB, (H, W, 3) uint8."""
    rng = np.random.default_rng(seed)
    relief = gaussian_filter(rng.standard_normal(size), 2.0)
    shade = 1 + 0.25 * relief / np.abs(relief).max() + 0.02 * rng.standard_normal(size)
    return np.clip(shade[..., None] * np.array(colour), 0, 255).astype(np.uint8)


def operated(count=12, size=(H, W), colour=(190, 90, 80), metal=(150, 152, 156), shift=1.5):
    """Frames of tissue drifting right with an instrument passing over it, and where the instrument is."""
    height, width = size
    sheet = tissue(1, (height, width + 60), colour)
    frames, tools = [], []
    for t in range(count):
        frame = sheet[:, 30 - t // 4 : 30 - t // 4 + width].copy()
        shape = np.zeros(size, np.uint8)
        row = int(height * 0.3 + shift * t)
        cv2.line(shape, (-5, row + 8), (int(width * 0.6), row), 1, thickness=max(height // 8, 5))
        lit = np.clip(0.9 + 0.2 * np.random.default_rng(t).standard_normal(size) * 0.05, 0, 2)
        frame[shape > 0] = np.clip(lit[..., None] * np.array(metal), 0, 255).astype(np.uint8)[shape > 0]
        frames.append(frame)
        tools.append(shape > 0)
    return np.stack(frames), np.stack(tools)


def video(path: Path, frames: np.ndarray, fps: int = 25, codec: str = "mpeg4") -> Path:
    with av.open(str(path), "w") as container:
        stream = container.add_stream(codec, rate=fps)
        stream.height, stream.width = frames.shape[1:3]
        stream.pix_fmt = "yuv420p"
        stream.bit_rate = 4_000_000
        for frame in frames:
            container.mux(stream.encode(av.VideoFrame.from_ndarray(frame, format="rgb24")))
        container.mux(stream.encode())
    return path


def png(image: np.ndarray) -> bytes:
    stream = io.BytesIO()
    Image.fromarray(image).save(stream, "PNG")
    return stream.getvalue()


def pictures(folder: Path, frames: np.ndarray, suffix: str = "") -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    for t, frame in enumerate(frames):
        (folder / f"frame{t}{suffix}.png").write_bytes(png(frame))
    return folder


def endonerf(folder: Path, count: int = 9) -> tuple[Path, np.ndarray, np.ndarray]:
    """An EndoNeRF folder with tool masks and depth of 40-60 mm; returns it with its frames and tool."""
    frames, tool = operated(count)
    pictures(folder / "images", frames)
    pictures(folder / "images_right", frames[:, :, ::-1].copy())
    pictures(folder / "masks", np.ones_like(tool).astype(np.uint8) * 255)
    pictures(folder / "gt_masks", tool.astype(np.uint8) * 255)
    depth = np.linspace(40, 60, H)[:, None].repeat(W, 1).astype(np.uint8)
    depth[5:7, 5:7] = 0
    pictures(folder / "depth", np.stack([depth] * count))
    pose = np.hstack([np.eye(3), np.zeros((3, 1)), np.array([[H], [W], [75.0]])]).ravel()
    np.save(folder / "poses_bounds.npy", np.tile(np.r_[pose, 0.0, 100.0], (count, 1)))
    return folder, frames, tool


def zipped(path: Path, files: dict[str, bytes]) -> Path:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    return path


def silent(done: float, total: float, text: str = "") -> None:
    """A progress nobody listens to."""
