"""All runs side by side: clips times variants."""

import html
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from surgisim.artifacts.metrics import Metrics
from surgisim.problem import Problem
from surgisim.report.charts.compare import compare
from surgisim.report.digits import shown
from surgisim.report.made import Made
from surgisim.report.page import template
from surgisim.report.parameters import Parameter, parameter
from surgisim.report.uri import data_uri


@dataclass(frozen=True)
class Measure:
    group: str
    name: str
    title: str
    better: Literal["higher", "lower", "neither"]
    """neither: no value of it is the best."""


MEASURES = (
    Measure("masking", "tool_iou", "instrument mask, overlap with the truth", "higher"),
    Measure("depth", "true_relative", "depth off the truth, mean", "lower"),
    Measure("depth", "given_relative", "depth off the given one, mean", "lower"),
    Measure("tracking", "median", "tracks off the truth, median", "lower"),
    Measure("depth", "change_pull_share", "change of depth of moving points off the truth, load and after", "lower"),
    Measure("grasp", "path_fitted_pull_share", "grip's path off the true one, share of its length", "lower"),
    Measure("grasp", "center", "gripped centre off the truth", "lower"),
    Measure("reconstruction", "psnr_between", "scene, PSNR, held out between", "higher"),
    Measure("reconstruction", "ssim_between", "scene, SSIM, held out between", "higher"),
    Measure("reconstruction", "lpips_between", "scene, LPIPS, held out between", "lower"),
    Measure("reconstruction", "psnr_first_25", "scene, PSNR, first 25 frames", "higher"),
    Measure("reconstruction", "stretch_95", "splats' longest over shortest radius, 95th percentile", "lower"),
    Measure("scene", "motion_share", "scene, where its field carries tracked points, of still", "lower"),
    Measure("scene", "strain_95", "scene, strain between neighbouring splats, 95th percentile", "lower"),
    Measure("scene", "folded", "scene, surface turned over, worst frame", "lower"),
    Measure("scene", "floating", "scene, opacity before the surface", "lower"),
    Measure("scene", "spikes", "scene, splats that stick out", "lower"),
    Measure("simulation", "true_held_out", "replay off true points, held out, median", "lower"),
    Measure("simulation", "true_held_out_moving", "replay off true moving points, held out, mean", "lower"),
    Measure("simulation", "true_released_moving", "replay off true moving points, after the release", "lower"),
    Measure("simulation", "tracked_held_out", "replay off tracked points, held out, median", "lower"),
    Measure("simulation", "tracked_held_out_moving", "replay off tracked moving points, held out, mean", "lower"),
    Measure("simulation", "tracked_released_moving", "replay off tracked moving points, after the release", "lower"),
    Measure(
        "simulation",
        "true_held_out_pull_moving_of_still",
        "replay off true moving points, load and after, % of a still body's",
        "lower",
    ),
    Measure(
        "simulation", "tracked_held_out_pull_moving_px", "replay off tracked moving points, load and after", "lower"
    ),
    Measure("simulation", "tracked_held_out_pull_moving_of_still_px", "the same, % of a still body's", "lower"),
    Measure("simulation", "psnr_between", "replay, PSNR, held out between", "higher"),
    Measure("simulation", "psnr_after", "replay, PSNR, held out after", "higher"),
    Measure("simulation", "ssim_between", "replay, SSIM, held out between", "higher"),
    Measure("simulation", "lpips_between", "replay, LPIPS, held out between", "lower"),
    Measure("replay", "smallest_det_f", "smallest det F of the replay (1: undeformed)", "neither"),
)
"""What the tables show. A variant that shares a stage with another shows the same number."""

SYMBOLS = {"E": "Young's modulus E", "nu": "Poisson's ratio ν", "eta": "viscosity η"}
"""Parameters of any law that the summary shows."""

PLOTTED = (
    ("reconstruction", "psnr_between"),
    ("reconstruction", "psnr_first_25"),
    ("simulation", "true_held_out_moving"),
    ("simulation", "tracked_held_out_moving"),
    ("simulation", "tracked_released_moving"),
    ("simulation", "psnr_between"),
)


def table(runs: list[Metrics]) -> dict[str, Any]:
    """Clip -> measure -> {"unit", "better", "protocol", "values": variant -> value, "best": variants}."""
    result: dict[str, Any] = {}
    for clip in dict.fromkeys(run.clip for run in runs):
        mine = {run.variant: run for run in runs if run.clip == clip}
        if len(mine) < sum(run.clip == clip for run in runs):
            raise Problem(f"summary: clip '{clip}' has two runs of one variant. Pass each metrics.json once.")
        result[clip] = {f"{m.group}.{m.name}": row for m in MEASURES if (row := _row(m, mine))}
    return result


def _row(measure: Measure, runs: dict[str, Metrics]) -> dict[str, Any] | None:
    entries = {v: run.values.get(measure.group, {}).get(measure.name) for v, run in runs.items()}
    values = {v: entry["value"] for v, entry in entries.items() if entry}
    if not values:
        return None
    first = next(entry for entry in entries.values() if entry)
    if measure.better == "neither" or len(set(values.values())) == 1:
        best = []
    else:
        top = (max if measure.better == "higher" else min)(values.values())
        best = [v for v, value in values.items() if value == top]
    return {
        "title": measure.title,
        "unit": first["unit"],
        "better": measure.better,
        "protocol": first["protocol"],
        "values": values,
        "best": best,
    }


def page(runs: list[Metrics], thumbnails: Sequence[bytes] = (), made: Made | None = None) -> bytes:
    """The summary as one HTML file, UTF-8; thumbnails: a JPEG of each run, in the same order."""
    pictures = {(r.clip, r.variant): data_uri(one, "image/jpeg") for r, one in zip(runs, thumbnails, strict=False)}
    clips = table(runs)
    variants = list(dict.fromkeys(run.variant for run in runs))
    sections = [
        {
            "clip": clip,
            "variants": [v for v in variants if any(v in row["values"] for row in rows.values())],
            "rows": rows,
            "links": {run.variant: _link(run) for run in runs if run.clip == clip},
            "pictures": {v: uri for (name, v), uri in pictures.items() if name == clip},
            "physics": physics([run for run in runs if run.clip == clip]),
            "costs": {run.variant: _cost(run) for run in runs if run.clip == clip},
        }
        for clip, rows in clips.items()
    ]
    figures = list(_figures(clips, variants))
    content = {"sections": sections, "figures": figures, "shown": shown, "runs": runs, "made": made}
    return template("summary.html.j2").render(**content).encode()


def physics(runs: list[Metrics]) -> list[tuple[str, str, dict[str, Parameter]]]:
    """Name, unit and variant -> what was fitted: stiffness, Poisson's ratio and viscosity of one clip's runs."""
    rows: dict[str, tuple[str, dict[str, Parameter]]] = {}
    for run in runs:
        for name, entry in run.values.get("physics", {}).items():
            if " / " not in name and name.rpartition(".")[2] in SYMBOLS and entry["value"] is not None:
                row = rows.setdefault(name, ("" if entry["unit"] == "1" else entry["unit"], {}))
                row[1][run.variant] = parameter(name, entry)
    return [(f"{SYMBOLS[name.rpartition('.')[2]]} ({name.partition('.')[0]})", *row) for name, row in rows.items()]


def _figures(clips: dict[str, Any], variants: list[str]) -> Iterator[tuple[str, str]]:
    for group, name in PLOTTED:
        rows = {clip: found for clip, rows in clips.items() if (found := rows.get(f"{group}.{name}"))}
        if not rows:
            continue
        first = next(iter(rows.values()))
        unit = "" if first["unit"] == "1" else f" [{first['unit']}]"
        yield (
            f"{first['title']}{unit}, {first['better']} is better",
            compare({clip: row["values"] for clip, row in rows.items()}, variants),
        )


def _link(run: Metrics) -> str:
    """From results/summary.html to the run's own report."""
    return html.escape(f"{run.clip}/{run.variant}/report/report.html", quote=True)


def _cost(run: Metrics) -> str:
    seconds = sum(c.get("seconds", 0.0) for c in run.stages.values())
    return f"{seconds / 60:.1f} min" if seconds else "–"
