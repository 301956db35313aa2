"""What all charts share: size, type, shading of phases, and how they become an address."""

import io
import itertools
from collections.abc import Iterator
from contextlib import contextmanager

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter

from surgisim.report.palette import INK, LINE, MUTED, PHASE
from surgisim.report.uri import data_uri, jpeg

STYLE = {
    "font.family": "DejaVu Sans",
    "font.size": 8.5,
    "axes.edgecolor": MUTED,
    "axes.labelcolor": INK,
    "axes.linewidth": 0.7,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": LINE,
    "grid.linewidth": 0.6,
    "xtick.color": MUTED,
    "ytick.color": MUTED,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "legend.frameon": False,
    "legend.fontsize": 8,
    "lines.linewidth": 1.7,
    "lines.solid_capstyle": "round",
    "svg.fonttype": "path",
    "svg.hashsalt": "surgisim",
    "image.composite_image": False,
}


@contextmanager
def sheet(width: float = 6.0, height: float = 2.9) -> Iterator[Figure]:
    """A figure [inch of 96 px] in the report's style."""
    with matplotlib.rc_context(STYLE):
        yield Figure((width, height), layout="constrained")


def address(figure: Figure) -> str:
    """The figure as SVG; no clock in it, so the same figure gives the same bytes."""
    stream = io.BytesIO()
    FigureCanvasSVG(figure).print_svg(stream, metadata={"Date": None, "Creator": None})
    return data_uri(stream.getvalue(), "image/svg+xml")


def png(figure: Figure, dpi: int = 150) -> bytes:
    """The figure as PNG; the same figure gives the same bytes."""
    stream = io.BytesIO()
    figure.set_dpi(dpi)
    FigureCanvasAgg(figure).print_png(stream, metadata={"Software": None})
    return stream.getvalue()


def photograph(figure: Figure, dpi: int = 190) -> str:
    """The figure as JPEG: smaller than SVG where pictures fill it."""
    canvas = FigureCanvasAgg(figure)
    figure.set_dpi(dpi)
    canvas.draw()
    return jpeg(np.ascontiguousarray(np.asarray(canvas.buffer_rgba())[..., :3]), 90)


def shade_phases(axes: Axes, time: np.ndarray, phase: np.ndarray, *, named: bool = True) -> None:
    """Colour the time axis by phase and name each along the top; time [s] and phase, (T,)."""
    step = float(np.median(np.diff(time))) if len(time) > 1 else 1.0
    starts = [0, *(np.flatnonzero(phase[1:] != phase[:-1]) + 1), len(phase)]
    axes.set_xlim(time[0], time[-1])
    for first, stop in itertools.pairwise(starts):
        left = time[first] - step / 2
        right = time[stop - 1] + step / 2
        axes.axvspan(left, right, color=PHASE[str(phase[first])], lw=0, zorder=0)
        if named and right - left > 0.09 * (time[-1] - time[0]):
            middle = (max(left, time[0]) + min(right, time[-1])) / 2
            axes.text(
                middle,
                1.015,
                phase[first],
                transform=axes.get_xaxis_transform(),
                ha="center",
                va="bottom",
                fontsize=7.5,
                color=MUTED,
            )


def mark_held_out(axes: Axes, time: np.ndarray, values: np.ndarray, split: np.ndarray, color: str) -> bool:
    """A hollow mark on every frame that was not used; whether there was one to mark."""
    out = (split != 0) & np.isfinite(values)
    axes.plot(time[out], values[out], "o", ms=3.6, mfc="white", mec=color, mew=1.0, zorder=4)
    return bool(out.any())


def thousands(axes: Axes) -> None:
    axes.xaxis.set_major_formatter(lambda value, _: f"{value:,.0f}")


def plain_ticks(axes: Axes) -> None:
    """Numbers without powers of ten along a logarithmic y axis."""
    axes.yaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    axes.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
    axes.yaxis.set_minor_formatter(NullFormatter())
