"""Y-T slices of the recording and of what was made of it, under one another."""

from collections.abc import Callable
from typing import TypeVar

import numpy as np
from matplotlib.figure import Figure

from surgisim.report.charts.paper import sheet

Drawn = TypeVar("Drawn", str, bytes)
DPI = 140


def slices(
    pictures: dict[str, np.ndarray],
    duration: float,
    phase_ends: list[float],
    drawn: Callable[[Figure, int], Drawn],
) -> Drawn:
    """Slices (H, T, 3) uint8 by name on one time axis [s]; `phase_ends` [s] are drawn across all.

    drawn: what makes a file of the figure, `photograph` or `png`.
    """
    with sheet(12.0, 0.35 + 1.75 * len(pictures)) as figure:
        panels = figure.subplots(len(pictures), sharex=True, squeeze=False)[:, 0]
        for axes, (name, picture) in zip(panels, pictures.items(), strict=True):
            axes.grid(False)
            height = picture.shape[0]
            axes.imshow(picture, extent=(0, duration, height - 0.5, -0.5), aspect="auto", interpolation="nearest")
            for t in phase_ends:
                axes.axvline(t, color="white", lw=1.4, ls=(0, (3, 3)))
                axes.axvline(t, color="black", lw=0.8, ls=(0, (3, 3)))
            axes.set_ylabel(f"{name}\ny [px]")
        panels[-1].set_xlabel("time [s]")
        return drawn(figure, DPI)
