"""How far a replay's pictures are from the recording's, where the tissue moves and over the whole frame."""

from typing import Any

import numpy as np

from surgisim.artifacts.frames import USED
from surgisim.measure.groups.pictures import Part
from surgisim.measure.moved import LEAST, MOVED, moved_region
from surgisim.measure.number import number
from surgisim.measure.phases import phases
from surgisim.measure.psnr import psnr
from surgisim.measure.run import Run

REGION = (
    f"tissue pixels whose nearest particle of the simulated surface has moved by at least {MOVED:.0%} of the frame's "
    f"largest displacement; frames in which nothing moves by {LEAST} px left out"
)
WHOLE = "all pixels outside the instrument, highlights and background too; the paper, which does not publish its mask"


def by_grip(run: Run) -> dict[str, Part]:
    """Held-out frames with a grip that has begun to pull, and after it."""
    phase, unseen = phases(run.motion), run.frames.split != USED
    return {
        "driven": (unseen & np.isin(phase, ["load", "hold"]), "held-out frames in which a grip holds"),
        "free": (unseen & (phase == "released"), "held-out frames after the grip lets go"),
    }


def replay_pictures(run: Run) -> dict[str, dict[str, Any]]:
    """PSNR of the moved region, held-out frames while a grip holds and free ones apart, and of whole frames."""
    masks = {
        "moved": (run.masks.tissue & moved_region(run.replay, run.body, run.camera), REGION),
        "whole": (~run.masks.tool, f"{WHOLE}, prints 22.455 (elastic 22.367) over its five EndoNeRF clips"),
    }
    split = run.frames.split
    parts = {
        "used": (split == USED, "used frames but frame 0"),
        **by_grip(run),
        "all": (np.ones(len(split), bool), "all frames but frame 0"),
    }
    numbers = {}
    for region, (mask, words) in masks.items():
        each = np.array([psnr(*t) for t in zip(run.replay.rgb, run.frames.rgb, mask, strict=True)])
        each[0] = np.nan
        for part, (here, when) in parts.items():
            value = each[here & np.isfinite(each)]
            numbers[f"psnr_{region}_{part}"] = number(
                float(value.mean()) if len(value) else None,
                "dB",
                f"mean over {when} of the frame's value; {words}",
                series=each if part == "all" else None,
                why_not=f"there are no such pixels in {when}",
            )
    return numbers
