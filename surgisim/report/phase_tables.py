"""Numbers told phase by phase as tables: the replay beside a still and a rigid body, and the stages before it."""

from typing import Any

from surgisim.measure.spans import SPANS
from surgisim.report.digits import short, shown, spread
from surgisim.report.goals import RIGID, STILL, STILL_TRUE, mark
from surgisim.report.tables_base import Cell, Table

NAMES = {"load": "load", "hold": "hold", "released": "released", "held_on": "hold and after", "pull": "load and after"}
BODIES = {
    "": "replay",
    "_still": "if nothing moved",
    "_rigid": "rigid with the grip",
    "_of_still": "replay, % of still",
    "_of_rigid": "replay, % of rigid",
}
QUANTITIES = (
    ("masking", "tool_iou_{span}", "instrument mask, overlap with the truth"),
    ("tracking", "moving_{span}", "tracks of moving points, median off the truth"),
    ("tracking", "moving_{span}_still", "the same if said to stay in their place"),
    ("tracking", "moving_{span}_answered", "share of them that the tracks answer for"),
    ("depth", "change_{span}_true", "true change of depth of moving points, RMS"),
    ("depth", "change_{span}", "depth: error of that change, RMS"),
    ("depth", "change_{span}_share", "depth: the same as a share"),
    ("depth", "replay_change_{span}", "replay: error of that change, RMS"),
    ("depth", "replay_change_{span}_share", "replay: the same as a share"),
    ("depth", "given_change_{span}", "change of depth off the given one, RMS"),
    ("depth", "given_change_{span}_share", "the same as a share"),
    *(
        ("grasp", f"path_{of}_{{span}}{view}_share", f"grip's path {words}, share of its length, RMS{where}")
        for of, words in (("found", "before the fit"), ("fitted", "as fitted"))
        for view, where in (("", ""), ("_across", ", across the view"), ("_along", ", along it"))
    ),
    ("reconstruction", "psnr_between_{span}", "scene, PSNR, held out between"),
    ("reconstruction", "psnr_between_{span}_still", "frame 0 held still, PSNR"),
    ("simulation", "fit_{span}_default", "estimation's own track error, default parameters"),
    ("simulation", "fit_{span}_fitted", "the same, fitted parameters"),
    ("simulation", "fit_{span}_share", "fitted as a share of default"),
)
"""Group, name and title of what has a column a phase."""


def phase_tables(values: dict[str, Any]) -> list[Table]:
    tables = [
        _replay(values.get("simulation", {}), kind, view, f"Replay against {kind} moving points, {where}")
        for kind in ("true", "tracked")
        for view, where in (("", "in space"), ("_px", "in the picture"))
    ]
    return [t for t in [*tables, _stages(values)] if t.rows]


def in_phase_tables() -> set[tuple[str, str]]:
    """Group and name of every number that has its place in one, or in a headline."""
    found = {("simulation", n) for k in ("true", "tracked") for v in ("", "_px") for s in SPANS for n in _row(k, v, s)}
    found |= {(group, name.format(span=span)) for group, name, _ in QUANTITIES for span in SPANS}
    return found | {("reconstruction", f"psnr_between_{span}_gain") for span in SPANS}


def _row(kind: str, view: str, span: str) -> list[str]:
    return [f"{kind}_held_out_{span}_moving{body}{view}" for body in BODIES]


def _replay(entries: dict[str, Any], kind: str, view: str, title: str) -> Table:
    goals = {3: STILL_TRUE if kind == "true" else STILL, 4: RIGID}
    rows, unit, points = [], "", ""
    for span, name in NAMES.items():
        cells = [entries.get(n) for n in _row(kind, view, span)]
        if cells[0]:
            unit = short(cells[0]["unit"])
            points = cells[0]["protocol"].split(", of ", 1)[-1].split(", frames", 1)[0]
            marks = [mark(c, goals[k]) if k in goals and c else "" for k, c in enumerate(cells)]
            rows.append(
                (name, [_cell(c, m) for c, m in zip(cells, marks, strict=True)] + [Cell(str(cells[0]["count"]))])
            )
    head = ["frames never used", *(f"{b} [{unit}]" if k < 3 else b for k, b in enumerate(BODIES.values())), "points"]
    note = f"Mean distance between displacements since frame 0 of {points}, 90 % intervals below the values: points "
    note += f"drawn anew. Goals: {goals[3].words}, {goals[4].words}."
    return Table(title, head, rows, note)


def _stages(values: dict[str, Any]) -> Table:
    rows = []
    for group, name, title in QUANTITIES:
        cells = [values.get(group, {}).get(name.format(span=span)) for span in NAMES]
        if first := next((c for c in cells if c), None):
            unit = f" [{unit}]" if (unit := short(first["unit"])) else ""
            rows.append((title + unit, [_cell(c) for c in cells]))
    return Table("Every stage, phase by phase", ["", *NAMES.values()], rows, "90 % intervals below the values.")


def _cell(entry: dict[str, Any] | None, of: str = "") -> Cell:
    if entry is None:
        return Cell("–")
    return Cell(shown(entry["value"]), entry["protocol"], spread(entry), of)
