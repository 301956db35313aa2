"""Every clip's error beside a still body's, a rigid one's and default parameters'."""

import io
from typing import Any

from matplotlib.backends.backend_agg import FigureCanvasAgg

from surgisim.report.charts.paper import sheet
from surgisim.report.palette import INK, MUTED, RECONSTRUCTION, REPLAY, STILL, TOOL

BODIES = (
    ("still", "still", STILL, "s"),
    ("rigid", "rigid with the grip", TOOL, "D"),
    ("default", "default numbers", RECONSTRUCTION, "^"),
    ("ours", "ours", REPLAY, "o"),
)


def clips(table: dict[str, Any]) -> bytes:
    """PNG: a line a clip, errors as shares of a still body's, with their intervals; variants as small crosses.

    table: as `surgisim.proof.clip_table.clip_table` gives it.
    """
    rows = [r for r in table["rows"] if r["ours"] and r["still"]]
    with sheet(9.0, 1.5 + 0.62 * max(len(rows), 1)) as figure:
        axes = figure.subplots()
        most = 130.0
        for k, row in enumerate(rows):
            size = row["still"]["value"] / 100
            for n, (name, _, color, shape) in enumerate(BODIES):
                if not row[name]:
                    continue
                # The ratio to still, point by point, is narrower than the two intervals apart.
                entry, by = (row["of_still"], 1.0) if name == "ours" else (row[name], size)
                y = k + 0.16 * (n - 1.5)
                if entry["low"] is not None and name != "still":
                    axes.plot([entry["low"] / by, entry["high"] / by], [y, y], color=color, lw=2.2)
                    most = max(most, entry["high"] / by)
                axes.plot(entry["value"] / by, y, shape, color=color, ms=6)
                most = max(most, entry["value"] / by)
            for variant, entry in row["changed"].items():
                axes.plot(entry["value"] / size, k + 0.36, "x", color=MUTED, ms=5)
                axes.annotate(
                    variant.replace("_", " "), (entry["value"] / size, k + 0.36), xytext=(4, -2.5), fontsize=7,
                    textcoords="offset points", color=MUTED,
                )  # fmt: skip
        axes.axvline(100, color=INK, lw=0.8)
        axes.axvline(table["goal_of_still"], color=INK, lw=0.8, ls=":")
        axes.text(table["goal_of_still"], 1.01, "goal", transform=axes.get_xaxis_transform(), ha="center", fontsize=8)
        axes.set_yticks(range(len(rows)), [f"{r['clip']}\n{r['against']} points" for r in rows])
        axes.set_ylim(len(rows) - 0.4, -0.6)
        axes.set_xlim(0, min(1.05 * most, 400))
        axes.set_xlabel("error of moving points on frames never fitted, mean in the picture, % of a still body's")
        for _, label, color, shape in BODIES:
            axes.plot([], [], shape, color=color, label=label)
        figure.legend(*axes.get_legend_handles_labels(), loc="outside upper right", ncols=4, fontsize=8)
        stream = io.BytesIO()
        FigureCanvasAgg(figure).print_png(stream, metadata={"Software": None})
        return stream.getvalue()
