"""Whether the tissue about an instrument's jaws goes where the jaws go, frame by frame."""

from dataclasses import dataclass

import numpy as np

from surgisim.perception.grasp.contact import own_flow
from surgisim.perception.grasp.instruments import JAWS, Instrument

WINDOW = 2
"""Frames before and after, over which motions are compared."""
AROUND = 0.07
"""How far from the jaws tissue still tells what they do to it, as a share of the longer image side."""
APART = 0.25
"""How far from every instrument tissue tells what moves without being touched, as a share of the longer image side."""
FEW = 4
"""Points that are too few to tell anything."""
LEADING = 0.75
"""Of the tissue around jaws this quantile of agreement counts: they may hold a fold in front of a wall at rest."""


@dataclass(frozen=True)
class Following:
    agreement: np.ndarray
    """1: the tissue at the jaws goes where they go, 0: one of the two stands, below: they part; NaN: unseen, (T,)."""
    way: np.ndarray
    """How far jaws or tissue go within the window, against the rest of the picture [px], (T,)."""
    jaws: np.ndarray
    """The jaws' motion to the next frame [px], NaN where it is not seen, (T, 2)."""
    pushing: np.ndarray
    """Cosine of the angle between the jaws' way and the instrument's own direction, (T,)."""
    tissue: np.ndarray
    """That of the tissue which follows them best [px], (T, 2)."""


def jaw_motion(flow: np.ndarray, instrument: Instrument, side: int) -> np.ndarray:
    """The jaws' motion to the next frame [px], or that of what is seen nearest to them, NaN without, (T, 2)."""
    out = np.full((len(instrument.mask), 2), np.nan)
    y, x = np.mgrid[: flow.shape[1], : flow.shape[2]]
    for t in range(len(flow)):
        if np.isfinite(instrument.tip[t]).all():
            own = own_flow(flow[t], instrument.mask[t], instrument.mask[t + 1])
            away = np.hypot(x - instrument.tip[t, 0], y - instrument.tip[t, 1])[own]
            if len(away):
                close = away < max(JAWS * side, away.min() + 0.5 * JAWS * side)
                out[t] = np.median(flow[t][own][close], axis=0)
    return out


def following(
    xy: np.ndarray,
    seen: np.ndarray,
    at_jaws: np.ndarray,
    touched: np.ndarray,
    jaws: np.ndarray,
    outward: np.ndarray,
    side: int,
) -> Following:
    """xy: tissue points [px], (K, T, 2). seen: (K, T) bool. at_jaws: their distance to the jaws, touched: to the
    nearest of all instruments [px], (K, T). jaws: the jaws' motion (T, 2) [px]. outward: which way the instrument
    points, (T, 2). side: longer image side [px].
    """
    frames = xy.shape[1]
    agreement, way, pushing = np.full(frames, np.nan), np.zeros(frames), np.zeros(frames)
    tissue = np.full((frames, 2), np.nan)
    for t in range(frames - 1):
        a, b = max(t - WINDOW, 0), min(t + 1 + WINDOW, frames - 1)
        known = seen[:, a] & seen[:, b] & seen[:, t] & seen[:, t + 1]
        near = known & (at_jaws[:, t] < AROUND * side)
        tool = jaws[a:b].sum(0)
        if near.sum() < FEW:
            continue
        rest = known & (touched[:, t] > APART * side)
        drift = np.median(xy[rest, b] - xy[rest, a], axis=0) if rest.sum() > 10 else np.zeros(2)
        moved, tool = xy[near, b] - xy[near, a] - drift, tool - drift
        if not np.isfinite(tool).all():
            continue
        pushing[t] = tool @ outward[t] / max(np.linalg.norm(tool) * np.linalg.norm(outward[t]), 1e-9)
        long = np.maximum(np.linalg.norm(moved, axis=-1), np.linalg.norm(tool))
        alike = 1.0 - np.linalg.norm(moved - tool, axis=-1) / np.maximum(long, 1e-6)
        agreement[t] = np.quantile(alike, LEADING)
        lead = alike >= agreement[t]
        way[t] = np.median(long[lead])
        tissue[t] = np.median((xy[near, t + 1] - xy[near, t])[lead], axis=0)
    return Following(agreement, way, jaws, pushing, tissue)
