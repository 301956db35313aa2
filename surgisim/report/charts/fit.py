"""How the physical parameters were found, step by step."""

from typing import Any

import numpy as np

from surgisim.report.charts.paper import address, plain_ticks, sheet
from surgisim.report.palette import INK, MUTED, RECONSTRUCTION, REPLAY

COLORS = (RECONSTRUCTION, REPLAY, "#009e73", "#cc79a7", "#e69f00", "#56b4e9")


def fit(history: list[dict[str, Any]]) -> str | None:
    """Cost on the left, parameters relative to their first value on the right; None without two steps.

    history: steps of the rounds, {"round": number, "cost", "law.parameter": value, ...}.
    """
    steps = [row for row in history if "cost" in row]
    if len(steps) < 2:
        return None
    with sheet() as figure:
        left, right = figure.subplots(1, 2)
        at = np.arange(1, len(steps) + 1)
        rounds = [row.get("round") for row in steps]
        costs = np.array([row["cost"] for row in steps], float)
        pieces = descents(steps)
        left.plot(at, costs, "o", ms=3, color=INK)
        for piece in pieces:
            left.plot(at[piece], costs[piece], color=INK)
        left.set_yscale("log")
        left.set_ylabel("cost, weighted squares [1]")
        names = dict.fromkeys(key for row in steps for key in row if "." in key)
        for k, name in enumerate(names):
            values = np.array([row.get(name, np.nan) for row in steps], float)
            first = values[np.isfinite(values)][0]
            # What may go through zero has no place on a logarithmic axis.
            if first and (values[np.isfinite(values)] / first > 0).all():
                color = COLORS[k % len(COLORS)]
                right.plot(at, values / first, "o", ms=3, color=color, label=name)
                for piece in pieces:
                    right.plot(at[piece], values[piece] / first, color=color)
        right.set_ylabel("parameter / its first value [1]")
        right.set_yscale("log")
        plain_ticks(right)
        right.legend(loc="best")
        for axes in (left, right):
            axes.set_xlabel("step")
            axes.xaxis.get_major_locator().set_params(integer=True)
            for k in range(1, len(steps)):
                if rounds[k] != rounds[k - 1]:
                    axes.axvline(at[k] - 0.5, color=MUTED, lw=0.9, ls=":")
        return address(figure)


def descents(steps: list[dict[str, Any]]) -> list[slice]:
    """Runs of steps that go on from one another: of one round, their iterations in order.

    Starts, and whatever else has no iteration, are each one by themselves.
    """
    begins = [
        k
        for k, step in enumerate(steps)
        if k == 0
        or "iteration" not in step
        or step.get("round") != steps[k - 1].get("round")
        or step["iteration"] <= steps[k - 1].get("iteration", -1)
    ]
    return [slice(first, last) for first, last in zip(begins, [*begins[1:], len(steps)], strict=True)]


def field(history: list[dict[str, Any]]) -> str | None:
    """Misfits while parameters were refined per particle; None if they were not.

    history: {"round": "field", "iteration", "track", "judged", "image"}, of which the fit saw track and image.
    """
    rows = [row for row in history if row.get("round") == "field"]
    if len(rows) < 2:
        return None
    with sheet() as figure:
        axes = figure.subplots()
        at = [row["iteration"] for row in rows]
        lines = (("track", "tracks, fitted frames", INK), ("judged", "tracks, frames kept to judge", REPLAY))
        for key, label, color in lines:
            axes.plot(at, [row[key] for row in rows], "o-", ms=3.5, color=color, label=label)
        axes.set_xlabel("iteration")
        axes.set_ylabel("misfit [variances]")
        axes.xaxis.get_major_locator().set_params(integer=True)
        axes.legend(loc="best")
        return address(figure)
