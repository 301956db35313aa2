"""Every clip's interval beside its truth, parameter by parameter."""

import io
from typing import Any

import matplotlib
import matplotlib.pyplot as plt

from surgisim.report.palette import INK, MUTED, RECONSTRUCTION, REPLAY

matplotlib.use("Agg")


def intervals(result: dict[str, Any]) -> bytes:
    """PNG: a panel a parameter, a line a clip from the low to the high end; 1 is the truth.

    result: as `surgisim.proof.coverage.coverage` gives it. Told and inside are blue, told and outside orange, the
    untold grey.
    """
    parameters = result["parameters"]
    count = max(len(parameters), 1)
    across = min(count, 4)
    down = -(-count // across)
    tall = 1.2 + 0.16 * max((len(r) for r in result["rows"].values()), default=1)
    figure, panels = plt.subplots(
        down, across, figsize=(3.6 * across, tall * down), squeeze=False, layout="constrained"
    )
    for panel in panels.ravel()[count if parameters else 0 :]:
        panel.axis("off")
    for panel, (name, summary) in zip(panels.ravel(), parameters.items(), strict=False):
        rows = sorted(result["rows"][name], key=lambda r: r["value"] / r["true"] if r["true"] else 0.0)
        for k, row in enumerate(rows):
            size = row["true"] or 1.0
            ends = [(row[key] - row["true"]) / size + 1 for key in ("low", "value", "high")]
            color = MUTED if not row["told"] else RECONSTRUCTION if row["inside"] else REPLAY
            panel.plot([ends[0], ends[2]], [k, k], color=color, lw=2, solid_capstyle="butt")
            panel.plot(ends[1], k, "o", color=color, ms=3)
        panel.axvline(1, color=INK, lw=0.8)
        panel.set_yticks([])
        panel.set_xlim(*_reach(rows))
        held = summary["held"]
        panel.set_title(f"{name}: {held['hits']} of {held['count']} told are inside", fontsize=9, loc="left")
        panel.set_xlabel("over the truth [1]", fontsize=8)
        panel.tick_params(labelsize=8)
    stream = io.BytesIO()
    figure.savefig(stream, dpi=110, format="png", metadata={"Software": None})
    plt.close(figure)
    return stream.getvalue()


def _reach(rows: list[dict[str, Any]]) -> tuple[float, float]:
    """Ends of the axis that show the values, but not an interval without end."""
    apart = [abs(r["value"] - r["true"]) / (abs(r["true"]) or 1.0) for r in rows]
    most = max(0.5, 1.3 * max(apart, default=0.5))
    return 1 - most, 1 + most
