"""Grips that the user points at."""

import numpy as np

from surgisim.artifacts.camera import Camera
from surgisim.config.tracking import Grasp
from surgisim.perception.grasp.find import Grip
from surgisim.problem import Problem


def given(wanted: tuple[Grasp, ...], camera: Camera, tissue: np.ndarray) -> list[Grip]:
    """The user's grips in working pixels and frames; `tissue` is frame 0's, the instrument's share included (H, W)."""
    return [_grip(grasp, camera, tissue, f"tracking: grasp {i + 1}") for i, grasp in enumerate(wanted)]


def _grip(grasp: Grasp, camera: Camera, tissue: np.ndarray, where: str) -> Grip:
    left, top, width, height = camera.crop
    center = camera.from_recording(grasp.pixel)
    x, y = np.rint(center).astype(int)
    if not (0 <= x < camera.width and 0 <= y < camera.height):
        raise Problem(
            f"{where}: pixel {grasp.pixel} is outside the picture, which spans x {left} to {left + width - 1} and "
            f"y {top} to {top + height - 1} of the recording. Give a point on the tissue."
        )
    if not tissue[y, x]:
        raise Problem(f"{where}: pixel {grasp.pixel} is not on the tissue in frame 0. Give a point on the tissue.")
    last = (camera.frames - 1) / camera.fps
    end = last if grasp.end is None else grasp.end
    begin, stop = round(grasp.start * camera.fps), round(end * camera.fps)
    if not 0 <= begin < stop or begin >= camera.frames - 1:
        raise Problem(
            f"{where}: it lasts from {grasp.start} to {end:.2f} s, and the recording from 0 to {last:.2f} s. "
            "Give a start before the end, within the recording."
        )
    return Grip(
        center,
        float(grasp.radius * np.mean([camera.width / width, camera.height / height])),
        begin,
        min(stop, camera.frames - 1),
        1.0,
    )
