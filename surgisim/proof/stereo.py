"""How far stereo is off in how tissue's depth changes: clips of the family, filmed through two lenses, as JSON.

    python -m surgisim.proof.stereo --seed 5 --clips 40 --rising 30

A clip counts where its pull rises by so many degrees toward the camera. Both views are compressed as the family's
recordings are; the stages from ingest to depth see nothing else.
"""

import argparse
import json
import math
import sys
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from surgisim.artifacts.truth import Truth
from surgisim.config.correspondence import Correspondence
from surgisim.config.depth import Depth
from surgisim.config.ingest import Ingest
from surgisim.config.inpainting import Inpainting
from surgisim.config.masking import Masking
from surgisim.config.phantom import Phantom
from surgisim.measure.compared import from_start, moving
from surgisim.measure.depth_error import scale_between
from surgisim.measure.groups.depth_change import sampled
from surgisim.measure.truth_seen import seen
from surgisim.perception.depth.distance import depth
from surgisim.perception.ingest.clip import ingest
from surgisim.perception.ingest.video import opened
from surgisim.perception.inpainting.removal import without_tool
from surgisim.perception.masking.outline import masks
from surgisim.perception.tracking.correspond import correspond
from surgisim.phantom import block
from surgisim.phantom.case import Case, invent
from surgisim.phantom.clip import move, photograph
from surgisim.phantom.family import draw
from surgisim.phantom.video import encode

BASELINE = 0.004
"""Distance of a stereo endoscope's lenses [m]."""


def quiet(done: float, of: float, text: str) -> None:
    """Progress that nobody watches."""


def rising(case: Case) -> float:
    """Angle by which the pull comes toward the camera [rad]."""
    return math.asin(-float(case.pull[2]) / float(np.linalg.norm(case.pull)))


def seen_from(case: Case, positions: np.ndarray, lens: np.ndarray) -> tuple[Case, np.ndarray]:
    """Scene and nodes [m] as they lie before a lens that is moved by `lens` [m], (3,)."""
    tool = replace(case.tool, port=case.tool.port - lens)
    return replace(case, shape=replace(case.shape, center=case.shape.center - lens), tool=tool), positions - lens


def filmed(settings: Phantom, folder: Path) -> Truth:
    """Both views as folders of pictures, and the truth of the left one."""
    case = invent(settings)
    made = block.mesh(case.shape, case.grip, settings.spacing, hold_sides=settings.sides == "held")
    times = np.arange(round(settings.duration * settings.fps)) / settings.fps
    positions = move(case, made, times)
    truths = []
    for name, lens in (("images", 0.0), ("images_right", BASELINE)):
        there, nodes = seen_from(case, positions, np.array([lens, 0.0, 0.0]))
        rgb, truth = photograph(settings, there, made, times, nodes)
        (folder / name).mkdir()
        film = folder / f"{name}.mp4"
        film.write_bytes(encode(rgb, settings.fps, settings.crf))
        for t, frame in enumerate(opened(film, max_pixels=rgb[0].size).frames()):
            Image.fromarray(frame).save(folder / name / f"{t:04d}.png")
        film.unlink()
        truths.append(truth)
    return truths[0]


def measured(settings: Phantom, backends: list[str]) -> dict[str, float]:
    """Error of the change of depth of moving tissue while it is held, as a share of that change, of every backend."""
    with tempfile.TemporaryDirectory() as home:
        folder = Path(home)
        truth = filmed(settings, folder)
        frames, camera, given = ingest(
            folder, Ingest(focal=settings.focal * settings.width, fps=settings.fps, baseline=BASELINE), progress=quiet
        )
    found = masks(frames, given, camera, Masking(), progress=quiet)
    inpainted = without_tool(frames, found, Inpainting(), progress=quiet)
    surface = correspond(frames, found, Correspondence(), progress=quiet)
    to = seen(truth, camera)
    counted = to.visible & to.visible[:, :1] & to.motion.active[0].astype(bool)
    counted &= moving(from_start(to.xyz), counted, counted.any(1))
    errors = {}
    for backend in backends:
        z = depth(frames, inpainted, found, surface, given, camera, Depth(backend=backend), progress=quiet)
        change = from_start(sampled(z.z, to.xy))
        # One factor for the clip where the scale is not known, as in the metrics.
        change *= 1.0 if z.scale == "known" else scale_between(z.z, to.depth, ~to.tool)
        here = counted & np.isfinite(change)
        wanted, change = from_start(to.xyz)[..., 2][here], change[here]
        errors[backend] = float(np.linalg.norm(change - wanted) / np.linalg.norm(wanted))
    return errors


def table(seed: int, clips: int, least: float, width: int, backends: list[str]) -> dict[str, Any]:
    """Every clip that rises by `least` [rad], with each backend's error."""
    out: dict[str, Any] = {}
    for n in range(clips):
        phantom = Phantom(**draw(seed, n)["phantom"])
        phantom = phantom.model_copy(update={"width": width, "height": 2 * round(0.4 * width)})
        angle = rising(invent(phantom))
        if angle < least:
            continue
        out[f"family-{seed}-{n}"] = {"rises_deg": round(math.degrees(angle), 1)} | {
            backend: round(100 * error, 1) for backend, error in measured(phantom, backends).items()
        }
        print(n, out[f"family-{seed}-{n}"], file=sys.stderr, flush=True)
    middle = {b: float(np.median([row[b] for row in out.values()])) if out else None for b in backends}
    return {"baseline_m": BASELINE, "width_px": width, "unit": "%", "median": middle, "count": len(out), "clips": out}


def main() -> None:
    cli = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    cli.add_argument("--seed", type=int, default=5)
    cli.add_argument("--clips", type=int, default=40)
    cli.add_argument("--rising", type=float, default=30.0, help="least angle of a pull toward the camera [degrees]")
    cli.add_argument("--width", type=int, default=160, help="of the pictures [px]")
    cli.add_argument("--backends", nargs="+", default=["stereo", "near_light"], help="of depth")
    args = cli.parse_args()
    result = table(args.seed, args.clips, math.radians(args.rising), args.width, args.backends)
    json.dump(result, sys.stdout, indent=1)
    print()


if __name__ == "__main__":
    main()
