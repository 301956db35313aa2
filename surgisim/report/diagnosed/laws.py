"""The named law in its own words: what it is for, its equation, its source, its numbers."""

from dataclasses import dataclass

from surgisim.artifacts.verdict import Effect
from surgisim.report.digits import shown


@dataclass(frozen=True)
class Law:
    title: str
    equation: str
    """Plain characters, one line each; empty where the law has none."""
    words: str
    source: str
    rows: list[tuple[str, str, str]]
    """Number, value with unit, interval."""
    place: str
    time: str


def law(effect: Effect, mark: str = "") -> Law:
    """With the marker of its place. Read from the docstring of the law's file, which every law has."""
    from surgisim.physics.catalogue import catalogue

    known = catalogue().get(effect.term)
    about = (
        known.about
        if known
        else f"{effect.term.replace('_', ' ').capitalize()}, by other laws; physics.json says which."
    )
    title, equation, words, source = told(about)
    return Law(title, equation, words, source, _rows(effect), _place(effect, mark), _time(effect))


def told(docstring: str) -> tuple[str, str, str, str]:
    """First sentence, indented equation, explanation, and the source, which is the last sentence or paragraph."""
    lines = docstring.strip().splitlines()
    equation = [line.rstrip() for line in lines[1:] if line.startswith("    ")]
    rest = [line for line in lines[1:] if line.strip() and not line.startswith("    ")]
    source = max((i for i, line in enumerate(rest) if _begins_source(line)), default=len(rest))
    while source > 0 and source < len(rest) and _begins_source(rest[source - 1]):
        source -= 1
    plain = [line[4:] for line in equation]
    return lines[0], "\n".join(plain), " ".join(rest[:source]), " ".join(rest[source:])


def _begins_source(line: str) -> bool:
    """Sources begin a line with names and hold a year there or in the next line."""
    head = line.split(",")[0].split()
    return "," in line and bool(head) and all(w[0].isupper() or w in ("and", "de", "ten", "van") for w in head)


def _rows(effect: Effect) -> list[tuple[str, str, str]]:
    rows = []
    for name, entry in effect.parameters.items():
        unit = "" if entry.get("unit", "1") == "1" else f" {entry['unit']}"
        low, high = entry.get("low"), entry.get("high")
        between = "not known" if low is None or high is None else f"{shown(low)} to {shown(high)}{unit}"
        rows.append((name, f"{shown(entry['value'])}{unit}", between))
    return rows


def _place(effect: Effect, mark: str) -> str:
    if effect.center is None:
        return "everywhere"
    x, y, z = (f"{1e3 * c:.1f}" for c in effect.center)
    extent = f", radius {1e3 * effect.extent:.1f} mm" if effect.extent else ""
    return f"{mark} ({x}, {y}, {z} mm){extent}".strip()


def _time(effect: Effect) -> str:
    if not effect.onset and not effect.end:
        return "throughout"
    until = f" to {effect.end:.2f} s" if effect.end else " on"
    return f"from {effect.onset or 0.0:.2f} s{until}"
