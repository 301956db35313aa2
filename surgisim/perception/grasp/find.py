"""Find tissue that an instrument holds.

Held tissue moves with the instrument that touches it, further than anything around it and all alike within the jaws;
further off it moves less and less. It is let go when it no longer goes where the instrument goes: it springs back, or
the instrument leaves it.
"""

from dataclasses import dataclass

import numpy as np

from surgisim.perception.grasp.contact import Contact

TOUCH = 0.04
"""How near to the instrument held tissue is, as a share of the longer image side."""
LEAST = 0.015
"""Least displacement of tissue that is worth calling a grasp, as a share of the longer image side."""
ALIKE = 0.15
"""Largest difference of displacement within the held ball, as a share of it."""
REACH = 0.12
"""Largest radius of what jaws can hold, as a share of the longer image side."""
SOON = 8
"""Frames within which tissue that is let go has visibly left."""
MOST = 4
"""Grips looked for."""


@dataclass(frozen=True)
class Grip:
    """One stretch of time in which tissue is held."""

    center: np.ndarray
    """In frame 0 [px], (2,)."""
    radius: float
    """In frame 0 [px]."""
    begin: int
    """First frame in which it is held."""
    end: int
    """Last frame in which it is held."""
    confidence: float
    """0-1."""


def find(start: np.ndarray, moved: np.ndarray, contact: Contact, side: int, cell: float) -> list[Grip]:
    """The grips of a recording, in the order of time.

    start: tissue points on an even grid of frame 0 [px], (K, 2), each standing for `cell` px^2. moved: how far each is
    from there [px], (K, T, 2). contact: the instrument as they meet it. side: longer image side [px].
    """
    free = np.ones(moved.shape[:2], bool)
    grips: list[Grip] = []
    for _ in range(MOST):
        reach = np.where((contact.away < TOUCH * side) & free, np.linalg.norm(moved, axis=-1), 0.0)
        # The fifth furthest point: one stray point is no grasp.
        peak = np.sort(reach, axis=0)[-min(5, len(reach))]
        if not len(peak) or peak.max() < LEAST * side:
            break
        top = int(np.argmax(peak > 0.95 * peak.max()))
        held = _ball(start, moved[:, top], reach[:, top], peak[top], side)
        course = np.median(moved[held], axis=0)
        begin, end = _begin(course, top), _end(course, contact, held, top, side)
        grip, along = _grip(start[held], course, contact, held, (begin, top, end), side, cell)
        if end - begin >= 3 and along > (0.5 if grips else 0.2):
            grips.append(grip)
        free[:, max(begin - 2, 0) : _settled(course, end, len(peak))] = False
    return sorted(grips, key=lambda g: g.begin)


def _ball(start: np.ndarray, moved: np.ndarray, reach: np.ndarray, peak: float, side: int) -> np.ndarray:
    """Points that move as the furthest touched ones do, about where those began, (K,) bool."""
    lead = reach >= 0.85 * peak
    about = np.median(start[lead], axis=0)
    lead &= np.linalg.norm(start - about, axis=-1) < REACH * side
    carried = np.median(moved[lead], axis=0)
    alike = np.linalg.norm(moved - carried, axis=-1) < ALIKE * np.linalg.norm(carried)
    return (alike & (np.linalg.norm(start - about, axis=-1) < REACH * side)) | lead


def _begin(course: np.ndarray, top: int) -> int:
    """The last frame before `top` in which the tissue is in its place."""
    far = np.linalg.norm(course, axis=-1)
    at_home = np.flatnonzero(far[: top + 1] < max(0.3, 0.04 * far[top]))
    return int(at_home[-1]) if len(at_home) else 0


def _end(course: np.ndarray, contact: Contact, held: np.ndarray, top: int, side: int) -> int:
    """The last frame in which the tissue goes where the instrument goes."""
    frames = len(course)
    step = np.diff(course, axis=0)
    tool = np.full((frames - 1, 2), np.nan)
    for t in range(frames - 1):
        there = contact.velocity[held, t]
        there = there[np.isfinite(there).all(-1)]
        if len(there):
            tool[t] = np.median(there, axis=0)
    apart = np.where(np.isfinite(tool), step - tool, 0.0)
    away = np.median(contact.away[held], axis=0)
    for t in range(top, frames - 1):
        soon = min(t + SOON, frames - 1)
        far = np.linalg.norm(course[t])
        seen = np.isfinite(tool[t:soon]).all(-1)
        parted = np.linalg.norm(np.cumsum(apart[t:soon], axis=0), axis=-1)
        fallen = np.linalg.norm(course[t + 1 : soon + 1], axis=-1) < (0.75 if seen.any() else 0.4) * far
        left = away[t + 1 : soon + 1] > 2 * TOUCH * side
        gone = (fallen & ((parted > 0.25 * far) | ~seen.any())) | (left & (parted > 0.25 * far))
        if gone.any():
            until = t + int(np.argmax(gone)) + 1
            jump = np.linalg.norm(apart[t:until] if seen.any() else step[t:until], axis=-1)
            return t + int(np.argmax(jump > 0.3 * jump.max()))
    return frames - 1


def _settled(course: np.ndarray, end: int, frames: int) -> int:
    """The first frame after `end` in which the tissue is still again, or three quarters back."""
    far = np.linalg.norm(course, axis=-1)
    for t in range(end + 1, frames):
        if far[t : t + 4].max() < 0.25 * far[end]:
            return t
    return frames


def _grip(start, course, contact: Contact, held, times: tuple[int, int, int], side: int, cell: float):
    """The grip, and the share of its way on which the instrument was seen to go along."""
    begin, top, end = times
    step = np.diff(course[begin : end + 1], axis=0)
    length = np.linalg.norm(step, axis=-1)
    with_tool = np.zeros(len(step))
    for i, t in enumerate(range(begin, end)):
        there = contact.velocity[held, t]
        there = there[np.isfinite(there).all(-1)]
        if len(there):
            gap = np.linalg.norm(np.median(there, axis=0) - step[i])
            with_tool[i] = gap < 0.5 * length[i] + 0.3
    moving = length > 0.3
    along = float((length * with_tool)[moving].sum() / max(length[moving].sum(), 1e-9))
    touching = float((np.median(contact.away[held, begin : end + 1], axis=0) < 2 * TOUCH * side).mean())
    size = 1 - np.exp(-np.linalg.norm(course[top]) / (2 * LEAST * side))
    radius = float(np.clip(np.sqrt(len(start) * cell / np.pi), 0.015 * side, 0.1 * side))
    confidence = float(size * (0.3 + 0.7 * along) * (0.3 + 0.7 * touching))
    return Grip(start.mean(0), radius, begin, end, confidence), along
