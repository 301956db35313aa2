"""What to tell whoever waits: which instrument holds tissue, what was seen where that is unsure, and how to mark it."""

import numpy as np

from surgisim.artifacts.camera import Camera
from surgisim.perception.grasp.find import Grip
from surgisim.perception.grasp.instruments import Instrument

EXAMPLE_RADIUS = 0.03
"""Radius offered where none was measured, as a share of the longer image side."""


def whose(tools: list[Instrument], grip: Grip) -> str:
    """ " by the instrument from the left", say; empty if that is not known."""
    return f" by {_named(tools[grip.instrument])}" if grip.instrument >= 0 else ""


def advice(seen: list[Grip], tools: list[Instrument], camera: Camera) -> str:
    """What the likeliest grip looks like, and the option that gives it, in pixels of the recording and seconds."""
    if not tools:
        return (
            "no instrument is masked, so none can hold tissue; mark one with --clicks, or a grasp with "
            "--grasp X,Y,R,START,END (pixels of the recording's first frame, seconds)."
        )
    if not seen:
        names = ", ".join(_named(t) for t in tools)
        return (
            f"no tissue goes along with {names}. If one holds tissue, mark what it holds: --grasp "
            f"{_option(_guess(tools[0]), camera)} (pixels of the recording's first frame, seconds; these "
            "are only where an instrument's tip is)."
        )
    best = seen[0]
    return (
        f"not sure: tissue moves {_recorded(best.way, camera):.1f} px with {_named(tools[best.instrument])} from "
        f"{best.begin / camera.fps:.2f} to {best.end / camera.fps:.2f} s (confidence {best.confidence:.2f}). If that "
        f"is a grasp, say so, with numbers corrected by looking: --grasp {_option(best, camera)} (x, y and radius in "
        "pixels of the recording's first frame, start and end in seconds)."
    )


def _guess(tool: Instrument) -> Grip:
    frame = int(np.flatnonzero(np.isfinite(tool.tip[:, 0]))[0])
    side = max(tool.mask.shape[1:])
    return Grip(tool.tip[frame], EXAMPLE_RADIUS * side, frame, len(tool.tip) - 1, 0.0)


def _named(tool: Instrument) -> str:
    """An instrument by the side of the picture it comes from."""
    height, width = tool.mask.shape[1:]
    x, y = np.nanmedian(tool.entry, axis=0)
    side = np.argmin([x, width - 1 - x, y, height - 1 - y])
    return f"the instrument from {('the left', 'the right', 'above', 'below')[side]}"


def _recorded(length: float, camera: Camera) -> float:
    """A length of the working size in pixels of the recording."""
    return length * camera.crop[2] / camera.width


def _option(grip: Grip, camera: Camera) -> str:
    left, top, width, height = camera.crop
    scale = np.array([width / camera.width, height / camera.height])
    x, y = (grip.center + 0.5) * scale - 0.5 + [left, top]
    end = max(grip.end, grip.begin + 1) / camera.fps
    return f"{x:.0f},{y:.0f},{_recorded(grip.radius, camera):.0f},{grip.begin / camera.fps:.2f},{end:.2f}"
