"""Whether a replay stayed a body: nothing turned inside out, flew off or left the picture."""

from dataclasses import dataclass

import numpy as np

from surgisim.artifacts.body import Body
from surgisim.artifacts.camera import Camera
from surgisim.artifacts.motion import Motion
from surgisim.artifacts.replay import Replay


@dataclass(frozen=True)
class Sanity:
    smallest_volume_ratio: float
    """Smallest det F of any particle in any frame [1]; at or below 0 the tissue is inside out."""
    largest: float
    """Largest displacement of a particle [m]."""
    grip: float
    """Largest displacement of a grip while it holds [m]."""
    inside: float
    """Smallest share, over frames, of the particles seen in frame 0 that still project into the picture [1]."""

    @property
    def sane(self) -> bool:
        """1 if det F > 0 everywhere, none goes over 1.2 times as far as the grip, 9 in 10 stay in the picture."""
        bounded = self.largest <= 1.2 * self.grip if self.grip > 0 else True
        return self.smallest_volume_ratio > 0 and bounded and self.inside >= 0.9


def sanity(replay: Replay, body: Body, motion: Motion, camera: Camera) -> Sanity:
    """The four numbers of a replay."""
    largest = float(np.linalg.norm(replay.position - body.rest, axis=-1).max())
    carried = np.linalg.norm(motion.position - motion.center_rest[:, None], axis=-1)[motion.active]
    inside = _inside(replay.position, camera)
    seen = inside[0]
    share = float((inside & seen).sum(1).min() / max(seen.sum(), 1))
    return Sanity(
        float(replay.smallest_volume_ratio.min()), largest, float(carried.max()) if len(carried) else 0.0, share
    )


def _inside(position: np.ndarray, camera: Camera) -> np.ndarray:
    before = position[..., 2] > 0
    pixels = camera.project(np.where(before[..., None], position, 1.0))
    within = (pixels > -0.5).all(-1) & (pixels[..., 0] < camera.width - 0.5) & (pixels[..., 1] < camera.height - 0.5)
    return before & within
