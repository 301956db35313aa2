"""The driven region: which particles a grip holds, and the path it carries them along."""

import math
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import PchipInterpolator

from surgisim.artifacts.motion import Motion
from surgisim.problem import Problem

ANCHOR = 56.0
"""Spring of an anchor, in units of (shear wave speed / spacing)^2 per unit of mass. A spline cannot bend sharply at the
edge of what is held: a rigid hold reaches beyond it by a share of a cell, a soft one lets the edge slip. At this
stiffness the two make up for each other, so that the held volume acts as large as it is (docs/verification.md,
manipulation). Shear, because tissue that cannot be squeezed flows around a grip. It has no damper: at the held boundary
that would drain every wave that arrives there."""
MOST = 30
"""Grips and patches of the rim that a particle's bits have room for."""
SHARP_ANCHOR = 90.0
"""The same where the displacement may bend at a grip's skin (kink.py), which leaves less to make up for."""
BASE = 10.0
"""Least spring of the held base, in units of (pressure wave speed / spacing)^2 per unit of inertia of what it holds:
what the stable step has room for (stable.py). Tissue that can hardly be squeezed presses on its base far harder than it
shears it; a base that gives way under that makes it look as if it could be squeezed."""


@dataclass(frozen=True)
class Drive:
    """Anchor 0 is the held boundary; anchors 1 to J are the grips, and patches of the seen rim, if any, follow."""

    member: np.ndarray
    """Bit a is set where anchor a holds the particle, (P,) int32."""
    share: np.ndarray
    """Share of the particle's volume that is held, times how much stiffer than the body's tissue it is, (P,)."""
    path: np.ndarray
    """Displacement of each anchor at every step and after the last [m], (1 + J, S + 1, 3)."""
    hold: np.ndarray
    """Share of its spring with which each anchor holds during each step, 0 where it has let go, (1 + J, S)."""
    step: float
    """[s]"""
    per_frame: int
    """Steps between two frames."""
    stiffness: np.ndarray
    """Spring that holds a particle to each anchor, per unit of mass [1/s^2], (1 + J, 3, 3)."""
    center: np.ndarray
    """What each anchor turns about, at rest [m], (1 + J, 3)."""
    turn: np.ndarray | None = None
    """Rotation of each anchor at every step, (1 + J, S + 1, 3, 3); None where none turns."""

    @property
    def steps(self) -> int:
        return self.hold.shape[1]

    @property
    def frames(self) -> int:
        """Frames the run ends up with, the first at rest."""
        return self.steps // self.per_frame + 1


def drive(
    motion: Motion,
    rest: np.ndarray,
    volume: np.ndarray,
    held: np.ndarray,
    *,
    fps: float,
    per_frame: int,
    stiffness: float,
    grip: float = 1.0,
    frames: int | None = None,
    late: np.ndarray | None = None,
) -> Drive:
    """The boundary condition of a replay of `motion` on particles `rest` [m], (P, 3), of `volume` [m^3], (P,).

    A particle at the skin of a grip's ball is held by the share of it that lies inside. stiffness: spring of the
    anchors per unit of mass [1/s^2]; `grip` is the share of it that instruments get.
    Between frames the path is a monotone cubic (Fritsch and Carlson, 1980), so the instrument does
    not jerk at every frame; before and after its active frames a grip holds nothing.
    Patches of the rim go along all the time.
    late: how many frames after its last active frame each grip opens, for the run of active frames that ends there,
    (J, T); before it, where negative. A grip that holds on past its last active frame moves on as it did. 0 if None.
    Raises Problem if a grip or patch holds no particle, or if there are more than `MOST`.
    """
    grips, motion_frames = motion.active.shape if len(motion.active) else (0, frames or motion.active.shape[-1])
    patches = len(motion.rim_radius)
    frames = frames or motion_frames
    steps, step = (frames - 1) * per_frame, 1.0 / fps / per_frame
    if grips + patches > MOST:
        raise Problem(
            f"motion: {grips} grips and {patches} patches of the rim, but at most {MOST} can be simulated at once. "
            "Keep the ones that matter."
        )
    member, share = held.astype(np.int32), held.astype(float)
    size = np.cbrt(volume)
    path = np.zeros((1 + grips + patches, steps + 1, 3))
    hold = np.zeros((1 + grips + patches, steps))
    hold[0] = 1.0
    clock = np.arange(steps + 1) / per_frame
    places = np.concatenate([motion.center_rest, motion.rim[:, 0]])
    for j, (place, radius) in enumerate(zip(places, [*motion.radius, *motion.rim_radius], strict=True)):
        away = np.linalg.norm(rest - place, axis=1)
        inside = np.clip(0.5 + (radius - away) / size, 0.0, 1.0)
        near = inside > 0
        if not near.any():
            raise Problem(
                f"motion: {f'grip {j}' if j < grips else f'patch {j - grips} of the rim'} at "
                f"{np.round(place, 4).tolist()} m with radius {radius:.4f} m lies outside the body; the nearest tissue "
                f"is {away.min():.4f} m away. Move it, or enlarge its radius."
            )
        member |= near.astype(np.int32) << (1 + j)
        share = np.maximum(share, inside)
    for j in range(grips):
        on = motion.active[j].astype(bool)
        after = np.zeros(len(on)) if late is None else np.asarray(late[j], float)
        path[1 + j] = _between(_carried_on(motion.position[j] - motion.center_rest[j], on, after), clock)
        # Held from the first active frame until the grip opens: without `late`, at the last active one.
        for first, last in runs(on):
            opens = steps if last == len(on) - 1 else (last + after[last]) * per_frame
            # A step in which it opens is held for a share of it.
            mine = np.clip(opens - np.arange(steps), 0.0, 1.0) * (np.arange(steps) >= first * per_frame)
            hold[1 + j] = np.maximum(hold[1 + j], mine)
    for e in range(patches):
        path[1 + grips + e] = _between(motion.rim[e] - motion.rim[e, 0], clock)
        hold[1 + grips + e] = 1.0
    springs = stiffness * np.concatenate([[1.0], np.full(grips, grip), np.ones(patches)])
    center = np.concatenate([rest[held].mean(0, keepdims=True) if held.any() else np.zeros((1, 3)), places])
    spring = springs[:, None, None] * np.eye(3)
    return Drive(member, share, path, hold, step, per_frame, spring, center)


def _between(offset: np.ndarray, clock: np.ndarray) -> np.ndarray:
    """Offsets of frames [m], (T, 3), at times [frames], (S,)."""
    at = np.minimum(clock, len(offset) - 1)
    return PchipInterpolator(np.arange(len(offset)), offset)(at) if len(offset) > 1 else np.repeat(offset, len(at), 0)


def runs(on: np.ndarray) -> list[tuple[int, int]]:
    """First and last frame of every run of active ones, (T,) bool."""
    edges = np.diff(np.concatenate([[0], on.astype(int), [0]]))
    return list(zip(np.flatnonzero(edges == 1).tolist(), (np.flatnonzero(edges == -1) - 1).tolist(), strict=True))


def _carried_on(offset: np.ndarray, on: np.ndarray, late: np.ndarray) -> np.ndarray:
    """Offsets [m], (T, 3), of which those just after a grip's last active frame go on as it last moved."""
    offset = offset.copy()
    for first, last in runs(on):
        ahead = max(math.ceil(late[last] - 1e-9), 0) if last + 1 < len(on) else 0
        step = offset[last] - offset[last - 1] if last > first else np.zeros(3)
        for n in range(1, min(ahead, len(on) - 1 - last) + 1):
            # Where it grips anew, its path is given.
            if on[last + n]:
                break
            offset[last + n] = offset[last] + n * step
    return offset
