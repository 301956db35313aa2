"""The scoreboard as one HTML file, and its cases as a table."""

import csv
import io
from typing import Any

from surgisim.report.board import charts
from surgisim.report.digits import shown
from surgisim.report.headline import Card
from surgisim.report.made import Made
from surgisim.report.page import template

Board = dict[str, Any]


def page(board: Board, made: Made | None = None) -> bytes:
    """UTF-8, with every picture inside."""
    found = board["calibration"]
    pictures = {
        "detection": charts.detection(board["detection"]),
        "laws": charts.laws(board["detection"]),
        "named": charts.reliability(found["named"], "of names in verdicts"),
        "candidates": charts.reliability(found["candidates"], "of every candidate"),
        "held_out": charts.held_out(board["held_out"]),
    }
    content = {"board": board, "pictures": pictures, "cards": cards(board)}
    return (
        template("scoreboard.html.j2").render(**content, made=made, percent=percent, found=told, number=number).encode()
    )


def cards(board: Board) -> list[Card]:
    """The goals, large."""
    rows = []
    for goal in board["goals"]:
        mark = {True: "good", False: "poor", None: "plain"}[goal["met"]]
        value = "–" if goal["value"] is None else percent(goal["value"])
        counted = f"{goal['hits']} of {goal['count']}" if "hits" in goal else f"{goal['count']} cases"
        asked = f"asked: {goal['asked']}; {counted}"
        if goal["low"] is not None and goal["value"] is not None:
            asked += f", 95 % interval {percent(goal['low'])} to {percent(goal['high'])}"
        rows.append(Card(goal["words"], value, "", asked, "", mark))
    return rows


def percent(value: float | None) -> str:
    return "–" if value is None else f"{100 * value:.0f}\u00a0%"


def number(value: float | None) -> str:
    return "–" if value is None else shown(value)


def told(figure: dict[str, Any], unit: str = "%") -> str:
    """A share or a median with its interval, in a table's cell."""
    if figure["value"] is None:
        return "–"
    if "hits" in figure:
        low, high = percent(figure["low"]), percent(figure["high"])
        return f"{percent(figure['value'])} ({figure['hits']}/{figure['count']}; {low} to {high})"
    value = percent(figure["value"]) if unit == "%" else f"{shown(figure['value'])} {unit}"
    if figure["low"] is None:
        return f"{value} (n {figure['count']})"
    low, high = ((percent if unit == "%" else shown)(figure[end]) for end in ("low", "high"))
    return f"{value} ({low} to {high}; n {figure['count']})"


COLUMNS = (
    "recording", "seed", "case", "kind", "concealed", "snr", "snr_set", "snr_held_out", "phases", "verdict", "named",
    "probability", "probability_of_truth", "top1", "top2", "ranked_first", "both", "false_discovery", "held_back",
    "abstained", "place_mm", "place_cells", "onset_frames", "parameters", "before_mm", "after_mm", "placebo_mm",
    "oracle_mm", "noise_floor_mm", "share_of_oracle",
)  # fmt: skip


def table(board: Board) -> bytes:
    """Every case a row, as CSV."""
    stream = io.StringIO()
    writer = csv.DictWriter(stream, COLUMNS, lineterminator="\n", extrasaction="ignore")
    writer.writeheader()
    for case in board["cases"]:
        errors = case["held_out"] or {}
        place = case["places"][0] if case["places"] else {}
        rows = [
            f"{r['name']}={r['value']:.4g} [{r['low']}, {r['high']}] true {r['true']:.4g}" for r in case["parameters"]
        ]
        writer.writerow(
            case
            | {
                "concealed": " + ".join(c["term"] for c in case["concealed"]),
                "phases": " ".join(case["phases"]),
                "named": " + ".join(e["term"] for e in case["named"]),
                "place_mm": place.get("error_mm"),
                "place_cells": place.get("cells"),
                "onset_frames": case["onsets"][0]["frames"] if case["onsets"] else None,
                "parameters": "; ".join(rows),
                **{f"{key}_mm": errors.get(key) for key in ("before", "after", "placebo", "oracle", "noise_floor")},
                "share_of_oracle": errors.get("share"),
            }
        )
    return stream.getvalue().encode()
