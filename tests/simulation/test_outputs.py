"""One column over time, as a figure that somebody can read."""

import io

import numpy as np
from PIL import Image

from surgisim.artifacts.camera import Camera
from surgisim.artifacts.motion import Motion
from surgisim.simulation.outputs import yt_png


def test_recording_and_replay_lie_under_one_another_on_one_axis_of_seconds():
    clip = {"fps": 10.0, "frames": 20, "scale": "known", "focal_from": "given", "source": "made up"}
    lens = {"fx": 50.0, "fy": 50.0, "cx": 31.5, "cy": 23.5}
    camera = Camera(64, 48, **lens, **clip, source_size=[64, 48], crop=[0, 0, 64, 48])
    motion = Motion(
        center_rest=np.zeros((0, 3), np.float32),
        radius=np.zeros(0, np.float32),
        position=np.zeros((0, 20, 3), np.float32),
        active=np.zeros((0, 20), bool),
        confidence=np.zeros(0, np.float32),
        source="none",
    )
    recorded = np.zeros((20, 48, 64, 3), np.uint8)
    recorded[..., 0] = 255
    shown = np.zeros((40, 48, 64, 3), np.uint8)
    shown[..., 2] = 255
    picture = np.asarray(Image.open(io.BytesIO(yt_png(shown, recorded, motion, camera))).convert("RGB")).astype(int)
    red, blue = (np.argwhere((picture[..., a] > 200) & (picture.sum(-1) < 300)) for a in (0, 2))
    assert red[:, 0].max() < blue[:, 0].min()
    # The replay is twice as long as the recording.
    widths = [np.ptp(found[:, 1]) for found in (red, blue)]
    assert abs(widths[1] / widths[0] - 2) < 0.05
    assert abs(red[:, 1].min() - blue[:, 1].min()) < 4
    # It is seen at a size that a slide needs.
    assert picture.shape[1] >= 1000
