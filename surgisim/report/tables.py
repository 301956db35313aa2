"""Every number of the run as tables, each with its unit and protocol."""

from typing import Any

from surgisim.artifacts.metrics import Metrics
from surgisim.measure.number import NOT_MEASURED
from surgisim.report.digits import shown, spread
from surgisim.report.phase_tables import in_phase_tables, phase_tables
from surgisim.report.tables_base import Cell, Table

PARTS = {
    "used": "used",
    "held_out": "held out, all",
    "between": "held out between",
    "after": "held out after",
    "released": "after the release",
}


def grids(metrics: Metrics) -> list[Table]:
    """Numbers that make a grid: by phase, then pictures and motions by part of the recording."""
    tables = [*phase_tables(metrics.values), _pictures(metrics.values)]
    for kind, title in (("true", "Replay against true points"), ("tracked", "Replay against tracked points")):
        tables.append(_motions(metrics.values.get("simulation", {}), kind, title))
    return [t for t in tables if t.rows]


def lists(metrics: Metrics) -> list[Table]:
    """All other numbers, one a row, group by group; the last table says what was not measured."""
    gridded = _gridded(metrics.values)
    tables = []
    for group, entries in metrics.values.items():
        if group == NOT_MEASURED:
            tables.append(_absent(entries))
            continue
        rows = [
            (words(name), [_cell(entry), Cell(_unit(entry)), Cell(entry["protocol"])])
            for name, entry in entries.items()
            if (group, name) not in gridded
        ]
        if rows:
            tables.append(Table(words(group).capitalize(), ["number", "value", "unit", "protocol"], rows))
    return tables


def _absent(entries: dict[str, Any]) -> Table:
    """What was not measured, those with the same reason in one row."""
    names: dict[str, list[str]] = {}
    for name, entry in entries.items():
        names.setdefault(entry["protocol"], []).append(words(name.replace(".", ": ", 1)))
    rows = [(", ".join(each), [Cell(why)]) for why, each in names.items()]
    return Table("Not measured", ["numbers", "why not"], rows)


def words(name: str) -> str:
    return name.replace("_", " ")


def _pictures(values: dict[str, Any]) -> Table:
    columns = [(g, m) for g in ("reconstruction", "simulation") for m in ("psnr", "ssim", "lpips")]
    columns = [(g, m) for g, m in columns if any(f"{m}_{p}" in values.get(g, {}) for p in PARTS)]
    unit = {"psnr": "PSNR [dB] ↑", "ssim": "SSIM [1] ↑", "lpips": "LPIPS [1] ↓"}
    group = {"reconstruction": "scene", "simulation": "replay"}
    rows = []
    for part, title in PARTS.items():
        cells = [values.get(g, {}).get(f"{m}_{part}") for g, m in columns]
        if any(cells):
            rows.append((title, [_cell(c) for c in cells]))
    found = {m: e["protocol"] for g, m in columns for p in PARTS if (e := values.get(g, {}).get(f"{m}_{p}"))}
    note = "Mean over the frames of each frame's value. "
    note += " ".join(f"{m.upper()}: {text.split('; ', 1)[-1]}." for m, text in found.items())
    head = ["frames", *(f"{group[g]}, {unit[m]}" for g, m in columns)]
    return Table("Drawn frames against recorded ones", head, rows, note)


MOTIONS = {
    "": "all points, median [{unit}]",
    "_px": "all points, median [px]",
    "_moving": "moving points, mean [{unit}]",
    "_moving_still": "if nothing moved [{unit}]",
    "_moving_px": "moving points, mean [px]",
    "_moving_still_px": "if nothing moved [px]",
}


def _motions(entries: dict[str, Any], kind: str, title: str) -> Table:
    rows, unit, note = [], "mm", ""
    for part, name in PARTS.items():
        cells = [entries.get(f"{kind}_{part}{suffix}") for suffix in MOTIONS]
        if any(cells):
            rows.append((name, [_cell(c) for c in cells]))
            unit = next((c["unit"] for c in cells[:1] if c), unit)
            note = next((c["protocol"] for c in cells if c), note)
    head = ["frames", *(label.format(unit=unit) for label in MOTIONS.values())]
    note = note.partition(", ")[2]
    return Table(title, head, rows, f"Distance between displacements since frame 0. {note[:1].upper()}{note[1:]}.")


def _gridded(values: dict[str, Any]) -> set[tuple[str, str]]:
    pictures = {
        (g, f"{m}_{p}") for g in ("reconstruction", "simulation") for m in ("psnr", "ssim", "lpips") for p in PARTS
    }
    motions = {("simulation", f"{k}_{p}{s}") for k in ("true", "tracked") for p in PARTS for s in MOTIONS}
    return pictures | motions | in_phase_tables()


def _cell(entry: dict[str, Any] | None) -> Cell:
    if entry is None or entry["value"] is None:
        return Cell("–")
    return Cell(shown(entry["value"]), entry["protocol"], spread(entry))


def _unit(entry: dict[str, Any]) -> str:
    return "" if entry["unit"] == "1" else entry["unit"]
