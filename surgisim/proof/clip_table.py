"""How far the replay is off moving points on frames never fitted, clip by clip: still, rigid, default, ours.

One protocol for all four: mean distance in the picture of moving points from the first pull on. The default is the run
of another variant, in which no parameter was fitted, so that it goes through the same simulation and measurement; of
several such, the best.
"""

from collections.abc import Iterable
from typing import Any

from surgisim.artifacts.metrics import Metrics
from surgisim.problem import Problem
from surgisim.proof.shares import median

MAIN, DEFAULTS = "main", ("elastic_default", "no_estimation")
SPAN = "pull"
GOAL, ROWS = 60.0, 4
"""Per cent of a still body's error that is to be reached, and in how many clips at least."""


def clip_table(runs: Iterable[Metrics]) -> dict[str, Any]:
    """Rows of all clips, and on how many of them ours is the best and within the goal."""
    clips: dict[str, dict[str, Metrics]] = {}
    for run in runs:
        if run.variant in clips.setdefault(run.clip, {}):
            raise Problem(f"{run.clip}: two runs of variant '{run.variant}' were passed. Pass each metrics.json once.")
        clips[run.clip][run.variant] = run
    rows = [_row(clip, mine) for clip, mine in clips.items() if MAIN in mine]
    measured = [r for r in rows if r["ours"]]
    return {
        "format": "surgisim-clips/1",
        "goal_of_still": GOAL,
        "clips": len(rows),
        "best": sum(r["best"] == "ours" for r in measured),
        "surely_best": sum(bool(r["surely_best"]) for r in measured),
        "within_goal": sum(r["of_still"]["high"] is not None and r["of_still"]["high"] <= GOAL for r in measured),
        "enough": ROWS,
        "medians": {words: found for words, g, n in MEDIANS if (found := _median(clips.values(), g, n))["count"]},
        "rows": rows,
    }


MEDIANS = (
    ("moving true points in space from the hold on, % of still", "simulation", "true_held_out_held_on_moving_of_still"),
    ("change of depth of moving points, % off the true one", "depth", f"change_{SPAN}_share"),
    ("the replay's change of depth, % off the true one", "depth", f"replay_change_{SPAN}_share"),
    ("grip's path as fitted, % of its length", "grasp", f"path_fitted_{SPAN}_share"),
    ("grip's path before the fit, % of its length", "grasp", f"path_found_{SPAN}_share"),
)
"""Words, group and name of what is told of the median clip, where truth is known."""


def _median(clips: Iterable[dict[str, Metrics]], group: str, name: str) -> dict[str, Any]:
    """Over the main runs, with a bootstrap 95 % interval over clips."""
    return median(runs[MAIN].values.get(group, {}).get(name, {}).get("value") for runs in clips if MAIN in runs)


def _row(clip: str, runs: dict[str, Metrics]) -> dict[str, Any]:
    against = "true" if _entry(runs[MAIN], "true", "") else "tracked"
    ours = _entry(runs[MAIN], against, "")
    defaults = {v: e for v in DEFAULTS if v in runs and (e := _entry(runs[v], against, ""))}
    default = min(defaults, key=lambda v: defaults[v]["value"]) if defaults else None
    found = {
        "still": _entry(runs[MAIN], against, "_still"),
        "rigid": _entry(runs[MAIN], against, "_rigid"),
        "default": defaults[default] if default else None,
        "ours": ours,
    }
    known = {name: e for name, e in found.items() if e}
    others = {v: e for v, run in runs.items() if v not in (MAIN, default) and (e := _entry(run, against, ""))}
    return {
        "clip": clip,
        "against": against,
        "unit": "px",
        **found,
        "default_is": default,
        "of_still": _entry(runs[MAIN], against, "_of_still"),
        "of_rigid": _entry(runs[MAIN], against, "_of_rigid"),
        "best": min(known, key=lambda name: known[name]["value"]) if known else None,
        "surely_best": _surely(ours, [e for name, e in known.items() if name != "ours"]) if ours else None,
        "changed": {v: e | {"change": e["value"] - ours["value"]} for v, e in others.items()} if ours else {},
        "causes": _causes(runs[MAIN], against),
    }


def _entry(run: Metrics, against: str, which: str) -> dict[str, Any] | None:
    found = run.values.get("simulation", {}).get(f"{against}_held_out_{SPAN}_moving{which}_px")
    return {key: found[key] for key in ("value", "low", "high", "count")} if found else None


def _surely(ours: dict[str, Any], others: list[dict[str, Any]]) -> bool:
    """Whether all of our interval is below all of theirs; False where one is missing."""
    return ours["high"] is not None and all(e["low"] is not None and ours["high"] < e["low"] for e in others)


CAUSES = (
    ("tracks", "tracking", f"moving_{SPAN}", "median off the truth"),
    ("depth", "depth", f"change_{SPAN}_share", "change of depth off the true one"),
    ("depth", "depth", f"given_change_{SPAN}_share", "change of depth off the given one"),
    ("grip", "grasp", f"path_fitted_{SPAN}_share", "path off the true one"),
    ("grip", "grasp", "center", "place off the true one"),
    ("body", "simulation", "{against}_moving_on_body", "share of moving points that the body has"),
)


def _causes(run: Metrics, against: str) -> list[dict[str, Any]]:
    """How far off each part is that the replay rests on, where that is known."""
    return [
        {"part": part, "words": words, **{key: e.get(key) for key in ("value", "low", "high", "unit")}}
        for part, group, name, words in CAUSES
        if (e := run.values.get(group, {}).get(name.format(against=against)))
    ]


def in_words(table: dict[str, Any]) -> str:
    """A line a clip, for the terminal."""
    lines = [
        "error of moving points from the first pull on, frames never fitted, mean in the picture [px], 90 % intervals:",
        f"  {'clip':16s}{'still':>20s}{'rigid':>20s}{'default':>20s}{'ours':>20s}{'of still':>20s}",
    ]
    for row in table["rows"]:
        cells = [_text(row[name]) for name in ("still", "rigid", "default", "ours")] + [_text(row["of_still"], "%")]
        lines.append(f"  {row['clip']:16s}" + "".join(f"{c:>20s}" for c in cells) + f"   best: {row['best']}")
        lines += [f"    {v}: {_text(e)} ({e['change']:+.3g})" for v, e in row["changed"].items()]
        lines += [f"    {c['part']}, {c['words']}: {_text(c)}{_unit(c)}" for c in row["causes"]]
    for words, m in table["medians"].items():
        ends = f" [{m['low']:.3g}-{m['high']:.3g}]" if m["low"] is not None else ""
        lines.append(f"median of {m['count']} clips, {words}: {m['value']:.3g}{ends}")
    return "\n".join([*lines, verdict(table)])


def verdict(table: dict[str, Any]) -> str:
    return (
        f"ours is the best in {table['best']} of {table['clips']} clips (beyond the intervals in "
        f"{table['surely_best']}), and all of its interval at most {table['goal_of_still']:.0f} % of still in "
        f"{table['within_goal']}, of which {table['enough']} are wanted"
    )


def _unit(entry: dict[str, Any]) -> str:
    return "" if entry["unit"] == "1" else f" {entry['unit']}"


def _text(entry: dict[str, Any] | None, unit: str = "") -> str:
    if entry is None:
        return "–"
    ends = "" if entry.get("low") is None else f" [{entry['low']:.3g}-{entry['high']:.3g}]"
    return f"{entry['value']:.3g}{unit}{ends}"
