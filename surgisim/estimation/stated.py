"""Track error of default and of fitted parameters on frames never fitted, phase by phase, with intervals."""

from dataclasses import asdict
from typing import Any

import numpy as np

from surgisim.estimation.observation import PHASES
from surgisim.measure.resample import ratio

SPANS = {"load": ("load",), "hold": ("hold",), "released": ("release",), "pull": ("load", "hold", "release")}
"""Name -> the phases in it; the rest before a pull is in none, as every simulation is right there."""


def by_phase(default: np.ndarray, fitted: np.ndarray, phase: np.ndarray) -> dict[str, dict[str, Any]]:
    """Span -> "default", "fitted" [m], and "share", the one over the other [1]: value, low, high, count of points.

    default, fitted: distance of each point in each frame [m], (K, F), NaN where it does not count, the same in both;
    phase: index into PHASES of those frames, (F,).
    """
    found = {}
    for span, names in SPANS.items():
        here = np.isin(phase, [PHASES.index(n) for n in names]) & ~np.isnan(default)
        if here.any():
            before, after = (np.where(here, each, 0.0).sum(1) for each in (default, fitted))
            count = here.sum(1)
            entries = {"default": ratio(before, count), "fitted": ratio(after, count), "share": ratio(after, before)}
            found[span] = {name: asdict(entry) for name, entry in entries.items()}
    return found
