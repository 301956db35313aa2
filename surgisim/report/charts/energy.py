"""Whether the simulated body stays a body: its energies and its smallest volume ratio."""

import numpy as np

from surgisim.artifacts.replay import Replay
from surgisim.report.charts.paper import address, shade_phases, sheet
from surgisim.report.palette import MUTED, RECONSTRUCTION, REPLAY


def energy(replay: Replay, phase: np.ndarray) -> str:
    """Elastic and kinetic energy above, smallest det F below; phase (T,) of the replay's frames."""
    with sheet(height=3.5) as figure:
        above, below = figure.subplots(2, sharex=True, height_ratios=(3, 2))
        shade_phases(above, replay.time, phase)
        shade_phases(below, replay.time, phase, named=False)
        micro = 1e6 * np.asarray(replay.energy, float)
        above.plot(replay.time, micro[:, 1], color=RECONSTRUCTION, label="elastic")
        above.plot(replay.time, micro[:, 0], color=REPLAY, label="kinetic")
        above.set_ylabel("energy [µJ]")
        above.legend(loc="best")
        below.plot(replay.time, replay.smallest_volume_ratio, color=RECONSTRUCTION)
        below.axhline(0, color=MUTED, lw=0.9, ls=":")
        below.annotate(
            "inside out at 0 and below", (0.995, 0), xycoords=("axes fraction", "data"), ha="right", va="bottom",
            fontsize=7.5, color=MUTED,
        )  # fmt: skip
        below.set_ylim(min(0.0, float(replay.smallest_volume_ratio.min())) - 0.06, 1.08)
        below.set_ylabel("smallest det F [1]")
        below.set_xlabel("time [s]")
        return address(figure)
