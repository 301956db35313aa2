"""Runs of a body with any laws beside what was recorded, and how far they are off."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import minimize_scalar

from surgisim.diagnosis.base import boldly, carried
from surgisim.diagnosis.clip import Clip
from surgisim.diagnosis.memo import NOTHING_KEPT, Memo
from surgisim.mpm.closing import follow
from surgisim.mpm.setup import Values
from surgisim.mpm.simulator import Breakdown
from surgisim.physics.place import Place

FLOOR = 1e-4
"""Swing below which points are as good as still [m]."""
CREEPS, LEAST_SWINGS = (1.5, 8.0), 4.0
"""Time constants of creep, and how long a course must be for it to be told from a swing, in periods. Silicone sinks on
for a second once it is let go; a modulus that makes up for that swings too slowly (of the beam by 2 %)."""
HAND, LEAST_DELAY = 0.1, 1e-3
"""How long after the first frame a body may still be held at most [s], and frames below which it is as good as at once;
chosen: fingers open in less."""
BETWEEN = 0.1
"""Share of frames between the first and the last seen one below which only where a body came to rest is seen."""


@dataclass(frozen=True)
class Course:
    """A recording's points over some of its frames, each frame with a weight."""

    clip: Clip
    points: np.ndarray
    """Which of the clip's points count, (K,) bool."""
    frames: np.ndarray
    """Which frames count, (T,) bool."""
    weight: np.ndarray
    """(T,)"""
    period: float = np.inf
    """Of a swing [s]; infinite where nothing creeps."""

    @property
    def until(self) -> int:
        """One past the last frame that counts."""
        return int(np.flatnonzero(self.frames)[-1]) + 1 if self.frames.any() else 0

    @property
    def seen(self) -> np.ndarray:
        """(K, T) bool."""
        return self.clip.seen & self.points[:, None] & self.frames

    def first(self, until: int) -> "Course":
        """The same up to a frame, exclusive."""
        return replace(self, frames=self.frames & (np.arange(len(self.frames)) < until))

    def left(self, moved: np.ndarray) -> np.ndarray:
        """Recorded less simulated [m], of what is seen, (M, 3); moved: (K, at least `until`, 3)."""
        n, moved = self.until, self.let_go(moved)
        return (self.clip.moved[:, :n] - moved[:, :n])[self.seen[:, :n]]

    def squares(self, moved: np.ndarray) -> np.ndarray:
        """Squared distance of what is seen [m^2], (K, until); nothing where it is not."""
        n, moved = self.until, self.let_go(moved)
        return np.where(self.seen[:, :n], ((self.clip.moved[:, :n] - moved[:, :n]) ** 2).sum(-1), 0.0)

    def weighted(self, moved: np.ndarray) -> np.ndarray:
        """The same times the frames' weights, less what each point may creep, (M, 3)."""
        n, seen, moved = self.until, self.seen[:, : self.until], self.let_go(moved)
        left = np.where(seen[..., None], self.clip.moved[:, :n] - moved[:, :n], 0.0) * self.weight[:n, None]
        if n >= LEAST_SWINGS * self.period * self.clip.fps:
            slow = self.creep(n) * self.weight[:n, None]
            for k in range(len(left)):
                own = np.linalg.qr(slow * seen[k, :, None])[0]
                left[k] -= own @ (own.T @ left[k])
        return left[seen]

    def let_go(self, moved: np.ndarray) -> np.ndarray:
        """The same displacement, (K, N, 3), from the moment on at which the hand lets go: a recording may begin before.

        It is the one that suits the first swing best, of what is simulated too: a delay is no part of any law.
        """
        turn = turned(self.clip)
        if self.clip.recording.starts != "released" or turn is None or comes_to_rest(self.clip):
            return moved
        n = min(self.until, 2 * turn + 1)
        seen, frames = self.seen[:, :n], np.arange(moved.shape[1])
        course = CubicSpline(frames, moved, axis=1)

        def delayed(by: float, n: int) -> np.ndarray:
            return course(np.maximum(frames[:n] - by, 0.0))

        def off(by: float) -> float:
            return float(((self.clip.moved[:, :n] - delayed(by, n))[seen] ** 2).sum())

        latest = min(HAND * self.clip.fps, turn / 2)
        by = minimize_scalar(off, bounds=(0.0, latest), method="bounded", options={"xatol": LEAST_DELAY / 10}).x
        return moved if by < LEAST_DELAY or off(by) >= off(0.0) else delayed(by, len(frames))

    def creep(self, frames: int) -> np.ndarray:
        """How a body may sink further once it is let go, (frames, 2): softer than it swings, it takes its time."""
        time = np.arange(frames) / self.clip.fps
        return 1 - np.exp(-time[:, None] / (self.period * np.array(CREEPS)))

    def rms(self, moved: np.ndarray) -> float:
        """Distance [m]."""
        return float(np.sqrt((self.left(moved) ** 2).sum(1).mean()))


def fitted(clip: Clip, period: float) -> Course:
    """The fitted frames, under weights by which late swings count as much as first ones."""
    frames = np.arange(clip.frames) < clip.until
    # In the frame in which it is let go nothing has moved.
    return Course(clip, np.ones(len(clip.kept), bool), frames & clip.seen.any(0), alike(clip, period), period)


def kept_out(clip: Clip) -> Course:
    """The frames held out."""
    first, last = clip.recording.held_out
    frames = (np.arange(clip.frames) >= first) & (np.arange(clip.frames) < last)
    return Course(clip, np.ones(len(clip.kept), bool), frames & clip.seen.any(0), np.ones(clip.frames))


def whole(clip: Clip) -> Course:
    """All frames of another recording."""
    return Course(clip, np.ones(len(clip.kept), bool), clip.seen.any(0), np.ones(clip.frames))


def every_second(course: Course) -> tuple[Course, Course]:
    """Two of every other point: what there is to hold out where a body is seen at rest alone."""
    even = np.arange(len(course.points)) % 2 == 0
    return replace(course, points=course.points & even), replace(course, points=course.points & ~even)


def comes_to_rest(clip: Clip) -> bool:
    """Whether of a released body no more is seen than where it began and where it came to rest."""
    seen = np.flatnonzero(clip.seen[:, : clip.until].any(0))
    if clip.recording.starts != "released" or len(seen) < 2:
        return False
    between = clip.seen[:, 1 : seen[-1]]
    return bool(between.size) and between.any(0).mean() < BETWEEN


def turned(clip: Clip) -> int | None:
    """Frame in which the liveliest component of a body let go first turns round; None where it does not."""
    path = np.where(clip.seen[..., None], clip.moved, 0.0)[:, : clip.until]
    k, a = np.unravel_index(np.ptp(path, axis=1).argmax(), (len(path), 3))
    step = np.sign(np.diff(path[k, :, a]))
    turns = 1 + np.flatnonzero(step[1:] * step[:-1] < 0)
    return int(turns[0]) if len(turns) else None


def seen_period(clip: Clip) -> float:
    """Of a swing as it is seen [s]: twice the time of the first turn; the whole clip where nothing turns round."""
    return 2 * (turned(clip) or clip.until / 2) / clip.fps


def alike(clip: Clip, period: float) -> np.ndarray:
    """One over how far points go within the period around a frame, no less than FLOOR, largest 1, (T,)."""
    path = np.where(clip.seen[..., None], clip.moved, np.nan)
    span = int(np.clip(np.round(clip.fps * period), 2, clip.frames))
    first = np.clip(np.arange(clip.frames) - span // 2, 0, clip.frames - span)
    swing = np.full(clip.frames, np.nan)
    for t, begin in enumerate(first):
        part = path[:, begin : begin + span]
        usable = np.isfinite(part[..., 0]).sum(1) > 1
        if usable.any():
            part = part[usable]
            away = part - np.nanmean(part, axis=1, keepdims=True)
            swing[t] = np.sqrt(np.nanmean((away**2).sum(-1)))
    swing = np.where(np.isfinite(swing), swing, np.nanmax(swing, initial=FLOOR))
    weight = 1 / np.maximum(swing, FLOOR)
    return weight / weight.max()


def simulate(
    clip: Clip, values: Values, places: Mapping[str, Place], frames: int, memo: Memo = NOTHING_KEPT
) -> np.ndarray:
    """Displacement of the clip's points [m], (K, frames, 3). Raises Breakdown where the engine, or a point, does."""
    where = {n: [p.center, p.extent, p.normal] for n, p in places.items()}
    what = ["swinging", clip.recording.name, float(np.abs(clip.moved).sum()), values, where, frames, *clip.kind]
    return memo(what, lambda: {"moved": _simulated(clip, values, places, frames)})["moved"]


def _simulated(clip: Clip, values: Values, places: Mapping[str, Place], frames: int) -> np.ndarray:
    prepared = clip.prepared(tuple(values))
    theta = prepared.theta(values, places)

    def run(safety: float):
        per_frame = prepared.per_frame_of(prepared.stiffest(theta), clip.fps, safety)
        drive = prepared.drive(
            clip.motion, values, fps=clip.fps, per_frame=per_frame, frames=clip.frames, places=places,
            late=clip.opening,
        )  # fmt: skip
        return follow(prepared.simulator, theta, drive, last=frames - 1)

    moved = carried(prepared.simulator.carry(clip.rest), boldly(run))
    if not np.isfinite(moved).all():
        raise Breakdown("a point of a body let go is nowhere. Take a smaller step or a softer tissue.")
    return moved
