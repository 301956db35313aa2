"""A replay's files for people: coloured points to turn in a viewer, and one picture column over time."""

import cv2
import numpy as np

from surgisim.artifacts.body import Body
from surgisim.artifacts.camera import Camera
from surgisim.artifacts.motion import Motion
from surgisim.artifacts.ply import write_ply
from surgisim.artifacts.replay import Replay
from surgisim.measure.slices import slice_yt


def final_ply(replay: Replay, body: Body) -> bytes:
    """The last frame's particles with their colours."""
    columns = {name: replay.position[-1][:, k] for k, name in enumerate("xyz")}
    color = np.rint(np.clip(body.color, 0, 1) * 255).astype(np.uint8)
    columns |= {name: color[:, k] for k, name in enumerate(("red", "green", "blue"))}
    return write_ply(columns, {"kind": "Points", "units": {"x": "m"}, "producer": "simulation"})


def yt_png(rgb: np.ndarray, motion: Motion, camera: Camera) -> bytes:
    """The column through the first grip (or the middle one) of every frame (T, H, W, 3), as a PNG."""
    column = camera.width // 2
    if len(motion.radius):
        column = int(np.clip(np.rint(camera.project(motion.center_rest[0])[0]), 0, camera.width - 1))
    picture = slice_yt(rgb, column)
    return cv2.imencode(".png", picture[..., ::-1])[1].tobytes()
