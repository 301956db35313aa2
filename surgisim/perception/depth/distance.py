"""Depth of the tissue by the backend that the settings or the recording ask for."""

from collections.abc import Callable

import numpy as np

from surgisim.artifacts.camera import Camera
from surgisim.artifacts.correspondence import Correspondence
from surgisim.artifacts.depth import Depth
from surgisim.artifacts.frames import Frames
from surgisim.artifacts.given import Given
from surgisim.artifacts.inpainted import SEEN, Inpainted
from surgisim.artifacts.masks import Masks
from surgisim.config import depth as config
from surgisim.perception.depth import depth_anything, given, near_light, stereo
from surgisim.perception.grasp.contact import frame_flow
from surgisim.perception.grasp.instruments import Instrument, instruments
from surgisim.perception.grasp.outline import outlines
from surgisim.perception.masking.appearance import lit
from surgisim.problem import Problem

FLAT = 0.1
"""Confidence where depth was only filled in from around."""


def depth(
    frames: Frames,
    inpainted: Inpainted,
    masks: Masks,
    surface: Correspondence,
    given_: Given,
    camera: Camera,
    settings: config.Depth,
    *,
    progress: Callable[[float, float, str], None] | None = None,
) -> Depth:
    """z of the tissue in every pixel, behind the instrument too."""
    rgb = inpainted.rgb
    shapes = {"frames": frames.rgb.shape[:3], "masks": masks.tool.shape, "inpainted": rgb.shape[:3]}
    shapes |= {"correspondence": surface.hidden.shape}
    if len(set(shapes.values())) > 1:
        raise Problem(f"depth: {shapes} are not of one clip (frames, height, width). Check which are passed.")
    hidden = masks.tool | (inpainted.origin != SEEN)
    name = choose(settings.backend, given_)
    if name == "given":
        z, confidence, scale = given.estimate(given_, hidden, camera, rgb, distance=settings.distance)
    elif name == "depth_anything":
        z, confidence, scale = depth_anything.estimate(
            rgb, hidden, settings.weights, distance=settings.distance, range_=settings.range, progress=progress
        )
    else:
        z, confidence = near_light.estimate(
            rgb,
            hidden,
            masks.specular,
            camera,
            surface,
            distance=settings.distance,
            relief=settings.relief,
            size=settings.lattice,
            tools=outlines(frames.rgb, _tools(frames.rgb, masks.tool), camera),
            progress=progress,
        )
        scale = "arbitrary"
        if name == "stereo":
            # The right view shows the instrument too.
            z, confidence, scale = stereo.estimate(
                frames.rgb, hidden, given_, camera, (z, confidence), distance=settings.distance
            )
    follows = name != "near_light"
    confidence = np.where(inpainted.origin == SEEN, confidence, np.minimum(confidence, FLAT))
    return Depth(z.astype(np.float32), confidence.astype(np.float32), scale, follows)


def _tools(rgb: np.ndarray, tool: np.ndarray) -> list[Instrument]:
    return instruments(tool, lit(rgb)[0], frame_flow(rgb)) if tool.any() and len(rgb) > 1 else []


def choose(wanted: str, given_: Given) -> str:
    """The backend behind `auto`."""
    if wanted == "given" and not len(given_.depth):
        raise Problem(
            "depth: backend 'given' needs depth that came with the recording, and there is none. "
            "Set depth.backend to 'auto' or 'near_light'."
        )
    if wanted == "stereo" and not len(given_.right):
        raise Problem(
            "depth: backend 'stereo' needs a right view, and the recording has none. "
            "Set depth.backend to 'auto' or 'near_light'."
        )
    if wanted != "auto":
        return wanted
    if len(given_.depth):
        return "given"
    return "stereo" if len(given_.right) else "near_light"
