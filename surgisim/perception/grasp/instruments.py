"""The instruments of a recording, one by one: which pixels are whose, and where each has its jaws.

An instrument is a piece of mask followed from frame to frame. It enters through the border of what the lamp reaches;
its tip is the end of it that is furthest from there, and its jaws are what lies about the tip.
"""

from dataclasses import dataclass

import cv2
import numpy as np

JAWS = 0.1
"""How far behind the tip the jaws reach, as a share of the longer image side."""
GRAIN = 0.0006
"""Pieces of mask smaller than this are no instrument, as a share of the image."""
GAP = 0.06
"""How far a piece that does not reach the border may lie from the instrument it belongs to, a share of the side."""
TOGETHER = 0.6
"""Share of the frames showing both of two labels in which these are one piece, that makes them one instrument."""


ENTERS = 0.5
"""Share of the frames showing an instrument in which it reaches the border."""
SHRINKS = 0.04
"""By how much the end of a mask falls back or advances, beyond what moves there, if that is the mask's doing and not
the instrument's, as a share of the longer image side."""
BRIEF = 8
"""Frames for which jaws that the mask has lost go on as what is left of it moves; later they lie along its axis."""
AWAITED = 16
"""Frames for which jaws are awaited where the mask shows next to nothing of the instrument."""


@dataclass(frozen=True)
class Instrument:
    mask: np.ndarray
    """(T, H, W) bool."""
    jaws: np.ndarray
    """The part of it about the tip, (T, H, W) bool."""
    tip: np.ndarray
    """[px], NaN where it is not seen, (T, 2)."""
    entry: np.ndarray
    """Where it enters the picture [px], (T, 2)."""


def instruments(tool: np.ndarray, lit: np.ndarray, flow: np.ndarray) -> list[Instrument]:
    """tool: every instrument's pixels, (T, H, W) bool. lit: inside the endoscope's picture, (H, W) bool. flow: of each
    frame to the next [px], (T - 1, H, W, 2).
    """
    edge = _edge(lit)
    label = _followed(tool, edge)
    found = [label == i for i in range(1, label.max() + 1)]
    return [_instrument(mask, edge, flow) for mask in found if _enters(mask, edge)]


def _edge(lit: np.ndarray) -> np.ndarray:
    """Pixels through which an instrument may enter, (H, W) bool."""
    inner = cv2.erode(np.pad(lit.astype(np.uint8), 1), np.ones((7, 7), np.uint8))[1:-1, 1:-1] > 0
    return ~inner


def _followed(tool: np.ndarray, edge: np.ndarray) -> np.ndarray:
    """The instrument each pixel belongs to, 0 for none, (T, H, W) int."""
    out = np.zeros(tool.shape, np.int32)
    last = np.zeros(tool.shape[1:], np.int32)
    count, joined, both = 0, {}, {}
    for t, mask in enumerate(tool):
        now, count = _next(mask, last, edge, count)
        number, pieces = cv2.connectedComponents((now > 0).astype(np.uint8))
        owners = [set(_values(now[pieces == p])) for p in range(1, number)]
        present = sorted(set(_values(now)) - {0})
        for i, a in enumerate(present):
            for b in present[i + 1 :]:
                both[a, b] = both.get((a, b), 0) + 1
                joined[a, b] = joined.get((a, b), 0) + any({a, b} <= o for o in owners)
        out[t] = now
        seen = np.isin(last, present)
        last = np.where(now > 0, now, np.where(seen, 0, last))
    for (a, b), times in joined.items():
        if times > TOGETHER * both[a, b]:
            out[out == b] = a
    left = [i for i in _values(out) if i]
    packed = np.zeros(out.max() + 1, np.int32)
    packed[left] = np.arange(1, len(left) + 1)
    return packed[out]


def _values(label: np.ndarray) -> np.ndarray:
    """The different ones, in order; many times faster than sorting all."""
    return np.flatnonzero(np.bincount(label.ravel()))


def _enters(mask: np.ndarray, edge: np.ndarray) -> bool:
    """Whether a piece reaches in from the border, in enough of the frames that show it."""
    shown = mask.any((1, 2))
    return bool(shown.sum() > 3 and (mask & edge).any((1, 2)).sum() >= ENTERS * shown.sum())


def _next(mask: np.ndarray, last: np.ndarray, edge: np.ndarray, count: int) -> tuple[np.ndarray, int]:
    """The labels of one frame from those of the frame before, and how many there have been."""
    number, pieces, stats, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8), connectivity=8)
    now = np.zeros(mask.shape, np.int32)
    away, owner = _nearest(last)
    side = max(mask.shape)
    strays = []
    for piece in sorted(range(1, number), key=lambda p: -stats[p, 4]):
        here = pieces == piece
        if stats[piece, 4] < GRAIN * mask.size:
            continue
        before = np.bincount(last[here])
        before[0] = 0
        known = np.flatnonzero(before > 0.1 * before.max()) if before.any() else []
        if len(known):
            now[here] = np.where(np.isin(owner[here], known), owner[here], known[before[known].argmax()])
        elif last.any() and away[here].min() < GAP * side:
            now[here] = owner[here][away[here].argmin()]
        elif (here & edge).any():
            count += 1
            now[here] = count
        else:
            strays.append(here)
    away, owner = _nearest(now)
    for here in strays:
        if now.any() and away[here].min() < GAP * side:
            now[here] = owner[here][away[here].argmin()]
        else:
            count += 1
            now[here] = count
    return now, count


def _nearest(label: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Distance of each pixel to the nearest labelled one [px], and its label."""
    if not label.any():
        return np.full(label.shape, np.inf), np.zeros(label.shape, np.int32)
    away, index = cv2.distanceTransformWithLabels(
        (label == 0).astype(np.uint8), cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL
    )
    owner = np.zeros(index.max() + 1, np.int32)
    owner[index[label > 0]] = label[label > 0]
    return away, owner[index]


def _instrument(mask: np.ndarray, edge: np.ndarray, flow: np.ndarray) -> Instrument:
    side = max(mask.shape[1:])
    y, x = np.mgrid[: mask.shape[1], : mask.shape[2]].astype(float)
    entry = _entries(mask, edge)
    tip, jaws = np.full((len(mask), 2), np.nan), np.zeros_like(mask)
    end, reckoned, lacks, missed, cut = None, None, 0.0, 0, 0
    for t in range(len(mask)):
        near = mask[t] if end is None else mask[t] & _reachable(x, y, end, entry[t], side)
        found = _end(near, entry[t], x, y) if near.any() else None
        if end is not None and found is not None:
            # What of an instrument the mask loses or finds again at its end is still there, or was there before.
            shorter = np.linalg.norm(end - entry[t]) - np.linalg.norm(found - entry[t])
            if shorter > 2 * JAWS * side:
                found = None
            elif shorter > SHRINKS * side:
                lacks, cut = min(lacks + shorter, JAWS * side), 0
            elif np.linalg.norm(found - end) > SHRINKS * side:
                lacks = max(lacks - np.linalg.norm(found - end), 0.0)
        missed = 0 if found is not None else missed + 1
        if missed > AWAITED:
            found, lacks, missed = (_end(mask[t], entry[t], x, y) if mask[t].any() else None), 0.0, 0
        end = end if found is None else found
        if end is None:
            continue
        if lacks < SHRINKS * side and found is not None:
            lacks, reckoned = 0.0, end
        elif lacks and cut > BRIEF:
            reckoned = end + lacks * (end - entry[t]) / max(np.linalg.norm(end - entry[t]), 1e-9)
        cut += 1
        if mask[t].any():
            tip[t] = reckoned
            about = np.hypot(x - tip[t, 0], y - tip[t, 1])
            jaws[t] = (mask[t] & (about < JAWS * side)) | (about < 0.5 * SHRINKS * side)
        if t < len(flow):
            own = mask[t] & (np.hypot(x - end[0], y - end[1]) < 3 * JAWS * side)
            step = np.median(flow[t][own], axis=0) if own.any() else 0.0
            end, reckoned = end + step, reckoned + step
    return Instrument(mask, jaws, tip, entry)


def _reachable(x: np.ndarray, y: np.ndarray, end: np.ndarray, entry: np.ndarray, side: int) -> np.ndarray:
    """Where the end of a mask can be that was at `end`: about there, or behind it along the instrument, (H, W) bool."""
    axis = (end - entry) / max(np.linalg.norm(end - entry), 1e-9)
    along = (x - end[0]) * axis[0] + (y - end[1]) * axis[1]
    aside = np.abs((x - end[0]) * axis[1] - (y - end[1]) * axis[0])
    away = np.hypot(x - end[0], y - end[1])
    return (away < JAWS * side) | ((along < 0) & (aside < 0.8 * JAWS * side) & (away < 2 * JAWS * side))


def _end(mask: np.ndarray, entry: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """The end of a mask (H, W) that is furthest from its entry [px], (2,)."""
    side = max(mask.shape)
    far = np.where(mask, np.hypot(x - entry[0], y - entry[1]), -1.0)
    top = np.unravel_index(far.argmax(), far.shape)
    end = (far > far.max() - 0.02 * side) & (np.hypot(x - top[1], y - top[0]) < 0.04 * side)
    return np.array([x[end].mean(), y[end].mean()])


def _entries(mask: np.ndarray, edge: np.ndarray) -> np.ndarray:
    """Where it enters the picture [px], (T, 2): held over frames that do not show it."""
    where = np.full((len(mask), 2), np.nan)
    for t in range(len(mask)):
        rows, columns = np.nonzero(mask[t] & edge)
        if len(rows):
            where[t] = columns.mean(), rows.mean()
    known = np.flatnonzero(np.isfinite(where[:, 0]))
    if not len(known):
        # It never reaches the border: it comes from the side of the border that is nearest to it.
        rows, columns = np.nonzero(edge)
        for t in np.flatnonzero(mask.any((1, 2))):
            my, mx = (v.mean() for v in np.nonzero(mask[t]))
            near = np.hypot(rows - my, columns - mx).argmin()
            where[t] = columns[near], rows[near]
        known = np.flatnonzero(np.isfinite(where[:, 0]))
    if len(known):
        nearest = known[np.abs(np.arange(len(mask))[:, None] - known).argmin(1)]
        where = where[nearest]
    return where


def nearest(tools: list[Instrument], point: np.ndarray, frame: int) -> int | None:
    """The instrument whose tip is nearest to `point` [px] about a frame; none if there is none."""
    if not tools:
        return None
    return int(np.argmin([np.nanmin(np.linalg.norm(_about(i.tip, frame) - point, axis=-1)) for i in tools]))


def _about(tip: np.ndarray, frame: int) -> np.ndarray:
    known = np.flatnonzero(np.isfinite(tip[:, 0]))
    return tip[known[np.abs(known - frame).argsort()[:3]]]
