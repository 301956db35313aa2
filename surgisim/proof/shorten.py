"""Recordings that may be fitted only up to some phase: what a clip that ends there could tell."""

import dataclasses
from typing import Literal

import numpy as np

from surgisim.problem import Problem
from surgisim.recordings.recording import Recording

End = Literal["load", "hold"]


def shortened(recording: Recording, end: End) -> Recording:
    """The recording with its fitted frames ended with the first grip's load or hold; what is held out stays.

    Raises Problem where nothing is grasped, or nothing is held out to predict.
    """
    motion = recording.motion
    if not motion.active.any() or recording.split is None:
        raise Problem(f"recording {recording.name}: has no grasp or no split.json, so it cannot be shortened.")
    grip = int(np.argmin([a.argmax() if a.any() else recording.frames for a in motion.active]))
    held = np.flatnonzero(motion.active[grip])
    speed = np.linalg.norm(np.diff(motion.position[grip, held[0] : held[-1] + 1], axis=0), axis=-1)
    moving = np.flatnonzero(speed > 1e-3 * speed.max(initial=0.0))
    arrived = held[0] + (int(moving[-1]) + 2 if len(moving) else 1)
    last = arrived if end == "load" else int(held[-1]) + 1
    return dataclasses.replace(recording, split=recording.split | {"fit": (recording.split["fit"][0], last)})
