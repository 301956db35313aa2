"""A replay's files for people: coloured points or splats to turn in a viewer, and one picture column over time."""

import cv2
import numpy as np

from surgisim.artifacts.body import Body
from surgisim.artifacts.camera import Camera
from surgisim.artifacts.motion import Motion
from surgisim.artifacts.ply import particles, write_ply
from surgisim.artifacts.replay import Replay
from surgisim.measure.slices import slice_yt


def final_ply(replay: Replay, body: Body) -> bytes:
    """The last frame's particles with their colours."""
    columns = particles(replay.position[-1], body.volume, body.color)
    return write_ply(columns, {"kind": "Points", "units": {"x": "m"}, "producer": "simulation"})


def yt_png(rgb: np.ndarray, motion: Motion, camera: Camera) -> bytes:
    """The column through the first grip (or the middle one) of every frame (T, H, W, 3), as a PNG."""
    column = camera.width // 2
    if len(motion.radius):
        column = int(np.clip(np.rint(camera.project(motion.center_rest[0])[0]), 0, camera.width - 1))
    picture = slice_yt(rgb, column)
    return cv2.imencode(".png", picture[..., ::-1])[1].tobytes()
