"""A replay's files for people: coloured points or splats to turn in a viewer, and one picture column over time."""

import numpy as np

from surgisim.artifacts.body import Body
from surgisim.artifacts.camera import Camera
from surgisim.artifacts.motion import Motion
from surgisim.artifacts.ply import particles, write_ply
from surgisim.artifacts.replay import Replay
from surgisim.measure.slices import slice_yt
from surgisim.report.charts.slices import slices_png


def final_ply(replay: Replay, body: Body) -> bytes:
    """The last frame's particles with their colours."""
    columns = particles(replay.position[-1], body.volume, body.color)
    return write_ply(columns, {"kind": "Points", "units": {"x": "m"}, "producer": "simulation"})


def yt_png(rgb: np.ndarray, recorded: np.ndarray, motion: Motion, camera: Camera) -> bytes:
    """PNG of the column through the first grip (or the middle one) over time: of the recording, and of the replay below
    it; frames (T, H, W, 3), sRGB."""
    column = camera.width // 2
    if len(motion.radius):
        column = int(np.clip(np.rint(camera.project(motion.center_rest[0])[0]), 0, camera.width - 1))
    pictures = {f"recording, x = {column} px": slice_yt(recorded, column), "replay": slice_yt(rgb, column)}
    return slices_png(pictures, camera.fps)
