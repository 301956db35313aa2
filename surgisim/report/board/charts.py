"""Pictures of how often, how surely and how well the concealed physics was named."""

from typing import Any

from matplotlib.ticker import LogLocator, NullFormatter

from surgisim.report.charts.paper import address, sheet
from surgisim.report.palette import INK, LINE, MUTED, RECONSTRUCTION, REPLAY, TOOL

RIGHT, WRONG, SILENT = TOOL, REPLAY, "#b9c1c9"
PANELS = 6
"""In a row."""
Board = dict[str, Any]


def reliability(found: dict[str, Any], label: str) -> str | None:
    """Share right against probability stated, with Wilson intervals and counts."""
    if not found["bins"]:
        return None
    with sheet(6.0, 3.6) as figure:
        axes = figure.subplots()
        axes.plot([0, 1], [0, 1], color=MUTED, lw=0.9, ls=":")
        for b in found["bins"]:
            axes.plot([b["stated"]] * 2, [b["low"], b["high"]], color=RECONSTRUCTION, lw=1.2, alpha=0.55)
            axes.plot(b["stated"], b["value"], "o", ms=6, color=RECONSTRUCTION, mec="white")
            axes.annotate(
                f"{b['count']}",
                (b["stated"], b["value"]),
                (6, -3),
                textcoords="offset points",
                fontsize=7.5,
                color=MUTED,
            )
        axes.set_xlim(-0.03, 1.06)
        axes.set_ylim(-0.03, 1.03)
        axes.set_xlabel(f"probability stated, {label}")
        axes.set_ylabel("share that is right")
        return address(figure)


def detection(found: dict[str, Any]) -> str | None:
    """Share named rightly against the ratio of signal to noise, with false alarms at 0."""
    if not found["points"] and not found["false_alarms"]["count"]:
        return None
    with sheet(6.0, 3.5) as figure:
        axes = figure.subplots()
        bins = found["bins"]
        if bins:
            at = [b["snr"] for b in bins]
            axes.fill_between(
                at, [b["low"] for b in bins], [b["high"] for b in bins], color=RECONSTRUCTION, alpha=0.13, lw=0
            )
            axes.plot(
                at, [b["value"] for b in bins], "o-", color=RECONSTRUCTION, ms=6, mec="white", label="named rightly"
            )
            for b in bins:
                axes.annotate(
                    f"{b['hits']}/{b['count']}", (b["snr"], b["value"]), (0, 8), textcoords="offset points",
                    fontsize=7.5, color=MUTED, ha="center",
                )  # fmt: skip
        alarms = found["false_alarms"]
        if alarms["count"]:
            axes.plot([0, 0], [alarms["low"], alarms["high"]], color=REPLAY, lw=1.2, alpha=0.6)
            axes.plot(
                0, alarms["value"], "D", ms=6, color=REPLAY, mec="white", label="false discovery, nothing concealed"
            )
            axes.annotate(
                f"{alarms['hits']}/{alarms['count']}", (0, alarms["value"]), (8, 8), textcoords="offset points",
                fontsize=7.5, color=MUTED,
            )  # fmt: skip
        axes.axvline(3.0, color=MUTED, lw=0.9, ls=":")
        axes.annotate(
            "goals count from here", (3.0, 0.02), (4, 0), textcoords="offset points", fontsize=7.5, color=MUTED
        )
        axes.set_ylim(-0.04, 1.12)
        axes.set_xlim(left=-0.25)
        axes.set_xlabel("effect on the tracked points over the tracking noise, RMS [1]")
        axes.set_ylabel("share")
        figure.legend(loc="outside lower center", ncols=2)
        return address(figure)


def laws(found: dict[str, Any]) -> str | None:
    """A panel a law: the curve with its band, and every single case, the higher the surer of the truth."""
    rows = found["laws"]
    if not rows:
        return None
    across = min(PANELS, len(rows))
    down = -(-len(rows) // across)
    with sheet(12.0, 0.75 + 1.75 * down) as figure:
        panels = figure.subplots(down, across, sharex=True, sharey=True, squeeze=False).ravel()
        for axes in panels[len(rows) :]:
            axes.set_axis_off()
        for axes, row in zip(panels, rows, strict=False):
            axes.fill_between(row["snr"], row["low"], row["high"], color=RECONSTRUCTION, alpha=0.13, lw=0)
            axes.plot(row["snr"], row["value"], color=RECONSTRUCTION)
            for p in (p for p in found["points"] if p["term"] == row["term"]):
                color = RIGHT if p["right"] else WRONG
                axes.plot(
                    p["snr"], p["probability"] or 0.0, "o", ms=5, mfc=color if p["right"] else "white", mec=color,
                    mew=1.3, clip_on=False,
                )  # fmt: skip
            axes.axvline(3.0, color=MUTED, lw=0.9, ls=":")
            axes.set_title(row["term"].replace("_", " "), fontsize=8.5, color=INK, loc="left")
            axes.set_ylim(-0.02, 1.02)
            axes.set_xlim(0, max(6.0, *(p["snr"] for p in found["points"])))
        for axes in panels[len(rows) - across : len(rows)]:
            axes.tick_params(labelbottom=True)
            axes.set_xlabel("effect over noise [1]")
        first = panels[0]
        first.plot([], [], color=RECONSTRUCTION, label="probability of the right name, 95 % band")
        first.plot([], [], "o", ms=5, color=RIGHT, mew=1.3, label="a case named rightly")
        first.plot([], [], "o", ms=5, mfc="white", mec=WRONG, mew=1.3, label="a case that was not")
        figure.legend(loc="outside lower center", ncols=3)
        return address(figure)


def held_out(rows: list[dict[str, Any]]) -> str | None:
    """Error on the manipulation never fitted: before and after, beside placebo, oracle and noise floor."""
    rows = [r for r in rows if r["before"] is not None and r["after"] is not None]
    if not rows:
        return None
    rows = sorted(rows, key=lambda r: (r["kind"] == "nothing", r["row"]))
    with sheet(12.0, 1.2 + 0.24 * len(rows)) as figure:
        axes = figure.subplots()
        axes.grid(axis="y", visible=False)
        for y, row in enumerate(rows):
            axes.plot([row["before"], row["after"]], [y, y], color=LINE, lw=3.4, solid_capstyle="butt", zorder=1)
            for key, mark, color, size in MARKS:
                if row.get(key) is not None:
                    axes.plot(row[key], y, mark, ms=size, color=color, mec="white" if mark in "oD" else color, zorder=3)
        for key, mark, color, size in MARKS:
            axes.plot([], [], mark, ms=size, color=color, label=LEGEND[key])
        axes.set_yticks(range(len(rows)), [r["row"].replace("_", " ") for r in rows], fontsize=7.5, color=INK)
        axes.set_ylim(len(rows) - 0.4, -0.6)
        # Logarithmic, since what is left is read against a noise floor.
        axes.set_xscale("log")
        axes.xaxis.set_major_locator(LogLocator(subs=(1, 1.5, 2, 3, 4, 5, 6, 7, 8)))
        axes.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
        axes.xaxis.set_minor_formatter(NullFormatter())
        axes.set_xlabel("RMS over visible points of the held-out manipulation [mm]")
        figure.legend(loc="outside lower center", ncols=4)
        return address(figure)


MARKS = (
    ("oracle", "|", INK, 11),
    ("placebo", "x", MUTED, 6),
    ("before", "o", REPLAY, 7),
    ("after", "o", RIGHT, 7),
)
LEGEND = {
    "before": "base law",
    "after": "named law added",
    "placebo": "placebo (as stated)",
    "oracle": "oracle = noise floor",
}
