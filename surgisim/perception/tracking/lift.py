"""Put followed points into space."""

import numpy as np

from surgisim.artifacts.camera import Camera
from surgisim.artifacts.depth import Depth
from surgisim.artifacts.tracks import Tracks
from surgisim.perception.tracking import Paths
from surgisim.perception.tracking.between import sample

FINE, COARSE = 0.004, 0.04
"""Standard deviation of depth's change, as a share of depth, where confidence is 1 and where it is 0."""
GUESSED = 0.1
"""The same where the change is not measured: as much as a pull may bring tissue nearer."""


def lift(paths: Paths, depth: Depth, camera: Camera) -> Tracks:
    """The paths in the camera frame; along the view sigma is that of the change since frame 0."""
    frames = paths.xy.shape[1]
    at = paths.xy.swapaxes(0, 1)[:, :, None]
    z = np.stack([sample(depth.z[t].astype(np.float32), at[t])[:, 0] for t in range(frames)], 1)
    trust = np.stack([sample(depth.confidence[t].astype(np.float32), at[t])[:, 0] for t in range(frames)], 1)
    xyz = np.where(paths.visible[..., None], camera.lift(paths.xy.astype(float), z), np.nan)
    across = z * paths.sigma / camera.fx
    along = z * (FINE + (COARSE - FINE) * (1 - np.clip(trust, 0, 1)) if depth.follows else GUESSED)
    return Tracks(
        xy=paths.xy.astype(np.float32),
        visible=paths.visible,
        sigma=paths.sigma.astype(np.float32),
        xyz=xyz.astype(np.float32),
        sigma_xyz=np.stack([across, along], -1).astype(np.float32),
    )
