"""Numbers as a page writes them."""

from typing import Any


def shown(value: float) -> str:
    """Three digits, two below 0.1, without an exponent where that can be read."""
    size = abs(value)
    if value == 0:
        return "0"
    if size >= 1e6 or size < 1e-4:
        return f"{value:.1e}"
    if size >= 1:
        return f"{value:,.{max(0, 3 - len(str(int(size))))}f}"
    return f"{value:.3f}" if size >= 0.1 else f"{value:#.2g}"


def spread(entry: dict[str, Any]) -> str:
    """The 90 % interval, or that there is none; nothing for a number that never has one."""
    if "count" not in entry:
        return ""
    if entry["low"] is None or entry["high"] is None:
        return f"of {entry['count']} only"
    return f"{shown(entry['low'])} – {shown(entry['high'])}"


def short(unit: str) -> str:
    """A unit as there is room for it: mm* is a millimetre of arbitrary scale; nothing for what has none."""
    return "" if unit == "1" else unit.replace("mm, arbitrary scale", "mm*")
