"""What a wrong depth, track, grip or body costs a replay: the same run with the true one in its place.

    python -m surgisim.proof.revealed OUT CLIP grip --cores 2

OUT is a finished run of an invented clip, whose truth is known. It is copied to OUT/revealed/WHAT, the one artifact is
replaced by the truth, in the run's own scale, and the graph runs on from there with the run's own settings. The numbers
come back as results/CLIP/true_WHAT/evaluation/metrics.json, a row for `stages/clip_table.py`.
"""

import argparse
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from rich.console import Console

from surgisim.artifacts.base import load, save
from surgisim.artifacts.camera import Camera
from surgisim.artifacts.depth import Depth
from surgisim.artifacts.metrics import Metrics
from surgisim.artifacts.motion import Motion
from surgisim.artifacts.tracks import Tracks
from surgisim.artifacts.truth import Truth
from surgisim.follow import follower
from surgisim.launch import launch
from surgisim.measure.depth_error import scale_between
from surgisim.measure.truth_seen import TruthSeen, seen
from surgisim.perception.tracking import Paths
from surgisim.perception.tracking.lift import lift
from surgisim.plan import merged
from surgisim.problem import Problem
from surgisim.stage import plain_errors

EXACT = 0.05
"""Standard deviation that true pixels are given [px]: they are rounded to it."""


def true_depth(run: Path, truth: TruthSeen, scale: float) -> None:
    """Behind the instrument too; its change counts as measured."""
    found = load(Depth, run / "depth" / "depth.npz")
    z = np.where(truth.depth > 0, truth.depth / scale, found.z).astype(np.float32)
    _write(replace(found, z=z, confidence=np.ones_like(z), follows=True), run / "depth" / "depth.npz")


def true_tracks(run: Path, truth: TruthSeen, _scale: float) -> None:
    """The true points' pixels, lifted with the run's own depth."""
    seen_at_first = truth.visible[:, 0]
    xy, visible = truth.xy[seen_at_first], truth.visible[seen_at_first]
    paths = Paths(xy.astype(np.float32), visible, np.full(visible.shape, EXACT, np.float32))
    camera = load(Camera, run / "ingest" / "camera.json")
    _write(lift(paths, load(Depth, run / "depth" / "depth.npz"), camera), run / "tracking" / "tracks.npz")


def true_grip(run: Path, truth: TruthSeen, scale: float) -> None:
    """Place, size, path and times; its depth is moved onto the run's own surface, so that it holds the run's tissue."""
    true, depth = truth.motion, load(Depth, run / "depth" / "depth.npz")
    camera = load(Camera, run / "ingest" / "camera.json")
    rest = true.center_rest / scale
    column, row = np.rint(camera.project(rest)).astype(int).T
    inside = np.clip(row, 0, camera.height - 1), np.clip(column, 0, camera.width - 1)
    off = depth.z[0][inside] - truth.depth[0][inside] / scale
    shift = np.stack([0 * off, 0 * off, off], -1)
    moved = Motion(
        rest + shift, true.radius / scale, true.position / scale + shift[:, None], true.active,
        np.ones(len(true.radius)), "given",
    )  # fmt: skip
    _write(moved, run / "tracking" / "motion.npz")


REPLACED: dict[str, Callable[[Path, TruthSeen, float], None]] = {
    "depth": true_depth,
    "tracks": true_tracks,
    "grip": true_grip,
}


ALONG = {"grip": {"estimation": {"carrying": False}}}
"""What else changes: a fit would lay the true path flat again, and look for how far it comes nearer by itself."""


def reveal(out: Path, clip: str, what: str, cores: str) -> Path:
    """Run the graph on with the truth in one place; where its metrics lie."""
    home = out / "results" / clip / "main"
    if not (home / "phantom" / "truth.npz").is_file():
        raise Problem(f"{home}: holds no phantom/truth.npz. Only an invented clip's truth can be revealed.")
    place = out / "revealed" / f"{clip}-{what}"
    if place.exists():
        shutil.rmtree(place)
    # copy2 keeps the times, so that what is replaced is the newest and only what follows it runs.
    shutil.copytree(home, place / "results" / clip / "main", copy_function=shutil.copy2)
    shutil.copytree(
        out / "benchmarks" / clip / "main", place / "benchmarks" / clip / "main", copy_function=shutil.copy2
    )
    run = place / "results" / clip / "main"
    camera = load(Camera, run / "ingest" / "camera.json")
    truth, depth = seen(load(Truth, run / "phantom" / "truth.npz"), camera), load(Depth, run / "depth" / "depth.npz")
    scale = 1.0 if depth.scale == "known" else scale_between(depth.z, truth.depth, ~truth.tool)
    REPLACED[what](run, truth, scale)
    written = _settings(out, place, ALONG.get(what, {}))
    metrics = Path("results") / clip / "main" / "evaluation" / "metrics.json"
    arguments = ["--configfile", str(written), "--cores", cores, "--rerun-triggers", "mtime", "--", str(metrics)]
    with follower(Console(stderr=True), quiet=False) as show:
        code, state = launch(place, arguments, show=show, debug=False)
    if code:
        failed = ", ".join(job.name for job in state.failed) or "; ".join(state.complaints[-3:])
        raise Problem(f"{place}: the graph stopped at {failed}. Its logs lie in {place / 'logs'}.")
    done = replace(load(Metrics, place / metrics), variant=f"true_{what}")
    kept = out / "results" / clip / f"true_{what}" / "evaluation" / "metrics.json"
    kept.parent.mkdir(parents=True, exist_ok=True)
    _write(done, kept)
    return kept


def _settings(out: Path, place: Path, changes: dict[str, Any]) -> Path:
    """The run's own settings with those changes, of its main variant only."""
    choices = yaml.safe_load((out / "results" / "run.yaml").read_text())
    for name in ("clips", "variants"):
        shutil.copy2(choices[name], place / "results" / Path(choices[name]).name)
        choices[name] = str((place / "results" / Path(choices[name]).name).resolve())
    written = place / "results" / "run.yaml"
    written.write_text(yaml.safe_dump(merged(choices, changes | {"run": ["main"]})))
    return written


def _write(artifact: Depth | Tracks | Motion | Metrics, path: Path) -> None:
    save(artifact, path, producer="revealed", settings={}, code="")


def main() -> None:
    cli = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    cli.add_argument("out", type=Path, help="folder of a finished run")
    cli.add_argument("clip", help="name of an invented clip of it")
    cli.add_argument("what", choices=sorted(REPLACED))
    cli.add_argument("--cores", default="1")
    arguments = cli.parse_args()
    with plain_errors(debug=False):
        print(reveal(arguments.out.resolve(), arguments.clip, arguments.what, arguments.cores))


if __name__ == "__main__":
    main()
