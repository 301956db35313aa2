"""Real recordings whose cause is known, as one HTML file."""

from typing import Any

from surgisim.report.charts.paper import address, sheet
from surgisim.report.made import Made
from surgisim.report.page import template
from surgisim.report.palette import RECORDING, REPLAY, TOOL

LINES = (
    ("recorded", "recorded", RECORDING, "-"),
    ("base", "base law", REPLAY, "--"),
    ("named", "named law", TOOL, "-"),
)


def page(cases: list[dict[str, Any]], made: Made | None = None) -> bytes:
    """UTF-8; a page of its own lies beside each diagnosis."""
    met = sum(a["met"] is True for c in cases for a in c["answers"])
    asked = sum(len(c["answers"]) for c in cases)
    pictures = {c["case"]: [(panel(p), p["title"]) for p in c.get("panels", ())] for c in cases}
    return template("known.html.j2").render(cases=cases, met=met, asked=asked, pictures=pictures, made=made).encode()


def panel(told: dict[str, Any]) -> str:
    """What was recorded and never fitted, beside the base and what was named."""
    with sheet(6.0, 3.2) as figure:
        axes = figure.subplots()
        for key, words, color, style in LINES:
            x, y = told[key]
            few = "o" if len(x) < 20 else ""
            axes.plot(x, y, style, marker=few, ms=4, color=color, lw=1.6 if key != "recorded" else 2.2, label=words)
        axes.set_xlabel(told["x"])
        axes.set_ylabel(told["y"])
        figure.legend(loc="outside lower center", ncols=3)
        return address(figure)
