"""Pictures for a README: small files that stand alone."""

import dataclasses
import io

import cv2
import numpy as np
from PIL import Image

from surgisim.artifacts.camera import Camera
from surgisim.artifacts.frames import Frames
from surgisim.artifacts.replay import Replay
from surgisim.artifacts.scene import Scene
from surgisim.problem import Problem
from surgisim.report.scenery import turned

WIDTH = 320
"""Of one panel [px]."""
MOVING, STILL = 1_500_000, 300_000
"""Most that a file may take [bytes]."""
YAWS = (0.0, 35.0)
"""From where the scene is seen [degrees]."""


def moving(frames: Frames, replay: Replay, camera: Camera) -> bytes:
    """Animated WebP: the recording, and to its right the replay, at the recording's speed."""
    if replay.rgb.shape != frames.rgb.shape:
        raise Problem(
            f"pictures: the replay has pictures of shape {replay.rgb.shape}, and the recording's "
            f"{frames.rgb.shape} is wanted. Run with simulation.render on and no other operation."
        )
    panels = [[_sized(one) for one in film] for film in (frames.rgb, replay.rgb)]
    pictures = [Image.fromarray(np.hstack(pair)) for pair in zip(*panels, strict=True)]

    def packed(quality: int) -> bytes:
        stream = io.BytesIO()
        pause = round(1000 / camera.fps)
        more = {"save_all": True, "append_images": pictures[1:], "duration": pause, "loop": 0}
        pictures[0].save(stream, "WEBP", quality=quality, method=4, **more)
        return stream.getvalue()

    return _within(packed, MOVING)


def still(scene: Scene, camera: Camera) -> bytes:
    """JPEG: the canonical scene from the camera, and from its side."""
    zoom = WIDTH / camera.width
    fine = dataclasses.replace(
        camera, width=WIDTH, height=round(camera.height * zoom), fx=camera.fx * zoom, fy=camera.fy * zoom,
        cx=(camera.cx + 0.5) * zoom - 0.5, cy=(camera.cy + 0.5) * zoom - 0.5,
    )  # fmt: skip
    picture = Image.fromarray(np.hstack([turned(scene, fine, yaw, 0.0) for yaw in YAWS]))

    def packed(quality: int) -> bytes:
        stream = io.BytesIO()
        picture.save(stream, "JPEG", quality=quality)
        return stream.getvalue()

    return _within(packed, STILL)


def _within(packed, most: int) -> bytes:
    """The best of some qualities that is small enough."""
    sizes = []
    for quality in (85, 70, 50, 30):
        content = packed(quality)
        sizes.append(len(content))
        if len(content) <= most:
            return content
    raise Problem(f"pictures: takes {sizes[-1]} bytes at least, and at most {most} are wanted. Pass a shorter clip.")


def _sized(rgb: np.ndarray) -> np.ndarray:
    height = round(WIDTH * rgb.shape[0] / rgb.shape[1])
    return cv2.resize(rgb, (WIDTH, height), interpolation=cv2.INTER_AREA)
