"""Y-T slices of the recording and of what was made of it, under one another."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import numpy as np
from matplotlib.figure import Figure

from surgisim.report.charts.paper import photograph, png, sheet


def slices(pictures: dict[str, np.ndarray], fps: float, phase_ends: Sequence[float]) -> str:
    """Slices (H, T, 3) uint8 by name on one time axis [s]; `phase_ends` [s] are drawn across all."""
    with _drawn(pictures, fps, phase_ends) as figure:
        return photograph(figure, 140)


def slices_png(pictures: dict[str, np.ndarray], fps: float) -> bytes:
    """The same as PNG, without phases; slices may be of different lengths."""
    with _drawn(pictures, fps, ()) as figure:
        return png(figure, 100)


@contextmanager
def _drawn(pictures: dict[str, np.ndarray], fps: float, phase_ends: Sequence[float]) -> Iterator[Figure]:
    with sheet(12.0, 0.35 + 1.75 * len(pictures)) as figure:
        panels = figure.subplots(len(pictures), sharex=True, squeeze=False)[:, 0]
        for axes, (name, picture) in zip(panels, pictures.items(), strict=True):
            axes.grid(False)
            height, frames = picture.shape[:2]
            box = (0, frames / fps, height - 0.5, -0.5)
            axes.imshow(picture, extent=box, aspect="auto", interpolation="nearest")
            for t in phase_ends:
                axes.axvline(t, color="white", lw=1.4, ls=(0, (3, 3)))
                axes.axvline(t, color="black", lw=0.8, ls=(0, (3, 3)))
            axes.set_ylabel(f"{name}\ny [px]")
        panels[0].set_xlim(0, max(picture.shape[1] for picture in pictures.values()) / fps)
        panels[-1].set_xlabel("time [s]")
        yield figure
