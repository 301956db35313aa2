"""Tissue about an instrument's tip that tells where its jaws are, where the mask shows only what is behind them too."""

import numpy as np

from surgisim.perception.grasp.following import FEW, WINDOW, Following
from surgisim.perception.grasp.instruments import JAWS, Instrument

BESIDE = 0.02
"""Tissue nearer than this to a mask may be hidden by its rim, as a share of the longer image side."""
CHAIN = 0.06
"""Gaps in hidden tissue, and to the tip, that one pair of jaws may leave, as a share of the longer image side."""
ONCE = 0.3
"""Share of the frames before in which tissue was seen that is now hidden."""
CLOSE, TELLING = 0.05, 0.05
"""How near to the jaws leading tissue is; a way that parts what goes along from what is dragged: shares of the side."""
FOREMOST = 0.8
"""The points that follow best, as a quantile of agreement."""


def just_hidden(xy, seen, touched, tool: Instrument, first: int, last: int, side: int) -> np.ndarray:
    """Where in frame 0 tissue lies that no mask covers and that is not recognised ahead of the tip [px], (N, 2).

    N is 0 if there is too little of it. It was seen before the jaws came, which stand there from frame `first` on.
    """
    found = []
    for t in range(max(first, 1), min(first + 2 * WINDOW, last) + 1):
        if not np.isfinite(tool.tip[t]).all():
            continue
        off, outward = xy[:, t] - tool.tip[t], _outward(tool, t)
        ahead = (off @ outward > -BESIDE * side) & (np.linalg.norm(off, axis=-1) < 1.5 * JAWS * side)
        once = seen[:, :t].mean(1) > ONCE
        found.append(
            _chained(
                np.flatnonzero(ahead & once & ~seen[:, t] & (touched[:, t] > BESIDE * side)),
                xy[:, t],
                tool.tip[t],
                CHAIN * side,
            )
        )
    enough = [f for f in found if len(f) >= FEW]
    if len(enough) <= len(found) / 2:
        return np.zeros((0, 2))
    return xy[np.concatenate(enough), 0]


def _chained(points: np.ndarray, xy: np.ndarray, tip: np.ndarray, gap: float) -> np.ndarray:
    """Those of `points` (indices into xy, (K, 2)) that hang together with the tip over gaps of at most `gap` [px]."""
    left, front, chain = list(points), [tip], []
    while front:
        here = front.pop()
        near = [k for k in left if np.linalg.norm(xy[k] - here) < gap]
        left = [k for k in left if k not in near]
        chain += near
        front += [xy[k] for k in near]
    return np.array(chain, int)


def leading(xy, seen, at_jaws, tool: Instrument, follows: Following, stretch: tuple[int, int], side: int):
    """Middle in frame 0 of the tissue about the tip that follows it best [px], (2,), and how entirely it does, 0-1."""
    first, last = stretch
    way = np.nancumsum(follows.jaws[first : last + 1], axis=0)
    told = np.flatnonzero(np.linalg.norm(way, axis=-1) > TELLING * side)
    n = int(told[0]) + 1 if len(told) else len(way)
    top, way = min(first + n, last), way[n - 1]
    known = np.flatnonzero(np.isfinite(tool.tip[:, 0]))
    t = int(known[np.abs(known - first).argmin()])
    about = np.linalg.norm(xy[:, first] - tool.tip[t], axis=-1) < 2 * CLOSE * side
    near = seen[:, first] & seen[:, top] & about & (at_jaws[:, first] < CLOSE * side)
    if near.sum() < FEW:
        return np.zeros(2), 0.0
    moved = xy[near, top] - xy[near, first]
    long = np.maximum(np.linalg.norm(moved, axis=-1), np.linalg.norm(way))
    alike = 1 - np.linalg.norm(moved - way, axis=-1) / np.maximum(long, 1e-9)
    best = alike >= np.quantile(alike, FOREMOST)
    share = float(np.clip((alike[best].mean() - 0.5) / 0.3, 0, 1))
    return np.median(xy[near, 0][best], axis=0), share


def _outward(tool: Instrument, t: int) -> np.ndarray:
    axis = tool.tip[t] - tool.entry[t]
    return axis / max(np.linalg.norm(axis), 1e-9)
