"""Real recordings whose cause is known, as one HTML file."""

from typing import Any

from surgisim.report.page import template


def page(cases: list[dict[str, Any]]) -> bytes:
    """UTF-8; a page of its own lies beside each diagnosis."""
    met = sum(a["met"] is True for c in cases for a in c["answers"])
    asked = sum(len(c["answers"]) for c in cases)
    return template("known.html.j2").render(cases=cases, met=met, asked=asked).encode()
