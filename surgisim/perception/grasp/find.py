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
ATTEMPTS, FEW = 12, 5
"""Displacements looked into, the largest first; points that are too few to tell a grasp."""


SHOWN = 3
"""Held points that must be seen for their way to be known."""
LIKELY, SURE = 0.4, 0.55
"""Least confidence of the first and of any further grip that is reported."""


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


def find(
    start: np.ndarray, moved: np.ndarray, seen: np.ndarray, contact: Contact, side: int, cell: float
) -> list[Grip]:
    """The grips of a recording, in the order of time.

    start: tissue points on an even grid of frame 0 [px], (K, 2), each standing for `cell` px^2. moved: how far each is
    from there [px], (K, T, 2). seen: where that is no guess, (K, T) bool. contact: the instrument as they meet it.
    side: longer image side [px].
    """
    free = seen.copy()
    found: list[tuple[Grip, np.ndarray]] = []
    for _ in range(ATTEMPTS):
        reach = np.where((contact.away < TOUCH * side) & free, np.linalg.norm(moved, axis=-1), 0.0)
        # The fifth furthest point: one stray point is no grasp.
        peak = np.sort(reach, axis=0)[-min(FEW, len(reach))]
        if not len(peak) or peak.max() < LEAST * side:
            break
        top = int(np.argmax(peak > 0.95 * peak.max()))
        held = _ball(start, moved[:, top], reach[:, top], contact.away[:, top] < 1.0, peak[top], side, cell)
        course = np.median(moved[held], axis=0)
        begin = _begin(course, contact, held, top, side)
        end = _end(course, contact, held, seen[held].sum(0) >= SHOWN, top, side)
        grip = _grip(start[held], course, contact, held, seen, (begin, top, end), side, cell)
        if end - begin >= 3 and held.sum() > FEW and grip.confidence > LIKELY:
            found.append((grip, course))
        near = np.linalg.norm(start - grip.center, axis=-1) < REACH * side
        free[near, max(begin - 2, 0) : _settled(course, end, len(peak))] = False
        free[held] = False
    grips: list[tuple[Grip, np.ndarray]] = []
    for grip, course in sorted(found, key=lambda f: -f[0].confidence):
        if (not grips or grip.confidence > SURE) and all(
            _apart(course, grip, other, known, side) for known, other in grips
        ):
            grips.append((grip, course))
    return sorted((g for g, _ in grips), key=lambda g: g.begin)


def _ball(start, moved: np.ndarray, reach: np.ndarray, hidden: np.ndarray, peak: float, side: int, cell: float):
    """Points that move as the furthest touched ones do, and those that the jaws hide among them, (K,) bool."""
    lead = reach >= 0.85 * peak
    # Where most of them are together: what else happens to move as far elsewhere is not of the same grasp.
    close = np.linalg.norm(start[lead][:, None] - start[lead], axis=-1) < REACH * side
    about = start[lead][close.sum(1).argmax()]
    lead &= np.linalg.norm(start - about, axis=-1) < REACH * side
    carried = np.median(moved[lead], axis=0)
    alike = lead | (np.linalg.norm(moved - carried, axis=-1) < ALIKE * np.linalg.norm(carried))
    near = alike & (np.linalg.norm(start - about, axis=-1) < REACH * side)
    for _ in range(5):
        about = start[near].mean(0)
        radius = min(1.2 * np.sqrt(near.sum() * cell / np.pi), REACH * side)
        closer = (alike | hidden) & (np.linalg.norm(start - about, axis=-1) < radius)
        if closer.sum() < 3:
            break
        near = closer
    return near


def _begin(course: np.ndarray, contact: Contact, held: np.ndarray, top: int, side: int) -> int:
    """When the instrument came to stand at the tissue before it took it along."""
    far = np.linalg.norm(course, axis=-1)
    at_home = np.flatnonzero(far[: top + 1] < max(0.3, 0.04 * far[top]))
    begin = int(at_home[-1]) if len(at_home) else 0
    still = np.linalg.norm(contact.mean_velocity(held), axis=-1) < 0.002 * side
    touching = np.median(contact.away[held], axis=0) < TOUCH * side
    first = max(begin - SOON, 0)
    while begin > first and still[begin - 1] and touching[begin - 1]:
        begin -= 1
    return begin


def _end(course: np.ndarray, contact: Contact, held: np.ndarray, shown: np.ndarray, top: int, side: int) -> int:
    """The last frame in which the tissue goes where the instrument goes, as far as it is `shown`, (T,) bool."""
    frames = len(course)
    step = np.diff(course, axis=0)
    tool = contact.mean_velocity(held)[:-1]
    apart = np.where(np.isfinite(tool), step - tool, 0.0)
    away = np.median(contact.away[held], axis=0)
    for t in range(top, frames - 1):
        soon = min(t + SOON, frames - 1)
        far = np.linalg.norm(course[t])
        seen = np.isfinite(tool[t:soon]).all(-1).any()
        parted = np.linalg.norm(np.cumsum(apart[t:soon], axis=0), axis=-1) > 0.25 * far
        back = np.linalg.norm(course[t + 1 : soon + 1], axis=-1) / far
        left = away[t + 1 : soon + 1] - away[t] > 0.15 * far + 0.01 * side
        sudden = (back < 0.5) & (np.arange(len(back)) < SOON / 2)
        gone = parted & (((back < 0.75) & (left | sudden)) | (away[t + 1 : soon + 1] > 2 * TOUCH * side))
        if not seen:
            gone = (back < 0.4) & sudden
        gone &= shown[t + 1 : soon + 1]
        if gone.any():
            until = t + int(np.argmax(gone)) + 1
            jump = np.linalg.norm(apart[t:until] if seen else step[t:until], axis=-1)
            return t + int(np.argmax(jump > 0.3 * jump.max()))
    return frames - 1


def _apart(course: np.ndarray, grip: Grip, other: np.ndarray, known: Grip, side: int) -> bool:
    """Whether this is not the tissue about a grip already known, dragged along by it."""
    first, last = max(grip.begin, known.begin), min(grip.end, known.end)
    if last - first < 3:
        return last < first
    a, b = np.diff(course[first : last + 1], axis=0).ravel(), np.diff(other[first : last + 1], axis=0).ravel()
    alike = (a @ b) / max(np.linalg.norm(a) * np.linalg.norm(b), 1e-9)
    return bool(alike < 0.5 and np.linalg.norm(grip.center - known.center) > 2 * TOUCH * side)


def _settled(course: np.ndarray, end: int, frames: int) -> int:
    """The first frame after `end` in which the tissue is still again, or three quarters back."""
    far = np.linalg.norm(course, axis=-1)
    for t in range(end + 1, frames):
        if far[t : t + 4].max() < 0.25 * far[end]:
            return t
    return frames


def _grip(start, course, contact: Contact, held, seen, times: tuple[int, int, int], side: int, cell: float) -> Grip:
    begin, top, end = times
    along = _along(course, contact.mean_velocity(held), seen[held].sum(0) >= SHOWN, begin, end)
    touching = (np.median(contact.away[held, begin : end + 1], axis=0) < 2 * TOUCH * side).mean()
    size = 1 - np.exp(-np.linalg.norm(course[top]) / (2 * LEAST * side))
    shown = min(1.0, 2.5 * seen[held, begin : end + 1].mean())
    radius = float(np.clip(np.sqrt(len(start) * cell / np.pi), 0.015 * side, 0.1 * side))
    confidence = float(size * (0.3 + 0.7 * along) * (0.3 + 0.7 * touching) * (0.3 + 0.7 * shown))
    return Grip(start.mean(0), radius, begin, end, confidence)


def _along(course: np.ndarray, tool: np.ndarray, shown: np.ndarray, begin: int, end: int) -> float:
    """How far the instrument goes where the tissue goes, 0-1, a few frames at a time; 0.5 if neither can be seen."""
    agreed, total = 0.0, 0.0
    for t in range(begin, end):
        until = min(t + SOON, end)
        if not (shown[t] and shown[until] and np.isfinite(tool[t:until]).all()):
            continue
        tissue, jaws = course[until] - course[t], tool[t:until].sum(0)
        way = max(np.linalg.norm(tissue), np.linalg.norm(jaws))
        agreed += max(way - np.linalg.norm(tissue - jaws), 0.0)
        total += way
    return float(agreed / total) if total > 1.0 else 0.5
