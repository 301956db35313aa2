"""Tables for the page."""

from typing import Any


def table(header: list[str], rows: list[list[Any]]) -> str:
    """A markdown table; floats at three significant digits."""
    lines = [header, ["---"] * len(header), *[[_cell(c) for c in row] for row in rows]]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines) + "\n"


def _cell(value: Any) -> str:
    return f"{value:.3g}" if isinstance(value, float) else str(value)
