"""One small picture of a run."""

import cv2
import numpy as np

from surgisim.report.story import Story

HEIGHT = 120
"""Of the picture [px]."""


def thumbnail(story: Story) -> bytes:
    """JPEG: the recording, and to its right the replay where there is one, where the pull is farthest."""
    run = story.run
    t = story.moments[len(story.moments) // 2]
    panels = [run.frames.rgb[t], *([run.replay.rgb[t]] if story.replayed else [])]
    width = round(HEIGHT * run.camera.width / run.camera.height)
    small = [cv2.resize(one, (width, HEIGHT), interpolation=cv2.INTER_AREA) for one in panels]
    good, content = cv2.imencode(".jpg", np.hstack(small)[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, 82])
    if not good:
        raise ValueError(f"a picture of shape {small[0].shape} could not be encoded")
    return content.tobytes()
