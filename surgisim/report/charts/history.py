"""How the reconstruction improved while it was optimised."""

import numpy as np

from surgisim.report.charts.paper import address, plain_ticks, sheet, thousands
from surgisim.report.palette import MUTED, RECONSTRUCTION, REPLAY

NAMES = ("coarse", "trajectory", "refine", "canonical")
SHADES = ("#ffffff", "#f4ead5", "#e7e2ef", "#e0edf3")


def history(rows: np.ndarray) -> str:
    """Loss and PSNR over iterations; rows: iteration, loss, PSNR [dB], Gaussians, phase, (R, 5)."""
    rows = np.asarray(rows, float)
    with sheet() as figure:
        axes = figure.subplots()
        at, loss, quality, phase = rows[:, 0], rows[:, 1], rows[:, 2], rows[:, 4].astype(int)
        first = int(phase.min())
        for k in np.unique(phase):
            span = at[phase == k]
            end = at[min(np.flatnonzero(phase == k)[-1] + 1, len(at) - 1)]
            axes.axvspan(span[0], end, color=SHADES[(k - first) % 4], lw=0, zorder=0)
            name = NAMES[k - first] if k - first < 4 else str(k)
            top = axes.get_xaxis_transform()
            middle = (span[0] + end) / 2
            axes.text(middle, 1.015, name, transform=top, ha="center", va="bottom", fontsize=7.5, color=MUTED)
        many = len(rows) > 40
        if many:  # a step's PSNR is that of one frame, so it jumps from frame to frame
            axes.plot(at, quality, color=RECONSTRUCTION, lw=0.6, alpha=0.35)
        axes.plot(at, _steady(quality) if many else quality, color=RECONSTRUCTION)
        axes.set_xlabel("iteration")
        axes.set_ylabel("PSNR on used frames [dB]", color=RECONSTRUCTION)
        axes.set_xlim(at[0], at[-1])
        thousands(axes)
        other = axes.twinx()
        other.grid(False)
        other.spines["right"].set_visible(True)
        other.plot(at, _steady(loss) if many else loss, color=REPLAY, lw=1.1, ls=(0, (4, 1.5)))
        other.set_ylabel("loss [1]", color=REPLAY)
        if (loss > 0).all():
            other.set_yscale("log")
            plain_ticks(other)
        return address(figure)


def _steady(values: np.ndarray, reach: int = 7) -> np.ndarray:
    """Running median over 2 `reach` + 1 rows, fewer at the ends."""
    return np.array([np.median(values[max(k - reach, 0) : k + reach + 1]) for k in range(len(values))])
