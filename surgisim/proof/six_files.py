"""A changed recording as the six files that a rule announces."""

import dataclasses

from surgisim.recordings.folder import encoded_recording
from surgisim.recordings.recording import Recording

NAMES = ("recording.json", "rest.ply", "fixed.json", "grip.npz", "tracks.npz", "split.json")


def six_files(recording: Recording) -> tuple[bytes, ...]:
    """In the order of NAMES. A recording without a split gets the one that its reader would give it."""
    split = recording.split or {"fit": (0, recording.fitted_until), "held_out": recording.held_out}
    files = encoded_recording(dataclasses.replace(recording, split=split))
    return tuple(files[name] for name in NAMES)
