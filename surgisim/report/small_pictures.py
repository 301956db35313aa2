"""Pictures for a README or a gallery: small files that stand alone."""

import dataclasses
import io

import cv2
import numpy as np
from PIL import Image

from surgisim.artifacts.body import Body
from surgisim.artifacts.camera import Camera
from surgisim.artifacts.frames import Frames
from surgisim.artifacts.material import Material
from surgisim.artifacts.motion import Motion
from surgisim.artifacts.replay import Replay
from surgisim.artifacts.scene import Scene
from surgisim.problem import Problem
from surgisim.report.palette import MOVED, mapped
from surgisim.report.scenery import colors, section, turned
from surgisim.report.views import look, surface
from surgisim.skin import skin

WIDTH = 320
"""Of one panel [px]."""
QUALITIES = (85, 70, 50, 30)
"""Of JPEG and WebP, the best first."""
YAWS = (0.0, 35.0)
"""From where the scene is seen [degrees]."""


def moving(frames: Frames, replay: Replay, camera: Camera, most: int) -> bytes:
    """Animated WebP of at most `most` bytes: the recording, and to its right the replay, at the recording's speed.

    Every second or third frame where all would take more.
    """
    if replay.rgb.shape != frames.rgb.shape:
        raise Problem(
            f"pictures: the replay has pictures of shape {replay.rgb.shape}, and the recording's "
            f"{frames.rgb.shape} is wanted. Run with simulation.render on and no other operation."
        )
    panels = [[_sized(one) for one in film] for film in (frames.rgb, replay.rgb)]
    pictures = [Image.fromarray(np.hstack(pair)) for pair in zip(*panels, strict=True)]

    def packed(quality: int, every: int) -> bytes:
        stream = io.BytesIO()
        first, *others = pictures[::every]
        pause = round(1000 * every / camera.fps)
        more = {"save_all": True, "append_images": others, "duration": pause, "loop": 0}
        first.save(stream, "WEBP", quality=quality, method=4, **more)
        return stream.getvalue()

    return _within(packed, most, [(quality, every) for every in (1, 2, 3) for quality in QUALITIES])


def still(scene: Scene, camera: Camera, most: int) -> bytes:
    """JPEG of at most `most` bytes: the canonical scene from the camera, and from its side."""
    zoom = WIDTH / camera.width
    fine = dataclasses.replace(
        camera, width=WIDTH, height=round(camera.height * zoom), fx=camera.fx * zoom, fy=camera.fy * zoom,
        cx=(camera.cx + 0.5) * zoom - 0.5, cy=(camera.cy + 0.5) * zoom - 0.5,
    )  # fmt: skip
    return _jpeg([turned(scene, fine, yaw, 0.0) for yaw in YAWS], most)


def fitted(body: Body, material: Material, motion: Motion, replay: Replay, most: int) -> bytes:
    """JPEG of at most `most` bytes: the body obliquely, held tissue pink, and its replay cut open at the grip where it
    has moved farthest, blue to yellow by how far."""
    rest, position = body.rest.astype(float), replay.position.astype(float)
    moved = np.linalg.norm(position - rest, axis=-1)
    farthest = int(moved.max(1).argmax())
    both, size = np.concatenate([rest, position[farthest]]), (WIDTH, WIDTH * 3 // 4)
    level = mapped(moved[farthest], 0, max(float(moved.max()), 1e-9), MOVED).astype(float)
    cut = skin(body, section(body, motion))
    return _jpeg(
        [
            surface(rest, skin(body), colors(body, material), look(both, 40, 25, size)),
            surface(position[farthest], cut, level, look(both, 90, 0, size)),
        ],
        most,
    )


def _jpeg(panels: list[np.ndarray], most: int) -> bytes:
    picture = Image.fromarray(np.hstack(panels))

    def packed(quality: int) -> bytes:
        stream = io.BytesIO()
        picture.save(stream, "JPEG", quality=quality)
        return stream.getvalue()

    return _within(packed, most, [(quality,) for quality in QUALITIES])


def _within(packed, most: int, ways: list[tuple[int, ...]]) -> bytes:
    """The first of some ways to pack that is small enough."""
    for way in ways:
        content = packed(*way)
        if len(content) <= most:
            return content
    raise Problem(f"pictures: takes {len(content)} bytes at least, and at most {most} are wanted. Pass a shorter clip.")


def _sized(rgb: np.ndarray) -> np.ndarray:
    height = round(WIDTH * rgb.shape[0] / rgb.shape[1])
    return cv2.resize(rgb, (WIDTH, height), interpolation=cv2.INTER_AREA)
