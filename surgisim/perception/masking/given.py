"""The instrument as it was marked by whoever made the recording."""

import numpy as np

from surgisim.artifacts.frames import Frames
from surgisim.artifacts.given import Given
from surgisim.config.masking import Masking
from surgisim.problem import Problem


def tool(frames: Frames, given: Given, settings: Masking, progress) -> tuple[np.ndarray, np.ndarray]:
    """The given masks, believed."""
    if not len(given.tool):
        raise Problem(
            "config key 'masking.backend' is 'given', but no masks came with this recording. "
            "Use 'colour_motion', or pass an EndoNeRF folder with masks/."
        )
    if given.tool.shape != frames.rgb.shape[:3]:
        raise Problem(
            f"given masks are {given.tool.shape} (frames, rows, columns), but the frames are {frames.rgb.shape[:3]}. "
            "Run ingest again."
        )
    return given.tool, np.ones(len(given.tool))
