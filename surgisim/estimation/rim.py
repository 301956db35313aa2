"""How the tissue at the edge of a picture goes with what lies beyond it, as its tracks show.

A body that ends there, free or held, knows nothing of what pulls it from outside: another instrument, breathing, the
organ that it hangs on. Patches along the edge that are carried as they are seen to go say it, as grips do.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.cluster.vq import kmeans2
from scipy.ndimage import gaussian_filter1d
from scipy.spatial import cKDTree

from surgisim.artifacts.camera import Camera
from surgisim.artifacts.motion import Motion
from surgisim.artifacts.tracks import Tracks
from surgisim.estimation.observation import MEASURED, Observation

BAND = 0.15
"""Points nearer to the picture's border than this share of its smaller side are at the edge."""
PATCHES = 16
"""Along the edge."""
LARGE = 0.4
"""A patch's radius, as a share of the way to the next one."""
FEWEST = 4
"""Points that say where a patch goes."""
SEEN = 0.7
"""Share of the frames in which as many of them must be seen; in between it goes evenly."""


@dataclass(frozen=True)
class Rim:
    """Patches of tissue along the edge of what is seen."""

    position: np.ndarray
    """Camera frame [m], (E, T, 3)."""
    radius: np.ndarray
    """[m], (E,)."""

    def carries(self, motion: Motion) -> Motion:
        """The motion with what the edge does."""
        return replace(motion, rim=self.position, rim_radius=self.radius)

    def beside(self, places: np.ndarray) -> "Rim":
        """Those patches that hold none of these places, camera frame x and y [m], (N, 2)."""
        away = cKDTree(places).query(self.position[:, 0, :2])[0]
        return Rim(self.position[away > self.radius], self.radius[away > self.radius])

    def leaves(self, observation: Observation, motion: Motion) -> Observation:
        """What is observed without the points that say where patches go; motion: what carries the tissue."""
        inside = self.carries(motion).on_rim(observation.rest)
        return replace(observation, weight=np.where(inside[:, None, None], 0.0, observation.weight))


def seen_rim(tracks: Tracks, motion: Motion, camera: Camera, spacing: float) -> Rim | None:
    """Patches and how they go, along the view only where depth's change is measured; None where the edge is not seen
    well enough.

    spacing: of the grid [m], which the smallest patch must fill.
    """
    rest, start = tracks.xyz[:, 0].astype(float), tracks.xy[:, 0].astype(float)
    side = min(camera.width, camera.height)
    inward = np.minimum(start, [camera.width - 1, camera.height - 1] - start).min(1)
    usable = np.isfinite(rest).all(1) & tracks.visible[:, 0] & (inward < BAND * side)
    for center, radius in zip(motion.center_rest, motion.radius, strict=True):
        usable &= np.linalg.norm(rest - center, axis=1) > 2 * radius
    if usable.sum() < FEWEST * PATCHES:
        return None
    rest, start = rest[usable], start[usable]
    seen = tracks.visible[usable]
    nearer = tracks.xyz[usable, :, 2] - rest[:, None, 2]
    told = seen & (tracks.sigma_xyz[usable, :, 1] < MEASURED * rest[:, None, 2])
    moved = np.concatenate([tracks.xy[usable] - start[:, None], np.where(told, nearer, 0.0)[..., None]], -1)
    middles, owner = kmeans2(start, PATCHES, minit="++", seed=0)
    apart = np.linalg.norm(middles[:, None] - middles, axis=-1) + np.diag(np.full(PATCHES, np.inf))
    position, radii = [], []
    for e in range(PATCHES):
        mine = owner == e
        if mine.sum() < FEWEST:
            continue
        place = rest[mine][np.linalg.norm(start[mine] - middles[e], axis=1).argmin()]
        way = _way(moved[mine], seen[mine])
        if way is None:
            continue
        position.append(camera.lift(camera.project(place) + way[:, :2], place[2] + way[:, 2]))
        radii.append(max(spacing, LARGE * apart[e].min() * place[2] / camera.fx))
    return Rim(np.array(position), np.array(radii)) if position else None


def _way(moved: np.ndarray, seen: np.ndarray) -> np.ndarray | None:
    """Where points that moved so, (N, T, C), went together, (T, C), from frames in which enough are seen."""
    enough = seen.sum(0) >= FEWEST
    enough[0] = True
    if enough.mean() < SEEN:
        return None
    frames = np.flatnonzero(enough)
    told = np.array([np.median(moved[seen[:, t], t], axis=0) for t in frames])
    way = np.stack([np.interp(np.arange(len(enough)), frames, told[:, a]) for a in range(told.shape[1])], 1)
    way = gaussian_filter1d(way, 0.7, axis=0, mode="nearest")
    return way - way[0]
