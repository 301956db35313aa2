"""Masks of a whole clip: what is left out, what is a highlight, what is tissue."""

import importlib
import importlib.util
import pkgutil
from collections.abc import Callable

import cv2
import numpy as np

from surgisim.artifacts.camera import Camera
from surgisim.artifacts.frames import Frames
from surgisim.artifacts.given import Given
from surgisim.artifacts.masks import Masks
from surgisim.config.masking import Masking
from surgisim.perception import masking
from surgisim.perception.masking.appearance import lit, specular
from surgisim.problem import Problem

PARTS = {"appearance", "clicked", "drawing", "outline", "remembering", "settling", "shape"}
"""Files of this room that are no backend."""
Progress = Callable[[float, float, str], None]


def masks(frames: Frames, given: Given, camera: Camera, settings: Masking, *, progress: Progress) -> Masks:
    """Instrument by the chosen backend; tissue is what is lit, at some distance from it."""
    settings = with_working_clicks(settings, camera)
    name = settings.backend
    if name == "auto":
        name = "given" if len(given.tool) else automatic(settings)
    tool, confidence = _backend(name)(frames, given, settings, progress)
    _say_what_was_found(tool, confidence, name, settings, progress)
    margin = round(0.006 * max(tool.shape[1:])) if settings.margin is None else settings.margin
    around = np.stack([_wider(m, margin) for m in tool])
    return Masks(tool, lit(frames.rgb) & ~around, specular(frames.rgb, tool), confidence.astype(np.float32))


def automatic(settings: Masking) -> str:
    """What `auto` takes where no masks came with the recording: SAM 2 needs clicks to be the better one."""
    shown = any(click.label == "tool" for click in settings.clicks)
    return "sam2" if shown and settings.encoder and settings.decoder else "colour_motion"


def _backend(name: str) -> Callable:
    files = [m.name for m in pkgutil.iter_modules(masking.__path__)]
    known = [f for f in files if f not in PARTS]
    if name not in known:
        raise Problem(
            f"config key 'masking.backend' is '{name}', and surgisim/perception/masking/ holds {sorted(known)}. "
            "Choose one of them, or auto."
        )
    return importlib.import_module(f"{masking.__name__}.{name}").tool


def with_working_clicks(settings: Masking, camera: Camera) -> Masking:
    """The same with clicks in working pixels. Raises Problem for one outside of the clip."""
    clicks = []
    for click in settings.clicks:
        x, y = camera.from_recording([click.x, click.y])
        if not (click.frame < camera.frames and -0.5 <= x <= camera.width - 0.5 and -0.5 <= y <= camera.height - 0.5):
            left, top, width, height = camera.crop
            raise Problem(
                f"config key 'masking.clicks' marks frame {click.frame} at ({click.x:g}, {click.y:g}), but there are "
                f"{camera.frames} frames, which show x {left} to {left + width - 1} and y {top} to {top + height - 1} "
                "of the recording. Give clicks in the recording's own pixels."
            )
        inside = np.clip([x, y], 0, [camera.width - 1, camera.height - 1])
        clicks.append(click.model_copy(update={"x": float(inside[0]), "y": float(inside[1])}))
    return settings.model_copy(update={"clicks": clicks})


def _say_what_was_found(tool, confidence, name: str, settings: Masking, progress: Progress) -> None:
    count = len(tool)
    if tool.any():
        share = tool.mean((1, 2))
        progress(
            count,
            count,
            f"instrument ({name}) in {int((share > 0).sum())} of {count} frames, {100 * share.mean():.1f} % of the "
            f"picture, confidence {confidence.mean():.2f}",
        )
        return
    words = f"no instrument was found ({name})"
    if settings.require_tool:
        raise Problem(f"{words}, and masking.require_tool asks for one. Mark it with masking.clicks, or pass masks.")
    progress(count, count, f"{words}; every pixel counts as tissue. Mark it with masking.clicks if there is one")


def _wider(mask: np.ndarray, margin: int) -> np.ndarray:
    if margin == 0:
        return mask
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * margin + 1, 2 * margin + 1))
    return cv2.dilate(mask.astype(np.uint8), disc).astype(bool)
