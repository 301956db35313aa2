"""The fitted physics as a table, and what the clip can and cannot tell, in words."""

from dataclasses import dataclass
from typing import Any

from surgisim.artifacts.fit import Fit
from surgisim.artifacts.physics import Physics
from surgisim.report.digits import shown


@dataclass(frozen=True)
class Parameter:
    name: str
    value: str
    interval: str
    unit: str
    told: str
    """yes, no or not said."""
    true: str
    """The true value, on an invented clip."""
    mark: str
    """good where that is inside the interval, poor where it is not, told or not; plain without a truth."""
    inside: str
    """The same in a word."""
    phases: str


def parameters(physics: Physics, fit: Fit, measured: dict[str, Any]) -> list[Parameter]:
    """Every law's parameters, then the numbers and groups that only estimation names.

    measured: the metrics' group of the same name, which has the truth and the scale it is told in.
    """
    rows = {f"{law}.{name}": entry for law, entries in physics.terms.items() for name, entry in entries.items()}
    for name, found in fit.identifiability.items():
        if isinstance(found, dict):
            rows[name] = rows.get(name, {}) | found | measured.get(name, {})
    return [parameter(name, entry) for name, entry in rows.items()]


def parameter(name: str, entry: dict[str, Any]) -> Parameter:
    """A row from {"value", "unit", "low" and "high" or "interval", "told", ...}."""
    low, high = _ends(entry)
    told = entry.get("told", entry.get("identifiable"))
    return Parameter(
        name=name,
        value=_text(entry.get("value")),
        interval=f"{_text(low)} – {_text(high)}" if low is not None and high is not None else "not known",
        unit="" if entry.get("unit") in (None, "1") else str(entry["unit"]),
        told="not said" if told is None else "yes" if told else "no",
        phases=_phases(entry.get("phases")),
        true=_text(entry.get("true")) if "true" in entry else "",
        mark="plain" if "inside" not in entry else "good" if entry["inside"] else "poor",
        inside="" if "inside" not in entry else "inside" if entry["inside"] else "outside",
    )


def _ends(entry: dict[str, Any]) -> tuple[Any, Any]:
    if "interval" in entry and entry["interval"] is not None:
        low, high = entry["interval"]
        return low, high
    return entry.get("low"), entry.get("high")


def _text(value: Any) -> str:
    return shown(value) if isinstance(value, int | float) else "–" if value is None else str(value)


def _phases(phases: Any) -> str:
    if isinstance(phases, dict):
        return ", ".join(f"{name} {share:.0%}" for name, share in phases.items() if share >= 0.005) or "–"
    return ", ".join(map(str, phases or [])) or "–"
