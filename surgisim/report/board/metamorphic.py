"""Verdicts of perturbed recordings of which nobody knows the cause, as one HTML file."""

from typing import Any

from surgisim.report.board.page import told
from surgisim.report.board.robustness import sets
from surgisim.report.made import Made
from surgisim.report.page import template

Found = dict[str, Any]


def page(found: Found, before: Found | None, made: Made | None = None) -> bytes:
    """UTF-8."""
    content = {"sets": sets(found, before), "told": told, "spread": spread, "mark": mark}
    return template("metamorphic.html.j2").render(**content, made=made).encode()


def mark(old: dict[str, Any] | None, new: dict[str, Any]) -> str:
    """How a verdict's cell is coloured: a law that was not named before stands out."""
    if old is None or (old["law"] is not None and new["law"] is None):
        return ""
    return "yes" if old["law"] == new["law"] else "no"


def spread(found: dict[str, Any]) -> str:
    """Quantiles in a table's cell."""
    if not found["count"]:
        return "–"
    low, middle, high = (found["quantiles"][q] for q in ("0.05", "0.5", "0.95"))
    return f"{low:+.1f}, {middle:+.1f}, {high:+.1f} (n {found['count']}, largest {found['largest']:.1f})"
