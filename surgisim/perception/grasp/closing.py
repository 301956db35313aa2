"""Jaws that close on tissue, and open when they let it go: how wide an instrument is at its tip."""

import numpy as np

from surgisim.perception.grasp.instruments import JAWS, Instrument

AHEAD = 0.03
"""How far ahead of the tip a jaw may reach, as a share of the longer image side."""
WIDER, STEADY = 1.5, 1.15
"""Times its width while it holds that an instrument is before and after at its tip, and that it stays below meanwhile;
chosen: jaws of two invented clips are 2.1 to 2.5 times as wide, and vary by 4 %."""
SOON, OFF = 8, 3
"""Frames before and after in which jaws close and open; and by how many a grip's first and last one may be off."""
EDGES = 3, 97
"""Percentiles across the instrument between which its width is measured, against single pixels."""


def closes(tool: Instrument, begin: int, end: int, side: int) -> bool:
    """Whether the jaws close about frame `begin`, stay so, and open about `end`: no camera that moves shows that."""
    first, last = begin + OFF, end - OFF
    before, after = range(max(begin - SOON, 0), first), range(last + 1, min(end + SOON + 1, len(tool.mask)))
    held = np.array([_width(tool, t, side) for t in range(first, last + 1)])
    if not len(held) or np.isfinite(held).mean() < 0.5:
        return False
    usual = float(np.nanmedian(held))
    steady = np.nanquantile(held, 0.9) < STEADY * usual
    return bool(steady and all(_widest(tool, frames, side) > WIDER * usual for frames in (before, after)))


def _widest(tool: Instrument, frames: range, side: int) -> float:
    widths = [w for t in frames if np.isfinite(w := _width(tool, t, side))]
    return max(widths, default=0.0)


def _width(tool: Instrument, t: int, side: int) -> float:
    """Across the instrument at its jaws [px]; NaN where they are not seen."""
    along = tool.tip[t] - tool.entry[t]
    if not np.isfinite(along).all() or not along.any():
        return np.nan
    along = along / np.linalg.norm(along)
    y, x = np.nonzero(tool.mask[t])
    off = np.stack([x, y], -1) - tool.tip[t]
    behind = -off @ along
    jaws = off[(behind > -AHEAD * side) & (behind < JAWS * side)]
    if not len(jaws):
        return np.nan
    low, high = np.percentile(jaws @ [-along[1], along[0]], EDGES)
    return float(high - low)
