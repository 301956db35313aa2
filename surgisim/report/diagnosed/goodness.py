"""How well every frame is met, beside what noise alone gives."""

import numpy as np
from scipy.stats import chi2

from surgisim.report.charts.paper import address, mark_held_out, shade_phases, sheet
from surgisim.report.diagnosed.case import Diagnosed
from surgisim.report.palette import MUTED, RECONSTRUCTION

BAND = (0.05, 0.95)
"""Quantiles of noise."""


def per_frame(case: Diagnosed) -> str | None:
    """Chi square per degree of freedom over time; nothing where the diagnosis does not say it."""
    goodness = case.verdict.goodness
    if goodness is None:
        return None
    # Frames after the last one given were not looked at.
    value = np.full(len(case.time), np.nan)
    value[: len(goodness.per_frame)] = [np.nan if x is None else x for x in goodness.per_frame]
    low, high = band(case)
    with sheet() as figure:
        axes = figure.subplots()
        shade_phases(axes, case.time, case.phase)
        axes.fill_between(case.time, low, high, color=MUTED, alpha=0.3, lw=0, label="90 % of noise alone")
        axes.axhline(1, color=MUTED, lw=0.9, ls=":")
        axes.plot(case.time, value, color=RECONSTRUCTION, label="this recording")
        if mark_held_out(axes, case.time, value, case.split, RECONSTRUCTION):
            axes.plot([], [], "o", ms=3.6, mfc="white", mec=MUTED, label="frame never used in the fit")
        axes.set_xlabel("time [s]")
        axes.set_ylabel("chi square per degree of freedom [1]")
        axes.set_ylim(bottom=0)
        axes.margins(y=0.12)
        axes.legend(loc="best")
        return address(figure)


def band(case: Diagnosed) -> tuple[np.ndarray, np.ndarray]:
    """Between what noise alone stays in nine frames of ten [1], (T,) each, NaN where nothing is seen.

    Three degrees of freedom for every point that is seen, where the diagnosis does not say how many.
    """
    degrees = 3.0 * np.isfinite(case.mismatch.residual_before).all(-1).sum(0)
    told = case.verdict.goodness.degrees
    if told is not None:
        degrees[: len(told)] = told
    degrees = np.where(degrees > 0, degrees, np.nan)
    low, high = (chi2.ppf(quantile, degrees) / degrees for quantile in BAND)
    return low, high
