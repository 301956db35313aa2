"""One number of every variant, clip by clip."""

import numpy as np

from surgisim.report.charts.paper import address, sheet
from surgisim.report.palette import INK, LINE

COLORS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#7a5195", "#1c2127")


def compare(values: dict[str, dict[str, float]], variants: list[str]) -> str:
    """Dots on one line a clip, a colour a variant; values: clip -> variant -> number."""
    with sheet(6.0, 0.95 + 0.2 * len(variants) + 0.36 * len(values)) as figure:
        axes = figure.subplots()
        axes.grid(axis="y", visible=False)
        named: set[str] = set()
        for row, numbers in enumerate(values.values()):
            axes.axhline(row, color=LINE, lw=1, zorder=1)
            shift = np.linspace(-0.2, 0.2, len(variants)) if len(variants) > 1 else [0.0]
            for k, variant in enumerate(variants):
                if variant in numbers:
                    color = COLORS[k % len(COLORS)]
                    label = None if variant in named else variant
                    named.add(variant)
                    axes.plot(numbers[variant], row + shift[k], "o", ms=6.5, color=color, label=label, mec="white")
        axes.set_yticks(range(len(values)), list(values), color=INK)
        axes.set_ylim(len(values) - 0.5, -0.5)
        axes.margins(x=0.08)
        figure.legend(loc="outside lower center", ncols=3)
        return address(figure)
