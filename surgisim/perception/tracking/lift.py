"""Put followed points into space."""

import numpy as np
from scipy import ndimage

from surgisim.artifacts.camera import Camera
from surgisim.artifacts.depth import Depth
from surgisim.artifacts.tracks import Tracks
from surgisim.perception.tracking import Paths
from surgisim.perception.tracking.between import sample

FINE, COARSE = 0.004, 0.04
"""Standard deviation of depth's change, as a share of depth, where confidence is 1 and where it is 0."""
GUESSED = 0.1
"""The same where the change is not measured: as much as a pull may bring tissue nearer."""
STANDS, SHOWN = 1.0, 5
"""Way within which a point stands still in the picture [px], and frames of it that show how much its depth changes all
the same; a point with fewer has what the middle one of the others has."""
BESIDE = 2
"""How far a track, or an edge of the depth map, may be off [px]: depth there may be any from so far around."""


def lift(paths: Paths, depth: Depth, camera: Camera) -> Tracks:
    """The paths in the camera frame; along the view sigma is that of the change since frame 0."""
    frames = paths.xy.shape[1]
    at = paths.xy.swapaxes(0, 1)[:, :, None]
    z = np.stack([sample(depth.z[t].astype(np.float32), at[t])[:, 0] for t in range(frames)], 1)
    trust = np.stack([sample(depth.confidence[t].astype(np.float32), at[t])[:, 0] for t in range(frames)], 1)
    xyz = np.where(paths.visible[..., None], camera.lift(paths.xy.astype(float), z), np.nan)
    across = z * paths.sigma / camera.fx
    along = z * (FINE + (COARSE - FINE) * (1 - np.clip(trust, 0, 1)) if depth.follows else GUESSED)
    if depth.follows:
        along = np.sqrt(along**2 + _jitter(paths, z)[:, None] ** 2 + _beside(depth, at) ** 2)
    return Tracks(
        xy=paths.xy.astype(np.float32),
        visible=paths.visible,
        sigma=paths.sigma.astype(np.float32),
        xyz=xyz.astype(np.float32),
        sigma_xyz=np.stack([across, along], -1).astype(np.float32),
    )


def _jitter(paths: Paths, z: np.ndarray) -> np.ndarray:
    """How much each point's depth (K, T) changes while it stands still in the picture [m], (K,): the error of what is
    measured, which no recording states rightly. Half of the changes are smaller than .67 of it."""
    stands = paths.visible & paths.visible[:, :1] & np.isfinite(z)
    stands &= np.linalg.norm(paths.xy - paths.xy[:, :1], axis=-1) < STANDS
    change = np.abs(z[:, 1:] - z[:, :1])
    shown = stands[:, 1:].sum(1) >= SHOWN
    if not shown.any():
        return np.zeros(len(z))
    each = np.array([np.median(c[s]) for c, s in zip(change[shown], stands[shown, 1:], strict=True)]) / 0.67
    jitter = np.full(len(z), np.median(each))
    jitter[shown] = each
    return jitter


def _beside(depth: Depth, at: np.ndarray) -> np.ndarray:
    """Half of how much depth differs around each point in each frame [m], (K, T); at: its pixels, (T, K, 1, 2)."""
    size = 2 * BESIDE + 1
    range_of = (ndimage.maximum_filter(z, size) - ndimage.minimum_filter(z, size) for z in depth.z)
    return 0.5 * np.stack([sample(r.astype(np.float32), at[t])[:, 0] for t, r in enumerate(range_of)], 1)
