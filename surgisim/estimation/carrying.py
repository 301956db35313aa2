"""What a clip leaves open of how its instruments carry the tissue, as numbers that are fitted with the laws.

A picture shows where held tissue goes across the view. How far it comes nearer, how large the held ball is and when
between two frames it is let go show in how the tissue around it moves, which is what a simulation knows.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import gaussian_filter1d

from surgisim.artifacts.camera import Camera
from surgisim.artifacts.motion import Motion
from surgisim.artifacts.tracks import Tracks
from surgisim.estimation.unknown import RELAID, Unknown

TOWARD, TOWARD_READ, TOWARD_MEASURED = 0.08, 0.025, 0.01
"""Spread of how far a grip comes nearer, as a share of its distance: a pull of some 5 to 10 mm at 50 to 100 mm; what is
left open of it where depth's change was read off brightness, motion and the instrument (on 25 and 24 clips of families
261126 and 281127 it is .012 and .024 off, root mean square, one clip .09), and where it was measured in every frame."""
LEVEL = 1e-4
"""Share of its distance below which a found path does not come nearer: nothing was read off."""
BESIDE = 0.5
"""Spread of where the held ball's middle is across the view, each way, as a share of its radius: jaws hide it."""
ACROSS, RADIUS = 0.08, 0.2
"""Spread of the logarithms of a path's length across the view, and of a held ball's radius."""
LARGER = 0.2
"""What is expected of a radius that was found, not given: tissue about the jaws lags behind what they hold, and only
its middle goes as one. On 40 clips of family 5150 this logarithm is .20 +- .17, and the middle is off by .58 of the
radius found along the pull and by .52 across it, root mean square."""
RELEASE, RELEASE_SPREAD, RELEASE_ENDS = 0.5, 0.6, (-2.0, 3.0)
"""Frames after its last active one at which a grip opens: between that frame and the next, if it was found rightly."""
OPENS = 0.2
"""Spread of the moment of release that no tracks narrow [frames]: jaws open over a while, a fit opens them at once, and
its body springs back a little otherwise. On family 16180 four of thirteen moments were .3 to .5 frames off that tracks
alone told to .05 to .45."""
AROUND = 0.5
"""Radii of a grip from which points tell how deep the surface is."""
FAINT = 1e-9
"""What a point far from a grip still weighs, so that where none is near the nearest ones tell."""
MOST = 1 / 3
"""Share of the farthest way that a tracked point must go to say how a pull went in time."""


@dataclass(frozen=True)
class Sheet:
    """The surface in frame 0 as tracked points of it tell."""

    pixels: np.ndarray
    """(K, 2)."""
    depth: np.ndarray
    """[m], (K,)."""

    def at(self, pixel: np.ndarray, width: float) -> float:
        """Depth at a pixel, (2,), of the plane through the points around it [m], each as heavy as a Gaussian of this
        width [px] has it."""
        apart = self.pixels - pixel
        heavy = np.sqrt(np.exp(-0.5 * (apart**2).sum(1) / width**2) + FAINT)
        plane = np.column_stack([np.ones(len(apart)), apart])
        return float(np.linalg.lstsq(heavy[:, None] * plane, heavy * self.depth, rcond=None)[0][0])


@dataclass(frozen=True)
class Carrying:
    """The grips of a clip as they may have been."""

    motion: Motion
    camera: Camera
    share: np.ndarray
    """Share of its way that the pull has gone, (T,)."""
    sheet: Sheet
    """What a grip holds on to, wherever its middle is."""
    unknowns: tuple[Unknown, ...]

    def at(self, value: Mapping[str, float]) -> Motion:
        """The motion where the unknowns have these values, by their names."""
        found = self.motion
        position, radius, late = found.position.copy(), found.radius.copy(), found.late.copy()
        middle = np.array(found.center_rest, float)
        for j, center in enumerate(found.center_rest):
            pixels = self.camera.project(position[j])
            start = self.camera.project(center)
            z = position[j, :, 2] + value.get(named(j, "toward"), 0.0) * center[2] * self._share(j)
            across = np.exp(value.get(named(j, "across"), 0.0))
            beside = np.array([value.get(named(j, "right"), 0.0), value.get(named(j, "down"), 0.0)])
            middle[j] = self._beside(center, beside, float(found.radius[j]))
            position[j] = self.camera.lift(start + across * (pixels - start), z) + middle[j] - center
            radius[j] *= np.exp(value.get(named(j, "radius"), 0.0))
            late[j] += value.get(named(j, "release"), 0.0)
        return replace(found, center_rest=middle, position=position, radius=radius, late=late)

    def _beside(self, center: np.ndarray, beside: np.ndarray, radius: float) -> np.ndarray:
        """Where a grip's middle [m], (3,), comes to along the surface, shares of its distance right and down, (2,)."""
        if not beside.any():
            return center
        moved = center + center[2] * np.append(beside, 0.0)
        width = AROUND * radius * self.camera.fx / center[2]
        here, there = (self.sheet.at(self.camera.project(place[None])[0], width) for place in (center, moved))
        return moved * there / here

    def _share(self, grip: int) -> np.ndarray:
        """The share while it holds: 0 before, and as it was when it let go after, (T,)."""
        on = np.flatnonzero(self.motion.active[grip])
        share = self.share - self.share[on[0]]
        return np.concatenate([np.zeros(on[0]), share[on[0] : on[-1]], np.full(len(share) - on[-1], share[on[-1]])])


def named(grip: int, what: str) -> str:
    """As it is called in tables."""
    return f"grip {grip}.{what}"


def carrying(motion: Motion, tracks: Tracks, camera: Camera, measured: bool) -> Carrying:
    """What is open of every grip.

    measured: whether depth's change is, so that the path along the view is known to a little; otherwise only how far it
    goes in all is taken from the one found, and how it goes in time from what is seen across the view.
    """
    unknowns: list[Unknown] = []
    share = course(tracks, motion)
    larger = LARGER if motion.source == "found" else 0.0
    for j, center in enumerate(motion.center_rest):
        size = float(motion.radius[j])
        beside = BESIDE * size / float(center[2])
        nearer = 0.0 if measured else _nearer(motion, share, j)
        toward = TOWARD_MEASURED if measured else TOWARD_READ if abs(nearer) > LEVEL else TOWARD
        ends = (nearer - 4 * toward, nearer + 4 * toward)
        # fmt: off
        unknowns += [
            Unknown(named(j, "toward"), nearer, toward, *ends, "m", size=float(center[2]), before=TOWARD),
            Unknown(named(j, "right"), 0.0, beside, -3 * beside, 3 * beside, "m", size=float(center[2])),
            Unknown(named(j, "down"), 0.0, beside, -3 * beside, 3 * beside, "m", size=float(center[2])),
            Unknown(named(j, "across"), 0.0, ACROSS, -4 * ACROSS, 4 * ACROSS, "1", True),
            Unknown(
                named(j, "radius"), larger, RADIUS, larger - 4 * RADIUS, larger + 3 * RADIUS, "m", True, size=size,
                difference=RELAID,
            ),
        ]
        # fmt: on
        if not motion.active[j, -1]:
            unknowns.append(Unknown(named(j, "release"), RELEASE, RELEASE_SPREAD, *RELEASE_ENDS, "frames"))
    if not measured:
        motion = replace(motion, position=_level(motion, camera))
    shown = tracks.visible[:, 0] & np.isfinite(tracks.xyz[:, 0]).all(1)
    sheet = Sheet(tracks.xy[shown, 0].astype(float), tracks.xyz[shown, 0, 2].astype(float))
    return Carrying(motion, camera, share, sheet, tuple(unknowns))


def _nearer(motion: Motion, share: np.ndarray, grip: int) -> float:
    """How much farther off a grip is found at the end of the pull, as a share of its distance: negative when nearer."""
    on = motion.active[grip]
    gone = share[on] - share[on][0]
    change = motion.position[grip, on, 2] - motion.position[grip, on, 2][0]
    distance = float(motion.center_rest[grip, 2])
    return float((gone * change).sum() / max((gone**2).sum(), 1e-12)) / distance


def _level(motion: Motion, camera: Camera) -> np.ndarray:
    """The paths as the picture shows them, at the depth of rest [m], (J, T, 3)."""
    return camera.lift(
        camera.project(motion.position), np.broadcast_to(motion.center_rest[:, None, 2], motion.active.shape)
    )


def course(tracks: Tracks, motion: Motion) -> np.ndarray:
    """How far the pull has gone, from what moves with it: what each frame has of the farthest one's motion, (T,)."""
    held = motion.active.any(0)
    moved = np.where(tracks.visible[..., None], tracks.xy - tracks.xy[:, :1], 0.0).astype(float)
    far = np.linalg.norm(moved, axis=-1)
    lively = far.max(1) > MOST * np.percentile(far.max(1), 99)
    moved, seen = moved[lively], tracks.visible[lively]
    most = int(np.argmax(np.where(held, np.median(far[lively], 0), -1.0)))
    both = seen & seen[:, most : most + 1]
    along = ((moved * moved[:, most : most + 1]).sum(-1) * both).sum(0)
    share = along / np.maximum((far[lively, most : most + 1] ** 2 * both).sum(0), 1e-12)
    share[held] = gaussian_filter1d(share[held], 0.7, mode="nearest")
    return share
