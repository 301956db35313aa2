"""When the mismatch and its cause are there, and what the named law gains."""

import numpy as np

from surgisim.report.board.charts import RIGHT, WRONG
from surgisim.report.charts.over_time import Line, over_time
from surgisim.report.charts.paper import address, shade_phases, sheet
from surgisim.report.diagnosed.case import Diagnosed
from surgisim.report.palette import INK, MUTED, RECONSTRUCTION


def mismatch(case: Diagnosed) -> str:
    """RMS over the points that are seen, frame by frame."""
    left = case.mismatch
    lines = [Line("base law", 1e3 * _rms(left.residual_before), WRONG)]
    if case.verdict.names:
        lines.append(Line("named law added", 1e3 * _rms(left.residual_after), RIGHT))
    floor = case.verdict.fit.get("noise_floor")
    level = None if floor is None else (floor, "noise floor")
    return over_time(
        lines, "recorded minus simulated, RMS [mm]", case.time, case.phase, case.split, from_zero=True, level=level
    )


def symptom_and_cause(case: Diagnosed) -> str:
    """Whitened residual and the cause it asks for, both over their greatest, with the onset that was named."""
    left = case.mismatch
    with np.errstate(invalid="ignore"):
        z = np.sqrt(np.nanmean(left.z**2, axis=0))
    cause = np.where(case.split == 0, np.abs(left.cause_time), np.nan)
    with sheet() as figure:
        axes = figure.subplots()
        shade_phases(axes, case.time, case.phase)
        for values, color, name in ((z, RECONSTRUCTION, "symptom"), (cause, WRONG, "cause")):
            top = float(np.nanmax(values, initial=0.0))
            if top > 0:
                axes.plot(case.time, values / top, color=color, label=name)
        for effect in case.verdict.effects if case.verdict.names else ():
            for at, word in ((effect.onset, "onset"), (effect.end, "end")):
                if at:
                    axes.axvline(at, color=INK, lw=1, ls=":")
                    axes.annotate(
                        f"{word} {at:.2f} s", (at, 0.02), (3, 0), textcoords="offset points", fontsize=7.5, color=INK
                    )
        axes.set_ylim(0, 1.12)
        axes.set_xlabel("time [s]")
        axes.set_ylabel("share of the greatest [1]")
        axes.legend(loc="upper right")
        return address(figure)


BARS = (
    ("before", "base law", WRONG),
    ("after", "named law added", RIGHT),
    ("placebo", "placebo: wrong law or wrong place", MUTED),
    ("flexible", "flexible: the most any law could gain", "#b9c1c9"),
    ("oracle", "oracle: true law, true numbers", INK),
    ("noise_floor", "noise floor", "#dfe4e8"),
)


def bars(case: Diagnosed) -> str | None:
    """Errors on the frames that were fitted and on those that never were."""
    groups = [("frames fitted", case.verdict.fit), ("frames held out", case.verdict.held_out)]
    groups = [(name, errors) for name, errors in groups if errors]
    if not groups:
        return None
    shown = [b for b in BARS if any(b[0] in errors for _, errors in groups)]
    if not case.verdict.names:
        # Where nothing is named nothing is modelled, as a rule: then there is no second bar.
        added = any(errors.get("after") != errors.get("before") for _, errors in groups)
        shown = [(k, "law that comes nearest" if k == "after" else w, c) for k, w, c in shown if k != "after" or added]
    with sheet(6.0 * len(groups), 0.9 + 0.34 * len(shown)) as figure:
        for axes, (name, errors) in zip(
            figure.subplots(1, len(groups), squeeze=False, sharex=True)[0], groups, strict=True
        ):
            axes.grid(axis="y", visible=False)
            for row, (key, _, color) in enumerate(shown):
                if key in errors:
                    axes.barh(row, errors[key], color=color, height=0.62)
                    axes.annotate(
                        f"{errors[key]:.3g}",
                        (errors[key], row),
                        (4, 0),
                        textcoords="offset points",
                        va="center",
                        fontsize=8,
                    )
            axes.set_yticks(range(len(shown)), [words for _, words, _ in shown], color=INK)
            axes.set_ylim(len(shown) - 0.5, -0.5)
            axes.margins(x=0.12)
            axes.set_title(name, fontsize=8.5, color=INK)
            axes.set_xlabel("RMS [mm]")
        return address(figure)


def candidates(case: Diagnosed, most: int = 10) -> str | None:
    """Log evidence of the best candidates, from the best down."""
    rows = [c for c in case.verdict.ranking if c.log_evidence is not None][:most]
    if len(rows) < 2:
        return None
    best = max(c.log_evidence for c in rows)
    named = set(case.verdict.names)
    with sheet(6.0, 0.8 + 0.3 * len(rows)) as figure:
        axes = figure.subplots()
        axes.grid(axis="y", visible=False)
        for row, candidate in enumerate(rows):
            behind = best - candidate.log_evidence
            color = RIGHT if candidate.term in named else "#b9c1c9"
            axes.barh(row, candidate.probability, color=color, height=0.6)
            note = f"{100 * candidate.probability:.0f} %" + (
                f", \N{GREEK CAPITAL LETTER DELTA} log evidence \N{MINUS SIGN}{behind:.1f}" if behind else ""
            )
            axes.annotate(
                note,
                (candidate.probability, row),
                (4, 0),
                textcoords="offset points",
                va="center",
                fontsize=7.5,
                color=MUTED,
            )
        axes.set_yticks(range(len(rows)), [c.term.replace("_", " ") for c in rows], color=INK)
        axes.set_ylim(len(rows) - 0.5, -0.5)
        axes.set_xlim(0, 1.0 if max(c.probability for c in rows) < 0.6 else 1.45)
        axes.set_xticks([0, 0.25, 0.5, 0.75, 1.0])
        axes.set_xlabel("probability [1]")
        return address(figure)


def _rms(residual: np.ndarray) -> np.ndarray:
    """RMS length over the seen points of each frame [m], (T,), NaN where none is seen."""
    square = (residual**2).sum(-1)
    seen = np.isfinite(square)
    with np.errstate(invalid="ignore"):
        return np.sqrt(np.where(seen, square, 0).sum(0) / seen.sum(0))
