"""How often the intervals of many clips hold the truth, how often a number is told, and how far off it is."""

from collections import defaultdict
from collections.abc import Iterable
from typing import Any

import numpy as np
from scipy.stats import binomtest

from surgisim.artifacts.metrics import Metrics


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
        "held": _share([r["inside"] for r in told]),
        "held_of_all": _share([r["inside"] for r in rows]),
        "told": _share([r["told"] for r in rows]),
        "bias": _spread([_relative(r, r["value"] - r["true"]) for r in told]),
        "width": _spread([abs(_relative(r, r["high"] - r["low"])) for r in told]),
    }


def _relative(row: dict[str, Any], difference: float) -> float:
    """A difference as a share of the truth."""
    return difference / row["true"] if row["true"] else float("nan")


def _share(hits: list[bool]) -> dict[str, Any]:
    """A share with its 95 % interval after Wilson."""
    if not hits:
        return {"hits": 0, "count": 0, "value": None, "low": 0.0, "high": 1.0}
    ends = binomtest(sum(hits), len(hits)).proportion_ci(method="wilson")
    return {"hits": sum(hits), "count": len(hits), "value": float(np.mean(hits)), "low": ends.low, "high": ends.high}


def _spread(values: list[float]) -> dict[str, Any]:
    """Median and quartiles of what is finite."""
    kept = [v for v in values if np.isfinite(v)]
    if not kept:
        return {"count": 0, "median": None, "low": None, "high": None}
    low, median, high = np.percentile(kept, [25, 50, 75]).tolist()
    return {"count": len(kept), "median": median, "low": low, "high": high}


def in_words(result: dict[str, Any]) -> str:
    """A line a parameter, for the terminal."""
    lines = [f"{result['clips']} clips; of what is told, how much of it is inside its 90 % interval [95 % Wilson]:"]
    for name, s in result["parameters"].items():
        held, told = s["held"], s["told"]
        text = f"  {name:18s} inside {held['hits']}/{held['count']} [{held['low']:.0%}-{held['high']:.0%}]"
        text += f", told {told['hits']}/{told['count']}"
        if s["bias"]["median"] is not None:
            text += f", median off by {s['bias']['median']:+.0%}, interval {s['width']['median']:.0%} wide"
        lines.append(text)
    return "\n".join(lines)
