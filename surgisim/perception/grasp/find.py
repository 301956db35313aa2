"""Find tissue that an instrument holds.

Held tissue goes where the jaws go, further than the tissue around it. So each instrument is followed on its own, its
jaws are looked for at its tip, and the tissue about them is asked, frame by frame, whether it goes along. A grip is
a stretch of time in which it does; its place is the tissue that is at the jaws when the stretch begins.
"""

from dataclasses import dataclass, replace

import numpy as np

from surgisim.perception.grasp.closing import closes
from surgisim.perception.grasp.contact import distance
from surgisim.perception.grasp.following import AROUND, WINDOW, Following, following, jaw_motion
from surgisim.perception.grasp.holding import began, held, let_go, recoiled, springs_back
from surgisim.perception.grasp.instruments import Instrument
from surgisim.perception.grasp.jaw_tissue import just_hidden, leading

ALIKE = 0.15
"""Largest difference of displacement within the held ball, as a share of it."""
REACH, SMALL = 0.1, 0.015
"""Largest and least radius of what jaws hold, as a share of the longer image side."""
BEHIND = 0.02
"""How far behind the tip tissue is held, as a share of the longer image side."""
WORTH = 0.008
"""A way of held tissue that is surely more than an error of tracking, as a share of the longer image side."""
NEARBY = (0.25, 0.5)
"""Where tissue is not carried by the jaws themselves: distances from them, as a share of the longer image side."""
LIKELY = 0.5
"""Least confidence of a grip that is reported."""


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
    way: float = 0.0
    """How far the tissue at the jaws is carried at most [px]."""
    instrument: int = -1
    """Whose grip it is; -1 if that is not known."""


def find(
    xy: np.ndarray, seen: np.ndarray, tools: list[Instrument], flow: np.ndarray, side: int, cell: float
) -> list[Grip]:
    """Every grip that may be one, the likeliest first; those above `LIKELY` are to be believed.

    xy: tissue points of an even grid of frame 0 [px], (K, T, 2), each standing for `cell` px^2. seen: where that is no
    guess, (K, T) bool. flow: of each frame to the next [px], (T - 1, H, W, 2). side: longer image side [px].
    """
    if not tools or xy.shape[1] < 4:
        return []
    touched = distance(np.any([i.mask for i in tools], 0), xy)
    candidates: list[tuple[Grip, np.ndarray]] = []
    for index, tool in enumerate(tools):
        at_jaws = distance(tool.jaws, xy)
        follows = following(xy, seen, at_jaws, touched, jaw_motion(flow, tool, side), tool.tip - tool.entry, side)
        for first, last in held(follows, side):
            found = _grip(xy, seen, touched, at_jaws, tool, follows, (first, last), side, cell)
            if found is not None:
                grip, course = found
                candidates.append((replace(grip, instrument=index), course))
    grips: list[tuple[Grip, np.ndarray]] = []
    for grip, course in sorted(candidates, key=lambda c: -c[0].confidence):
        if all(_apart(course, grip, other, known) for known, other in grips):
            grips.append((grip, course))
    return [g for g, _ in grips]


def _grip(
    xy, seen, touched, at_jaws, tool: Instrument, follows: Following, stretch: tuple[int, int], side: int, cell: float
):
    """The grip of one stretch and the course of what it holds [px], (T, 2); none if no tissue is there."""
    frames, (first, last) = xy.shape[1], stretch
    start = xy[:, 0]
    center = _place(xy, seen, touched, at_jaws, tool, follows, (first, last), side)
    if center is None:
        return None
    near = np.argsort(np.linalg.norm(start - center, axis=-1))[:9]
    course = np.median(xy[near] - start[near][:, None], axis=0)
    begin = began(follows, first, side)
    end = recoiled(course, follows, tool.tip, begin, let_go(follows, last, frames))
    if end - begin < 3:
        return None
    far = np.linalg.norm(course - course[begin], axis=-1)[begin : end + 1]
    top = begin + int(far.argmax())
    radius = _radius(start, xy[:, top] - xy[:, begin], center, side, cell)
    sure = springs_back(course, follows, tool.tip, begin, end) or closes(tool, begin, end, side)
    confidence = _confidence(xy, seen, at_jaws, follows, (begin, top, end), side, sure)
    return Grip(center, radius, begin, end, confidence, float(far.max())), course


def _place(xy, seen, touched, at_jaws, tool: Instrument, follows: Following, stretch: tuple[int, int], side: int):
    """Where in frame 0 the tissue lies that is at the jaws as they close [px], (2,); none where they are not seen.

    Of three: a little behind the tip; halfway from the tip to tissue that has just got hidden ahead of it, by jaws that
    the mask lacks; halfway to the tissue about it that goes along as one, as far as any does.
    """
    first, last = stretch
    frames = np.arange(max(first - 3, 0), min(first + 1, last) + 1)
    frames = frames[np.isfinite(tool.tip[frames, 0])]
    if not len(frames):
        return None
    start, ends, inward = xy[:, 0], [], np.nanmedian(tool.entry[frames] - tool.tip[frames], axis=0)
    for t in frames:
        near = np.argsort(np.linalg.norm(xy[:, t] - tool.tip[t], axis=-1))[:6]
        ends.append(tool.tip[t] - np.median(xy[near, t] - start[near], axis=0))
    tip, inward = np.median(ends, axis=0), inward / max(np.linalg.norm(inward), 1e-9)
    hidden = just_hidden(xy, seen, touched, tool, first, last, side)
    if len(hidden):
        return 0.5 * (tip + np.median(hidden, axis=0))
    lead, share = leading(xy, seen, at_jaws, tool, follows, stretch, side)
    return tip + (1 - share) * BEHIND * side * inward + 0.5 * share * (lead - tip)


def _radius(start, moved: np.ndarray, center: np.ndarray, side: int, cell: float) -> float:
    """Of the tissue about `center` that goes as one with it [px]."""
    away = np.linalg.norm(start - center, axis=-1)
    lead = np.median(moved[np.argsort(away)[:6]], axis=0)
    alike = np.linalg.norm(moved - lead, axis=-1) < ALIKE * np.linalg.norm(lead)
    area = (alike & (away < REACH * side)).sum() * cell
    return float(np.clip(np.sqrt(area / np.pi), SMALL * side, REACH * side))


def _confidence(xy, seen, at_jaws, follows: Following, times: tuple[int, int, int], side: int, sure: bool) -> float:
    """How sure it is that this is a grip, 0-1: far enough, together, and not as a camera that moves would show it.

    Then all goes alike, and the jaws with it: here tissue strains about the grip. Or it springs back without the jaws,
    or they are seen to close and open (`sure`).
    """
    begin, top, end = times
    # What the last frames are compared with has been let go, and tissue that springs back goes faster than any pull.
    inside = slice(begin, max(end - WINDOW, begin + 1))
    told = np.isfinite(follows.agreement[inside])
    weight = np.where(told, follows.way[inside], 0.0)
    together = float((weight * np.nan_to_num(follows.agreement[inside])).sum() / max(weight.sum(), 1e-9))
    moved = np.linalg.norm(xy[:, top] - xy[:, begin], axis=-1)
    both = seen[:, begin] & seen[:, top]
    distance = np.minimum(at_jaws[:, begin], at_jaws[:, top])
    near = distance < AROUND * side
    near = near & both if (near & both).sum() >= 4 else near
    rest = both & (distance > NEARBY[0] * side) & (distance < NEARBY[1] * side)
    here = float(np.quantile(moved[near], 0.75)) if near.any() else 0.0
    there = float(np.median(moved[rest])) if rest.sum() > 10 else 0.0
    size = 1 - np.exp(-here / (WORTH * side))
    strain = 1.0 if sure else np.clip(1.5 * (1 - there / max(here, 1e-9)), 0.0, 1.0)
    return float(np.clip(size * np.clip(1.5 * together, 0, 1) * strain * (0.5 + 0.5 * min(1.0, 4 * told.mean())), 0, 1))


def _apart(course: np.ndarray, grip: Grip, other: np.ndarray, known: Grip) -> bool:
    """Whether this is not the tissue about a grip already known, dragged along by it."""
    first, last = max(grip.begin, known.begin), min(grip.end, known.end)
    if last - first < 3:
        return True
    a, b = np.diff(course[first : last + 1], axis=0).ravel(), np.diff(other[first : last + 1], axis=0).ravel()
    alike = (a @ b) / max(np.linalg.norm(a) * np.linalg.norm(b), 1e-9)
    return bool(alike < 0.5)
