"""Found grips against grips marked by looking, clip by clip, as JSON.

    python -m surgisim.proof.grasps tests/perception/real_grips.json results

`results` holds CLIP/main/ingest/camera.json and CLIP/main/tracking/motion.npz for clips named as in the marks; clips
that are not there are left out. Pixels are those of a longer image side of 320 px.
"""

import argparse
import json
import sys
from pathlib import Path

import numpy as np

from surgisim.artifacts.base import load
from surgisim.artifacts.camera import Camera
from surgisim.artifacts.motion import Motion
from surgisim.problem import Problem

SIDE = 320
"""Longer image side at which grips are marked [px]."""
NEAR, SOON = 12.0, 2
"""How far a found grip may be from its mark [px of SIDE], and its release from the marked one [frames]."""


def compare(marks: list[dict], motion: Motion, camera: Camera) -> list[dict]:
    """One row a mark: the found grip nearest to it, and whether it is found and let go where and when it is."""
    scale = SIDE / max(camera.width, camera.height)
    pixel = (camera.project(motion.center_rest) + 0.5) * scale - 0.5
    rows, used = [], set()
    for mark in marks:
        away = np.linalg.norm(pixel - mark["pixel"], axis=-1)
        left = [j for j in np.argsort(away) if j not in used]
        if not left:
            rows.append({"marked": mark["pixel"], "found": None, "good": False})
            continue
        j = int(left[0])
        used.add(j)
        first, last = (int(v) for v in np.flatnonzero(motion.active[j])[[0, -1]])
        rows.append(
            {
                "marked": mark["pixel"],
                "found": [round(float(v), 1) for v in pixel[j]],
                "away_px": round(float(away[j]), 1),
                "begin": [mark["begin"], first],
                "end": [mark["end"], last],
                "confidence": round(float(motion.confidence[j]), 2),
                "good": bool(away[j] <= NEAR and abs(last - mark["end"]) <= SOON),
            }
        )
    return rows


def table(marks: Path, results: Path) -> dict:
    """Every marked clip that `results` holds, and how many of its grips are good."""
    clips = json.loads(marks.read_text())["clips"]
    out, invented = {}, {}
    for name, clip in clips.items():
        home = results / name / "main"
        if (home / "tracking/motion.npz").is_file():
            motion = load(Motion, home / "tracking/motion.npz")
            out[name] = compare(clip["grips"], motion, load(Camera, home / "ingest/camera.json"))
            invented[name] = max(len(motion.radius) - len(clip["grips"]), 0)
    if not out:
        raise Problem(f"{results}: holds no CLIP/main/tracking/motion.npz of {sorted(clips)}. Run them until tracking.")
    rows = [row for clip in out.values() for row in clip]
    return {"clips": out, "grips": len(rows), "good": sum(r["good"] for r in rows), "not_marked": invented}


def main() -> None:
    cli = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    cli.add_argument("marks", type=Path, help="grips marked by looking, tests/perception/real_grips.json")
    cli.add_argument("results", type=Path, help="a folder with CLIP/main/tracking/motion.npz")
    args = cli.parse_args()
    json.dump(table(args.marks, args.results), sys.stdout, indent=1)
    print()


if __name__ == "__main__":
    main()
