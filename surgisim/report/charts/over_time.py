"""A number of every frame, beside others, with what was going on shaded behind."""

from dataclasses import dataclass

import numpy as np

from surgisim.report.charts.paper import address, mark_held_out, shade_phases, sheet
from surgisim.report.palette import MUTED


@dataclass(frozen=True)
class Line:
    name: str
    values: np.ndarray
    """(T,), NaN where there is none."""
    color: str
    dashed: bool = False
    marked: bool = True
    """Whether frames held out are marked."""


def over_time(
    lines: list[Line],
    label: str,
    time: np.ndarray,
    phase: np.ndarray,
    split: np.ndarray,
    *,
    from_zero: bool = False,
    level: tuple[float, str] | None = None,
) -> str:
    """Lines over time [s]; `label` names the axis and its unit; `level` draws one value across."""
    with sheet() as figure:
        axes = figure.subplots()
        shade_phases(axes, time, phase)
        hollow = False
        for line in lines:
            style = (0, (4, 1.5)) if line.dashed else "-"
            axes.plot(time, line.values, color=line.color, ls=style, label=line.name, lw=1.2 if line.dashed else 1.7)
            if line.marked:
                hollow |= mark_held_out(axes, time, line.values, split, line.color)
        if level is not None:
            axes.axhline(level[0], color=MUTED, lw=0.9, ls=":")
            axes.annotate(
                level[1],
                (1, level[0]),
                xycoords=("axes fraction", "data"),
                fontsize=7.5,
                color=MUTED,
                ha="right",
                va="bottom",
            )
        if hollow:
            axes.plot([], [], "o", ms=3.6, mfc="white", mec=MUTED, label="frame never used in the fit")
        axes.set_xlabel("time [s]")
        axes.set_ylabel(label)
        if from_zero:
            axes.set_ylim(bottom=0)
        axes.margins(y=0.12)
        axes.legend(loc="best")
        return address(figure)
