"""Outliers of tracks (identity switches): a track that steps aside from all around it, and later steps back.

A tracker takes a point for one beside it, or for something else, for a while. Noise of a size of its own says nothing
of that: errors of millimetres in six frames look like a push. Tissue does not do it: what steps aside with a grip does
so beside that grip alone. Thresholds were chosen beside one opened recording (docs/diagnosis.md) and looked at on six.
"""

from dataclasses import dataclass

import numpy as np

from surgisim.artifacts.motion import Motion

BESIDE, LEAST = 8, 5
"""Neighbours of a point, and how many there must be."""
CLEAR_STEP, APART = 3.2, 3.0
"""How far a track must step aside from the middle one of its neighbours to have strayed: times the middle step aside of
its own and of all tracks, and times what that middle neighbour does. Of white noise 3.2 middle steps are 4.9 standard
deviations along an axis, as far as one sample in 30 000 goes; chosen."""
BACK = 0.6
"""Share of the larger of a step aside and the step back within which they must undo one another, since tissue strains
meanwhile; chosen."""
SOME = 5
"""Samples before and after a step that say where a track lies."""
REACH, RINGS, PARTNERS = 2.0, 0.5, 3
"""Radii of a grip within which tissue may step aside, from when it closes to so long [s] after it opened: there only
what also steps aside at another time, or changes places with one of so many nearest tracks, has strayed; chosen."""


@dataclass(frozen=True)
class _Aside:
    """How far one track is from the middle of its neighbours', where it is seen."""

    frames: np.ndarray
    """(S,)"""
    off: np.ndarray
    """[m], (S, 3)."""
    beside: np.ndarray
    """What the middle neighbour did [m], (S, 3)."""

    @property
    def steps(self) -> np.ndarray:
        """[m], (S - 1, 3)."""
        return np.diff(self.off, axis=0)

    def undoes(self, frame: int, step: np.ndarray) -> bool:
        """Whether it makes the opposite of a step [m], (3,), to a frame."""
        n = int(np.searchsorted(self.frames, frame)) - 1
        if n < 0 or n + 1 >= len(self.frames) or self.frames[n + 1] != frame:
            return False
        return _undone(self.steps[n], step)


def _undone(out: np.ndarray, back: np.ndarray) -> bool:
    """Whether steps [m], (3,) each, undo one another."""
    return bool(np.linalg.norm(out + back) < BACK * max(np.linalg.norm(out), np.linalg.norm(back)))


def strayed(rest: np.ndarray, moved: np.ndarray, seen: np.ndarray, motion: Motion, fps: float) -> np.ndarray:
    """Which samples are another point's, (K, T) bool.

    rest: where points sit at rest [m], (K, 3); moved: their displacement [m], (K, T, 3); seen: (K, T) bool.
    """
    gone = np.zeros(seen.shape, bool)
    points = np.flatnonzero(seen.sum(1) > 2)
    if len(points) <= LEAST:
        return gone
    frame = np.arange(seen.shape[1])
    path = np.zeros_like(moved)
    for k in points:
        for a in range(3):
            path[k, :, a] = np.interp(frame, frame[seen[k]], moved[k, seen[k], a])
    apart = np.linalg.norm(rest[points][:, None] - rest[points][None], axis=-1)
    near = np.argsort(apart, axis=1)[:, 1 : BESIDE + 1]
    gripped = np.zeros((len(points), seen.shape[1]), bool)
    for center, radius, active in zip(motion.center_rest, motion.radius, motion.active, strict=True):
        acts = np.convolve(active, np.ones(2 + round(RINGS * fps)))[: seen.shape[1] + 1] > 0
        gripped |= (np.linalg.norm(rest[points] - center, axis=1) <= REACH * radius)[:, None] & (acts[1:] | active)
    tracks = []
    for k, others in zip(points, near, strict=True):
        there = frame[seen[k]]
        beside = np.median(path[points[others]][:, there], axis=0)
        tracks.append(_Aside(there, moved[k, there] - beside, beside))
    middles = np.array([np.median(np.linalg.norm(t.steps, axis=1)) for t in tracks])
    usual = float(np.median(middles))
    for k, track, middle, by_grip, others in zip(points, tracks, middles, gripped, near, strict=True):
        partners = [tracks[j] for j in others[:PARTNERS]]
        gone[k, _away(track, CLEAR_STEP * max(middle, usual), by_grip, partners)] = True
    return gone


def _away(track: _Aside, least: float, by_grip: np.ndarray, partners: list[_Aside]) -> np.ndarray:
    """Frames between a step aside of more than `least` [m] and the one that undoes it.

    by_grip: frames in which a grip may make it step, (T,) bool; where it may have made both steps, one of `partners`
    must make the opposite ones.
    """
    steps, size = track.steps, np.linalg.norm(track.steps, axis=1)
    theirs = np.linalg.norm(np.diff(track.beside, axis=0), axis=1)
    large = np.flatnonzero((size > least) & (size > APART * theirs))
    found: list[np.ndarray] = []
    n = 0
    while n + 1 < len(large):
        out = large[n]
        back = next((m for m in range(n + 1, len(large)) if _undone(steps[out], steps[large[m]])), None)
        if back is not None and not _stays(track.off, out, large[back]):
            back = None
        if back is not None:
            both = [(int(track.frames[m + 1]), steps[m]) for m in (out, large[back])]
            if all(by_grip[t] for t, _ in both) and not any(all(p.undoes(*one) for one in both) for p in partners):
                back = None
        if back is None:
            n += 1
            continue
        found.append(track.frames[out + 1 : large[back] + 1])
        n = back + 1
    return np.concatenate(found) if found else np.zeros(0, int)


def _stays(off: np.ndarray, out: int, back: int) -> bool:
    """Whether a track lies aside after a step as the step says: what came back from one bad sample does not."""
    before = np.median(off[max(out - SOME + 1, 0) : out + 1], axis=0)
    aside = np.median(off[out + 1 : min(out + SOME, back) + 1], axis=0)
    return bool(np.linalg.norm(aside - before) > 0.5 * np.linalg.norm(off[out + 1] - off[out]))
