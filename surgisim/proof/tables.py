"""The paper's tables, ours beside what it prints.

Wang, Yang, Zhao, Yang and Shen, Realistic surgical simulation from monocular videos: tables of simulation quality, of
the quality of the simulation environment, of reconstruction, and what it says of time. Its numbers are of five EndoNeRF
clips that are not named, and of masks that are not published: beside ours they say what is usual, not who is better.
"""

import hashlib
import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import t as student

from surgisim.artifacts.metrics import Metrics
from surgisim.problem import Problem

MAIN, MONOCULAR = "main", "near_light"
SIMULATED = {
    "main": "ours",
    "elastic_default": "elastic, default numbers",
    "point_cloud": "point cloud, masses and springs",
    "mesh": "triangle mesh, masses and springs",
}
"""Variants of the table of simulations, in its order."""
ENVIRONMENT = {
    "main": "ours",
    "no_trajectory": "without trajectory term",
    "no_anisotropy": "without anisotropic term",
    "no_both": "without both",
}
"""Variants of the table of environments."""
KINDS = ("psnr", "PSNR [dB]"), ("ssim", "SSIM"), ("lpips", "LPIPS")
PRINTED_SIMULATION = {
    "SurgiSim": (22.455, 0.7315, 0.1735),
    "PhysGaussian": (22.367, 0.7235, 0.1759),
    "point cloud": (20.446, 0.7068, 0.2295),
    "mesh": (21.102, 0.6869, 0.2819),
}
PRINTED_ENVIRONMENT = {
    "SurgiSim": (37.114, 0.9772, 0.0436),
    "without trajectory term": (37.036, 0.9770, 0.0442),
    "without anisotropic term": (36.582, 0.9730, 0.0505),
    "without both": (36.750, 0.9754, 0.0465),
}
PRINTED_RECONSTRUCTION = {
    "SurgiSim": (35.490, 0.966, 0.056),
    "EndoNeRF": (27.077, 0.900, 0.107),
    "EndoSurf": (34.795, 0.945, 0.119),
    "LerPlane": (34.643, 0.922, 0.072),
    "4D-GS": (22.832, 0.827, 0.368),
    "EndoGaussian": (36.31, 0.971, 0.050),
}
SURE = 0.9
"""Probability of intervals."""
SHORT = "ingest", "masking", "inpainting", "correspondence", "depth", "tracking"
"""Stages that are told together, as perception."""

Cell = dict[str, Any]
Table = dict[str, Any]


def tables(runs: Iterable[Metrics], scenes: Iterable[Metrics], receipt: dict[str, Any]) -> dict[str, Any]:
    """All of them. runs: whole ones, of SIMULATED; scenes: alone, of ENVIRONMENT with several seeds, and of MONOCULAR.

    Raises Problem where two are of one clip, variant and seed.
    """
    whole = _apart(runs, lambda run: (run.clip, run.variant), "run")
    alone = _apart(scenes, lambda run: (run.clip, run.variant, _seed(run)), "scene")
    if not whole or not alone:
        raise Problem("tables: no runs, or no scenes alone. Pass the metrics.json of both.")
    made = [_simulations(whole), _environments(alone), _reconstructions(alone), _costs(whole)]
    return {"format": "surgisim-tables/1", "tables": made, "receipt": receipt}


def _apart(found: Iterable[Metrics], key, what: str) -> dict[tuple, Metrics]:
    result: dict[tuple, Metrics] = {}
    for one in found:
        if key(one) in result:
            raise Problem(f"tables: two metrics.json are of {what} {'/'.join(map(str, key(one)))}. Pass each once.")
        result[key(one)] = one
    return result


def _seed(scene: Metrics) -> int:
    entry = scene.values.get("reconstruction", {}).get("seed")
    if entry is None:
        raise Problem(
            f"tables: the metrics of {scene.clip}, {scene.variant} are of no scene alone. Pass scene_score's."
        )
    return int(entry["value"])


def _simulations(runs: dict[tuple, Metrics]) -> Table:
    parts = {"driven": "grip holds", "free": "let go"}
    names = [f"{kind}_{part}" for part in parts for kind, _ in KINDS] + ["psnr_whole_all"]
    columns = [f"{words}, {where}" for where in parts.values() for _, words in KINDS] + ["PSNR [dB], whole frames"]
    clips = list(dict.fromkeys(clip for clip, _ in runs))
    rows = []
    for variant, words in SIMULATED.items():
        mine = [runs[clip, variant] for clip in clips if (clip, variant) in runs]
        if len(clips) > 1 and mine:
            rows.append(_row(f"{words}, mean of {len(mine)} clips", _means(mine, "simulation", names), bold=True))
        rows += [_row(f"{words}, {one.clip}", [_cell(one, "simulation", n) for n in names]) for one in mine]
    return {
        "name": "simulation",
        "title": "Simulation: the recorded manipulation again, beside the recording",
        "protocol": "Held-out frames while a grip holds and after it lets go, tissue pixels (SSIM and LPIPS with every "
        "other pixel black in both). Whole frames: all frames but the first, all pixels outside the instrument. All "
        "variants have one clip, scene, body and grip; the baselines' stiffness and viscosity are the defaults.",
        "columns": columns,
        "rows": rows,
        "printed": [_printed(name, [None] * 6 + [v[0]], v) for name, v in PRINTED_SIMULATION.items()],
        "printed_note": "over five EndoNeRF clips, pixels not said: PSNR / SSIM / LPIPS",
        "words": "",
    }


def _environments(scenes: dict[tuple, Metrics]) -> Table:
    names, geometry = [f"{kind}_first_25" for kind, _ in KINDS], ("strain_95", "folded", "spikes", "largest", "stretch")
    rows, apart = [], {}
    for variant, words in ENVIRONMENT.items():
        mine = [one for (_, v, _), one in scenes.items() if v == variant]
        if not mine:
            continue
        cells = _means(mine, "reconstruction", names)
        pairs = [
            (scenes[clip, variant, seed], scenes[clip, MAIN, seed])
            for clip, v, seed in scenes
            if v == variant != MAIN and (clip, MAIN, seed) in scenes
        ]
        gained = [(a.clip, _of(a, "reconstruction", names[0]) - _of(b, "reconstruction", names[0])) for a, b in pairs]
        apart[variant] = _interval(_by_clip(gained))
        rows.append(_row(words, [*cells, apart[variant], *_means(mine, "scene", geometry)]))
    clips, seeds = (len({key[k] for key in scenes if key[1] in ENVIRONMENT}) for k in (0, 2))
    return {
        "name": "environment",
        "title": "Simulation environment: first 25 frames, terms left out",
        "protocol": f"Mean over {clips} clip{'s' * (clips > 1)} and {seeds} seeds of the fit, of all first 25 frames, "
        "used or not; tissue pixels. Beside ours: PSNR against ours of the same clip and seed. Intervals (90 %) are "
        "Student's over clips, each the mean of its seeds; over the seeds where there is one clip.",
        "columns": [
            *(words for _, words in KINDS),
            "PSNR beside ours [dB]",
            "strain of neighbours, 95th percentile",
            "surface turned over [%]",
            "splats that stick out [%]",
            "largest splat [% of the scene]",
            "thinnest splat, longest over shortest radius",
        ],
        "rows": rows,
        "printed": [_printed(name, list(v), v) for name, v in PRINTED_ENVIRONMENT.items()],
        "printed_note": "five EndoNeRF clips, standard deviation over them 3.6 to 4.4 dB",
        "words": _ordering(apart),
    }


def _ordering(apart: dict[str, Cell]) -> str:
    """Whether terms are worth what is printed, in words."""
    ours, found = PRINTED_ENVIRONMENT["SurgiSim"][0], []
    for variant, words in ENVIRONMENT.items():
        if variant == MAIN:
            continue
        wanted = PRINTED_ENVIRONMENT[words][0] - ours
        cell = apart.get(variant)
        if not cell or cell["low"] is None:
            said = "cannot tell (too few seeds)"
        elif cell["high"] < 0:
            said = "worse, as printed"
        elif cell["low"] > 0:
            said = "better, other than printed"
        else:
            said = "no difference that can be told"
        found.append(f"{words} ({wanted:+.2f} dB printed): {said}")
    return "; ".join(found) + "."


def _reconstructions(scenes: dict[tuple, Metrics]) -> Table:
    names = [f"{kind}_between" for kind, _ in KINDS] + ["psnr_between_outside"]
    names += [*(f"{kind}_between_black" for kind, _ in KINDS), "gaussians"]
    first: dict[tuple, Metrics] = {}
    for (clip, variant, _), one in sorted(scenes.items(), key=lambda item: item[0][2]):
        if variant in (MAIN, MONOCULAR):
            first.setdefault((clip, variant), one)
    words = {MAIN: "", MONOCULAR: ", depth by light"}
    rows = [
        _row(
            f"{clip}{words[variant]}",
            [
                *(_cell(one, "reconstruction", n) for n in names),
                plain(one.stages.get("reconstruction", {}).get("seconds")),
            ],
        )
        for (clip, variant), one in sorted(first.items())
    ]
    return {
        "name": "reconstruction",
        "title": "Reconstruction: frames between those that are used",
        "protocol": "Every eighth frame held out. Tissue pixels; beside that all pixels but the instrument's, and "
        "'rest black': whole frames, black in both where the instrument is and where no depth came with a recording "
        "that has depth, as Deform3DGS and those who compare with it count. Masks and depth that came "
        "with a recording are used; 'depth by light' is the same without given depth.",
        "columns": [
            *(w for _, w in KINDS),
            "PSNR [dB], outside the instrument",
            *(f"{w}, rest black" for _, w in KINDS),
            "splats",
            "fit [s]",
        ],
        "rows": rows,
        "printed": [_printed(name, list(v), v) for name, v in PRINTED_RECONSTRUCTION.items()],
        "printed_note": "EndoNeRF, given masks and stereo depth, as the paper prints them",
        "words": "",
    }


def _costs(runs: dict[tuple, Metrics]) -> Table:
    later = "reconstruction", "thickening", "estimation", "simulation"
    rows = []
    for (clip, variant), run in runs.items():
        if variant != MAIN:
            continue
        seconds = {stage: cost.get("seconds", math.nan) for stage, cost in run.stages.items()}
        perception = [seconds[s] for s in SHORT if s in seconds]
        each = [sum(perception) if perception else None, *(seconds.get(s) for s in later)]
        peak = max((cost["peak_mb"] for cost in run.stages.values() if "peak_mb" in cost), default=None)
        rows.append(_row(clip, [plain(v) for v in (*each, sum(seconds.values()) if seconds else None, peak)]))
    return {
        "name": "costs",
        "title": "Time and memory",
        "protocol": "Wall time of each stage from Snakemake's benchmarks [s], those of perception together, and all of "
        "them one after the other; largest resident memory of any stage [MB]. No benchmark, no number.",
        "columns": ["perception", "scene", "body", "parameters", "replay", "all", "largest memory [MB]"],
        "rows": rows,
        "printed": [],
        "printed_note": "on an RTX 4090: scene and body under 4 minutes, parameters 10 minutes (up to 20), 7 frames a "
        "second of replay with ten times fewer steps",
        "words": "",
    }


def _row(name: str, cells: Sequence[Cell], *, bold: bool = False) -> dict[str, Any]:
    return {"name": name, "cells": list(cells), "bold": bold}


def _printed(name: str, placed: list[float | None], values: tuple[float, ...]) -> dict[str, Any]:
    return {"name": name, "cells": [plain(v) for v in placed], "values": list(values)}


def plain(value: float | None) -> Cell:
    known = value is not None and math.isfinite(value)
    return {"value": float(value) if known else None, "low": None, "high": None}


def _cell(run: Metrics, group: str, name: str) -> Cell:
    entry = run.values.get(group, {}).get(name, {})
    return {"value": entry.get("value"), "low": entry.get("low"), "high": entry.get("high")}


def _of(run: Metrics, group: str, name: str) -> float:
    value = _cell(run, group, name)["value"]
    return math.nan if value is None else value


def _means(runs: list[Metrics], group: str, names: Iterable[str]) -> list[Cell]:
    return [_interval(_by_clip([(run.clip, _of(run, group, name)) for run in runs])) for name in names]


def _by_clip(values: Sequence[tuple[str, float]]) -> list[float]:
    """Each clip's mean, of clips and values, missing ones left out; the values themselves where there is one clip.
    Seeds of a clip say nothing of what other clips would."""
    known = [(clip, value) for clip, value in values if math.isfinite(value)]
    clips = list(dict.fromkeys(clip for clip, _ in known))
    if len(clips) < 2:
        return [value for _, value in known]
    return [float(np.mean([value for c, value in known if c == clip])) for clip in clips]


def _interval(values: Iterable[float]) -> Cell:
    """Their mean, with Student's interval where there are at least two; those that are missing are left out."""
    known = np.array([v for v in values if math.isfinite(v)])
    if not len(known):
        return plain(None)
    if len(known) < 2:
        return plain(known[0])
    half = student.ppf(0.5 + SURE / 2, len(known) - 1) * known.std(ddof=1) / math.sqrt(len(known))
    middle = float(known.mean())
    return {"value": middle, "low": middle - float(half), "high": middle + float(half)}


def digest_of(path: Path) -> str:
    """SHA-256 of a recording: of a file, or of all files in a folder, with their names."""
    total = hashlib.sha256()
    for file in [path] if path.is_file() else sorted(f for f in path.rglob("*") if f.is_file()):
        total.update(f"{file.relative_to(path)}\n".encode())
        with file.open("rb") as stream:
            for block in iter(lambda: stream.read(1 << 20), b""):
                total.update(block)
    return total.hexdigest()
