"""How the verification's plots look."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from surgisim.report.palette import INK, LINE, MUTED

COLORS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")
"""Okabe and Ito, Color universal design, 2008."""


def panels(count: int) -> tuple[Figure, list[Axes]]:
    """A row of `count` plots."""
    figure = Figure(figsize=(0.6 + 4.2 * count, 3.6), layout="constrained")
    axes = list(np.atleast_1d(figure.subplots(1, count)))
    for ax in axes:
        ax.grid(True, color=LINE, linewidth=0.6)
        ax.set_axisbelow(True)
        ax.spines[["top", "right"]].set_visible(False)
        ax.tick_params(labelsize=8, colors=MUTED)
        ax.xaxis.label.set(fontsize=9, color=INK)
        ax.yaxis.label.set(fontsize=9, color=INK)
        ax.title.set(fontsize=10, color=INK)
    return figure, axes


def legend(ax: Axes, **place: str) -> None:
    """The legend, and, now that the limits are known, readable numbers on logarithmic axes."""
    ax.legend(fontsize=7.5, frameon=False, **place)
    for axis, (low, high) in ((ax.xaxis, ax.get_xlim()), (ax.yaxis, ax.get_ylim())):
        if axis.get_scale() != "log":
            continue
        axis.set_minor_formatter(NullFormatter())
        if high < 200 * low:
            axis.set_major_locator(LogLocator(subs=(1, 2, 5)))
            axis.set_major_formatter(FuncFormatter(lambda value, at: f"{value:g}"))


def reference(ax: Axes, x: list[float], y: float, order: float) -> None:
    """A dashed line of slope `order` through (largest x, y) on logarithmic axes."""
    x = np.array([min(x), max(x)])
    ax.plot(x, y * (x / x[-1]) ** order, "--", color=MUTED, linewidth=1, label=f"slope {order:g}")


def slope(x: list[float], y: list[float]) -> float:
    """Least-squares slope of log |y| over log x."""
    return float(np.polyfit(np.log(x), np.log(np.abs(y)), 1)[0])
