"""How a measured number is written down: with its unit and how it was measured."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from surgisim.measure.resample import Estimate

NOT_MEASURED = "not_measured"
"""Group of the numbers that could not be had, with the reason in the place of the protocol."""


def number(
    value: float | None, unit: str, protocol: str, *, series: np.ndarray | None = None, why_not: str = ""
) -> dict[str, Any]:
    """One number, six digits; `series` holds it for every frame, (T,), NaN where it has none.

    A value that is None, NaN or infinite was not measured; `why_not` says why.
    """
    if value is None or not math.isfinite(value):
        return {"value": None, "unit": unit, "protocol": why_not or "there was nothing to measure it on"}
    entry = {"value": _short(value), "unit": unit, "protocol": protocol}
    if series is not None:
        entry["series"] = [_short(v) if math.isfinite(v) else None for v in series]
    return entry


def ranged(
    found: Estimate, unit: str, protocol: str, *, factor: float = 1.0, drawn: str = "points", why_not: str = ""
) -> dict[str, Any]:
    """One number with its 90 % interval, "low" and "high", and how many points or frames it is of, "count".

    factor: from the estimate's unit to `unit`. Both ends are None where there are too few for an interval.
    """
    spread = f"; 90 % interval of {found.count} {drawn} drawn anew" if found.low is not None else ""
    entry = number(factor * found.value, unit, protocol + spread, why_not=why_not)
    if entry["value"] is None:
        return entry
    ends = {end: None if (v := getattr(found, end)) is None else _short(factor * v) for end in ("low", "high")}
    return entry | ends | {"count": found.count}


def measured(groups: Mapping[str, Mapping[str, dict[str, Any]]]) -> dict[str, dict[str, Any]]:
    """The groups without what could not be had, and those under `not_measured` as 'group.name'."""
    kept = {g: {n: e for n, e in entries.items() if e["value"] is not None} for g, entries in groups.items()}
    absent = {f"{g}.{n}": e for g, entries in groups.items() for n, e in entries.items() if e["value"] is None}
    return {g: entries for g, entries in kept.items() if entries} | ({NOT_MEASURED: absent} if absent else {})


def _short(value: float) -> float:
    return float(f"{float(value):.6g}")
