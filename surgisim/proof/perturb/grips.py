"""When grips are said to hold: a frame longer, or a frame shorter."""

import dataclasses

import numpy as np

from surgisim.recordings.recording import Recording


def longer(recording: Recording, frames: int) -> Recording:
    """Every run of every grip ended one frame later (`frames` 1) or earlier (-1).

    A run of a single frame stays, and two runs stay apart. Where a longer run ends, the grip is where `position` says.
    """
    active = recording.motion.active.copy()
    for grip in active:
        ends = np.flatnonzero(grip & ~np.r_[grip[1:], False])
        for end in ends:
            if frames < 0 and end > 0 and grip[end - 1]:
                grip[end] = False
            elif frames > 0 and end + 1 < len(grip) and not grip[end + 1 : end + 3].any():
                grip[end + 1] = True
    return dataclasses.replace(recording, motion=dataclasses.replace(recording.motion, active=active))
