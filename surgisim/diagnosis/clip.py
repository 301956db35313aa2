"""A recording as the diagnosis sees it: points that the body carries, how they moved, which frames may be fitted."""

from dataclasses import dataclass, field, replace

import numpy as np

from surgisim.artifacts.body import Body
from surgisim.artifacts.motion import Motion
from surgisim.diagnosis import strays
from surgisim.diagnosis.prior import Prior, prior_of
from surgisim.estimation.rim import Rim
from surgisim.mpm.grip import runs
from surgisim.mpm.setup import Prepared, prepare
from surgisim.problem import Problem
from surgisim.recordings.mesh import Mesh
from surgisim.recordings.recording import Recording

CLEAR = 1.3
"""Radii of a grip within which points are left out: nobody's solution is to be believed at the skin of a grip."""
DENSITY = 1050.0
"""Of tissue, where the recording gives none [kg/m^3]."""
SHARE = 0.165
"""Spacing of the grid over the cube root of the body's volume."""
OPENS = 0.5
"""Frames after its last active one at which a grip opens, where nothing tells: no later than the next, on average."""
SETTLES = 4
"""Frames after a release that are not taken as still."""
QUIET = 1.6
"""Times the step of the quietest fifth of the frames, below which a frame counts as quiet where nothing is gripped."""
MOST = 240
"""Points that are used at most: time and memory grow with them; chosen."""
LEAST_SEEN = 0.2
"""Share of the fitted frames in which a point must be seen."""


@dataclass(frozen=True)
class Clip:
    """K points in T frames."""

    recording: Recording
    body: Body
    kept: np.ndarray
    """Which of the recording's points are used, (K,) int."""
    rest: np.ndarray
    """Where they sit on the body [m], (K, 3)."""
    seen: np.ndarray
    """(K, T) bool."""
    moved: np.ndarray
    """Observed displacement less `error` [m], (K, T, 3), zero where not seen."""
    until: int
    """First frame that is not fitted."""
    normal: np.ndarray
    """Out of the base towards the observed side, (3,)."""
    device: str = "cpu"
    """Where the engine runs."""
    shifted: bool = True
    """Whether paths count from where grips find their tissue (`mpm/closing.py`), or from where it was at rest."""
    raised: float = 0.0
    """How far what is held reaches beyond its boxes [m]."""
    late: np.ndarray | None = None
    """How many frames after its last active one each grip opens (`mpm/grip.py`), (J, T); None for a half."""
    stiffer: np.ndarray = field(default_factory=lambda: np.zeros(3))
    """What is added to the base's numbers, (3,), when they run on this grid, to move as they do on a finer one."""
    error: np.ndarray | None = None
    """What is then still left to what the finer grid shows, with which observed tracks are compared [m], (K, T, 3);
    None where that is not known."""
    edge: Rim | None = None
    """What the edge of the picture was seen to do, where that does not drive the body."""
    strayed: int = 0
    """Samples of its points that are left out, since they are another point's (`strays.py`)."""

    @property
    def frames(self) -> int:
        return self.moved.shape[1]

    @property
    def fps(self) -> float:
        return self.recording.fps

    @property
    def nominal(self) -> tuple[np.ndarray, np.ndarray | None, np.ndarray | None]:
        """What the recording says of each point's noise [m], (K,), of the axes' shares of it, (K, 3), and of their
        directions, (K, 3, 3); None for what it does not say."""
        mine = self.recording.of(self.kept)
        return mine.sigma, mine.axes, mine.ways

    @property
    def prior(self) -> Prior:
        """Of the base's numbers."""
        return prior_of(self.recording)

    @property
    def motion(self) -> Motion:
        return self.recording.motion

    @property
    def density(self) -> float:
        return self.recording.density or DENSITY

    @property
    def held(self) -> np.ndarray:
        """Frames in which a grip holds, (T,) bool."""
        return self.motion.active.any(0) if len(self.motion.active) else np.zeros(self.frames, bool)

    @property
    def time(self) -> np.ndarray:
        """[s], (T,)"""
        return np.arange(self.frames) / self.fps

    def prepared(self, terms: tuple[str, ...], threads: int = 1, motion: Motion | None = None) -> Prepared:
        """The body on its grid with these laws."""
        grips = self.motion if motion is None else motion
        # What begins settled hangs in balance with its weight; what is let go does not.
        falls = self.recording.starts == "released" and self.recording.gravity is not None
        return prepare(
            self.body, terms, density=self.density, carried=self.rest, grips=grips if len(grips.radius) else None,
            threads=threads, device=self.device, gravity=self.recording.gravity if falls else (0.0, 0.0, 0.0),
        )  # fmt: skip

    @property
    def kind(self) -> list:
        """What runs of it depend on besides recording and laws, for JSON."""
        late = [
            [j, t, round(float(self.opening[j, t]), 9)] for j, on in enumerate(self.motion.active) for _, t in runs(on)
        ]
        return [round(float(self.body.spacing), 12), round(float(self.raised), 9), self.shifted, late]

    @property
    def opening(self) -> np.ndarray:
        """How many frames after its last active one each grip opens, (J, T)."""
        return np.full(self.motion.active.shape, OPENS) if self.late is None else self.late

    def releases(self, before: int | None = None) -> list[tuple[int, int]]:
        """Grip, and last active frame, of every release before a frame; of those that fitted frames show, if None."""
        before = self.until - 3 if before is None else before
        found = [(j, last) for j, on in enumerate(self.motion.active) for _, last in runs(on)]
        return [(j, last) for j, last in found if last < before]

    def on_grid(self, x: np.ndarray) -> np.ndarray:
        """A base's numbers as this grid's runs take them, (3,)."""
        return x[:3] + self.stiffer

    def opens(self, late: np.ndarray) -> "Clip":
        """The same with fitted releases so many frames after their grips' last active ones, (R,); as it is with none.

        Later releases, of which nothing is fitted, are taken to fall as those do.
        """
        if not len(late):
            return self
        opening = np.full(self.opening.shape, float(np.mean(late)))
        for (j, t), after in zip(self.releases(), late, strict=True):
            opening[j, t] = after
        return replace(self, late=opening)

    def less(self, error: np.ndarray | None) -> "Clip":
        """The same with another `error`."""
        moved = self.moved if self.error is None else self.moved + self.error * self.seen[..., None]
        return replace(self, moved=moved if error is None else moved - error * self.seen[..., None], error=error)

    def laid(self, *, share: float | None = None, raised: float | None = None) -> "Clip":
        """The same on a grid of another spacing, over the cube root of the body's volume, or held further up [m].

        Raises Problem where nothing, or everything, would be held.
        """
        raised = self.raised if raised is None else raised
        spacing = self.body.spacing if share is None else spacing_of(self.recording.mesh, share)
        stiffer = self.stiffer if share is None else np.zeros(3)
        body = self.recording.body(float(spacing), raised)
        return replace(self.less(None), body=body, raised=raised, stiffer=stiffer)

    @property
    def untouched(self) -> int | None:
        """First fitted frame in which something grips; None of a video's tracks (`noise_fit.estimate`)."""
        if self.recording.astray:
            return None
        held = self.held[: self.until]
        return int(held.argmax()) if held.any() else self.until if len(self.motion.radius) else 0

    def quiet(self) -> np.ndarray:
        """Frames in which tissue is still or moves slowly: what the noise is read from, (T,) bool."""
        if not len(self.motion.radius):
            # Nobody says when; the quietest of the frames do.
            step = np.linalg.norm(np.diff(self.moved, axis=1, prepend=self.moved[:, :1]), axis=-1)
            both = self.seen & np.roll(self.seen, 1, axis=1)
            middle = np.array([np.median(s[b]) if b.any() else np.inf for s, b in zip(step.T, both.T, strict=True)])
            return middle < QUIET * np.percentile(middle[1 : self.until], 20)
        phase = self.phases()
        still = phase != PHASES.index("load")
        for frame in np.flatnonzero((phase == PHASES.index("release")) & (np.roll(phase, 1) != phase)):
            still[frame : frame + SETTLES] = False
        return still

    def phases(self) -> np.ndarray:
        """Index into PHASES of every frame, (T,)."""
        active = self.held
        speed = speed_of(self.motion, self.fps, self.frames)
        quick = speed > 0.05 * max(speed.max(), 1e-9)
        begun = np.maximum.accumulate(active)
        phase = np.zeros(self.frames, int)
        phase[active & quick] = PHASES.index("load")
        phase[active & ~quick] = PHASES.index("hold")
        phase[begun & ~active] = PHASES.index("release")
        return phase


PHASES = ("rest", "load", "hold", "release")


def speed_of(motion: Motion, fps: float, frames: int) -> np.ndarray:
    """Fastest active grip at every frame [m/s], (T,)."""
    if not len(motion.active):
        return np.zeros(frames)
    speed = np.linalg.norm(np.gradient(motion.position, axis=1), axis=-1) * fps
    return np.where(motion.active, speed, 0.0).max(0)


def clip_of(recording: Recording, *, share: float = SHARE, device: str = "cpu") -> Clip:
    """Lay a grid through the body, choose points and frames.

    share: spacing of the grid over the cube root of the body's volume. Raises Problem where fewer than 4 points
    remain, or where the recording has fewer than 8 frames to fit.
    """
    recording, edge = _undriven(recording)
    motion = recording.motion
    spacing = spacing_of(recording.mesh, share)
    body = recording.body(float(spacing))
    until = recording.fitted_until
    rest = recording.attached()
    near = np.linalg.norm(rest[:, None] - body.rest[None].astype(float), axis=-1).min(1)
    usable = near < 1.5 * spacing
    for center, radius in zip(motion.center_rest, motion.radius, strict=True):
        usable &= np.linalg.norm(rest - center, axis=1) > CLEAR * radius
    usable &= ~motion.on_rim(rest)
    often = recording.visible[:, :until].mean(1)
    # Of what hangs at rest one picture may be all there is.
    usable &= often > min(LEAST_SEEN, 0.5 * often.max(initial=0.0))
    kept = np.flatnonzero(usable)
    if len(kept) < 4:
        away = float(np.median(near))
        apart = f" Half of them begin {away:.2g} m or more from it: are they in its unit?" if away > spacing else ""
        raise Problem(
            f"recording {recording.name}: {len(kept)} of {len(rest)} points lie on the body, outside the grips, and "
            f"are seen often enough; at least 4 are needed to tell what was left out.{apart}"
        )
    if until < 8:
        raise Problem(
            f"recording {recording.name}: {until} frames may be fitted, at least 8 are needed. Mend split.json."
        )
    kept = kept[_apart(rest[kept], recording.visible[kept, :until].mean(1), MOST)]
    seen, strayed = recording.visible[kept].copy(), 0
    if not recording.astray:
        # Of a video's tracks, what steps aside is a nuisance of its own (`perceived.jumps`).
        there = np.where(recording.visible[..., None], recording.points.astype(float) - rest[:, None], 0.0)
        away = strays.strayed(rest, there, recording.visible, motion, recording.fps)[kept]
        seen, strayed = seen & ~away, int((seen & away).sum())
    moved = recording.points[kept].astype(float) - rest[kept][:, None]
    moved = np.where(seen[..., None], moved, 0.0)
    normal = _normal(body, rest[kept])
    return Clip(recording, body, kept, rest[kept], seen, moved, until, normal, device, edge=edge, strayed=strayed)


def _undriven(recording: Recording) -> tuple[Recording, Rim | None]:
    """A recording of a video without what moves its edge beside the pull; and the edge, where that drives nothing now.

    An edge that goes as tracks say carries into the body whatever moves the tissue, explained or not: breathing, a
    weight, a push beside it. A simulation that looks like the recording wants that; what asks for the cause does not.
    What nothing but its edge holds is carried by that as far as it goes with the pull.
    """
    motion = recording.motion
    if not (recording.doubts and len(motion.rim)):
        return recording, None
    if len(recording.boxes):
        bare = replace(motion, rim=None, rim_radius=None)
        return replace(recording, motion=bare), Rim(motion.rim, motion.rim_radius)
    course = pull_of(motion)
    way = along(course, motion.rim, recording.fitted_until)
    rim = motion.rim[:, :1] + course[None, :, None] * way[:, None]
    return replace(recording, motion=replace(motion, rim=rim)), None


def pull_of(motion: Motion) -> np.ndarray:
    """How far grips have carried tissue in every frame, over the farthest, (T,)."""
    way = np.linalg.norm(motion.position - motion.center_rest[:, None], axis=-1) * motion.active
    far = way.max(0, initial=0.0)
    return far / max(far.max(), 1e-12)


def along(course: np.ndarray, path: np.ndarray, until: int) -> np.ndarray:
    """How far paths [m], (E, T, 3), go with a course, (T,), beside a constant, in frames before `until`: (E, 3)."""
    basis = np.stack([course[:until], np.ones(until)], 1)
    gone = (path[:, :until] - path[:, :1]).transpose(1, 0, 2).reshape(until, -1)
    return np.linalg.lstsq(basis, gone, rcond=None)[0][0].reshape(-1, 3)


def spacing_of(mesh: Mesh, share: float) -> float:
    """Of a grid through a body [m], `share` of the cube root of its volume, or finer where the body is thin."""
    return min(share * float(np.cbrt(mesh.volume)), 0.9 * 2 * mesh.volume / mesh.area)


def _apart(rest: np.ndarray, seen: np.ndarray, most: int) -> np.ndarray:
    """Which points to use, in their order: the best seen first, then always the one farthest from all others."""
    if len(rest) <= most:
        return np.arange(len(rest))
    chosen = [int(seen.argmax())]
    nearest = np.linalg.norm(rest - rest[chosen[0]], axis=1)
    while len(chosen) < most:
        chosen.append(int((nearest * (0.3 + seen)).argmax()))
        nearest = np.minimum(nearest, np.linalg.norm(rest - rest[chosen[-1]], axis=1))
    return np.sort(chosen)


def _normal(body: Body, rest: np.ndarray) -> np.ndarray:
    """The thin direction of what is held (or of the body), pointing from there to the observed points."""
    mine = body.rest[body.held].astype(float) if body.held.sum() > 3 else body.rest.astype(float)
    _, _, axes = np.linalg.svd(mine - mine.mean(0), full_matrices=False)
    away = rest.mean(0) - mine.mean(0)
    normal = axes[2] if body.held.any() and abs(axes[2] @ away) > 0.5 * np.linalg.norm(away) else away
    normal = normal * np.sign(normal @ away or 1.0)
    size = np.linalg.norm(normal)
    return normal / size if size > 0 else np.array([0.0, 0.0, 1.0])
