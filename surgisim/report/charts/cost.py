"""What each stage cost in time and memory."""

from surgisim.report.charts.paper import address, sheet
from surgisim.report.palette import INK, RECONSTRUCTION, TOOL


def cost(stages: dict[str, dict[str, float]]) -> str | None:
    """Bars of wall time and of peak memory; None when nothing was measured."""
    names = [n for n, c in stages.items() if "seconds" in c]
    if not names:
        return None
    with sheet(6.0, 0.9 + 0.24 * len(names)) as figure:
        left, right = figure.subplots(1, 2, sharey=True)
        for axes, key, unit, color in (
            (left, "seconds", "wall time [s]", RECONSTRUCTION),
            (right, "peak_mb", "peak memory [MB]", TOOL),
        ):
            values = [stages[n].get(key, 0.0) for n in names]
            bars = axes.barh(names, values, color=color, height=0.62)
            texts = [
                f"{stages[n][key]:,.0f}"
                if stages[n].get(key, 0) >= 10
                else f"{stages[n][key]:.1f}"
                if key in stages[n]
                else "not measured"
                for n in names
            ]
            axes.bar_label(bars, texts, padding=3, fontsize=7.5, color=INK)
            axes.set_xlabel(unit)
            axes.grid(axis="y", visible=False)
            axes.margins(x=0.2)
        left.invert_yaxis()
        return address(figure)
