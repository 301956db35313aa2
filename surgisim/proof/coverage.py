"""How often the intervals of many clips hold the truth, how often a number is told, and how far off it is."""

from collections import defaultdict
from collections.abc import Iterable
from typing import Any

from surgisim.artifacts.metrics import Metrics
from surgisim.proof.shares import median, share


def coverage(clips: Iterable[Metrics]) -> dict[str, Any]:
    """Parameter -> shares with their Wilson intervals, bias and median width; and every clip's own numbers.

    A law's number stands under its own name, without the law's: elastic laws differ between fit and truth.
    """
    rows: dict[str, list[dict[str, Any]]] = defaultdict(list)
    count = 0
    for metrics in clips:
        count += 1
        for name, entry in metrics.values.get("physics", {}).items():
            if "inside" in entry:
                rows[plain(name)].append({"clip": metrics.clip, **_of(entry)})
    return {"clips": count, "parameters": {name: _summary(r) for name, r in rows.items()}, "rows": dict(rows)}


def plain(name: str) -> str:
    """'corotated.E' -> 'E', 'newtonian.eta / corotated.E' -> 'eta / E'; what is no law's stays."""
    parts = name.split(" / ")
    return " / ".join(p if p.startswith(("grip ", "held.")) else p.split(".")[-1] for p in parts)


def _of(entry: dict[str, Any]) -> dict[str, Any]:
    return {key: entry[key] for key in ("value", "low", "high", "true", "inside", "told", "unit")}


def _summary(rows: list[dict[str, Any]]) -> dict[str, Any]:
    told = [r for r in rows if r["told"]]
    return {
        "held": share(r["inside"] for r in told).told(),
        "held_of_all": share(r["inside"] for r in rows).told(),
        "told": share(r["told"] for r in rows).told(),
        "bias": median(_relative(r, r["value"] - r["true"]) for r in told),
        "width": median(_width(r) for r in told),
    }


def _relative(row: dict[str, Any], difference: float) -> float | None:
    """A difference as a share of the truth; None where that is nothing."""
    return difference / row["true"] if row["true"] else None


def _width(row: dict[str, Any]) -> float | None:
    """How wide an interval is, as a share of the truth."""
    wide = _relative(row, row["high"] - row["low"])
    return None if wide is None else abs(wide)


def in_words(result: dict[str, Any]) -> str:
    """A line a parameter, for the terminal."""
    lines = [f"{result['clips']} clips; of what is told, how much of it is inside its 90 % interval [95 % Wilson]:"]
    for name, s in result["parameters"].items():
        held, told = s["held"], s["told"]
        text = f"  {name:18s} inside {held['hits']}/{held['count']} [{held['low']:.0%}-{held['high']:.0%}]"
        text += f", told {told['hits']}/{told['count']}"
        if s["bias"]["value"] is not None:
            text += f", median off by {s['bias']['value']:+.0%}, interval {s['width']['value']:.0%} wide"
        lines.append(text)
    return "\n".join(lines)
