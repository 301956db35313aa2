"""How a measured number is written down: with its unit and how it was measured."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

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


def measured(groups: Mapping[str, Mapping[str, dict[str, Any]]]) -> dict[str, dict[str, Any]]:
    """The groups without what could not be had, and those under `not_measured` as 'group.name'."""
    kept = {g: {n: e for n, e in entries.items() if e["value"] is not None} for g, entries in groups.items()}
    absent = {f"{g}.{n}": e for g, entries in groups.items() for n, e in entries.items() if e["value"] is None}
    return {g: entries for g, entries in kept.items() if entries} | ({NOT_MEASURED: absent} if absent else {})


def _short(value: float) -> float:
    return float(f"{float(value):.6g}")
