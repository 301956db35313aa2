"""Learned backends beside the built-in ones, as JSON, a page of tables and pictures.

    python -m surgisim.proof.learned CLIPS.yaml --weights FOLDER --out FOLDER

CLIPS.yaml holds, by name, each clip's `path` (from where the command is run), `clicks` (frame, x, y: one on each
instrument, in one frame, at the working size), and settings of its own under `ingest`.
"""

import argparse
import json
import sys
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import yaml

from surgisim.artifacts.base import save_bytes
from surgisim.config.base import parse
from surgisim.config.ingest import Ingest
from surgisim.config.masking import Masking
from surgisim.perception.ingest.clip import ingest
from surgisim.perception.masking.outline import with_working_clicks
from surgisim.perception.optical_flow.choice import chosen
from surgisim.problem import Problem
from surgisim.proof.learned import motion, outlines
from surgisim.proof.learned.page import tables, verdict
from surgisim.side_by_side import threads
from surgisim.weights import found

WANTED = ("masking.encoder", "masking.decoder", "correspondence.flow_weights")


def measured(name: str, clip: dict[str, Any], there: dict[str, Path]) -> tuple[dict[str, Any], np.ndarray]:
    """What is told of one clip, and a picture of its masks."""

    def said(words: str) -> None:
        print(f"{name}: {words}", file=sys.stderr, flush=True)

    frames, camera, given = ingest(
        Path(clip["path"]), parse(Ingest, clip.get("ingest", {}), name), progress=lambda *_: None
    )
    files = {key.split(".")[1]: there[key] for key in WANTED[:2]}
    settings = with_working_clicks(parse(Masking, {"clicks": clip["clicks"], **files}, name), camera)
    masks, told = outlines.masks(frames, given, settings)
    said(json.dumps(told))
    shown = ({"given": given.tool} if len(given.tool) else {}) | masks
    raft = chosen("raft", there[WANTED[2]], stage="correspondence")
    # Where no masks came along, what both have found is left out.
    tool = given.tool if len(given.tool) else masks["colour_motion"] | masks["sam2"]
    flow = motion.measured(frames.rgb, tool, given, camera, motion.flows(raft), said)
    followed = motion.followed(frames.rgb, tool, raft, said)
    size = [len(frames.rgb), *frames.rgb.shape[2:0:-1]]
    result = {"frames_width_height": size, "masks": told, "flow": flow, "followed": followed}
    return result, outlines.picture(frames.rgb, shown, settings.clicks)


def main() -> None:
    cli = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    cli.add_argument("clips", type=Path, help="a YAML file of clips")
    cli.add_argument("--weights", type=Path, required=True, help="folder of networks' weights")
    cli.add_argument("--out", type=Path, required=True, help="where learned.json, learned_tables.md and pictures go")
    args = cli.parse_args()
    there = found(args.weights)
    if lacks := [key for key in WANTED if key not in there]:
        raise Problem(
            f"{args.weights}: holds no weights for {', '.join(lacks)}. Lay them there; doctor says their names."
        )
    args.out.mkdir(parents=True, exist_ok=True)
    clips, pictures = {}, {}
    for name, clip in yaml.safe_load(args.clips.read_text()).items():
        clips[name], pictures[name] = measured(name, clip, there)
    result = {"threads": threads(), "clips": clips, "verdict": verdict(clips)}
    written = {
        args.out / "learned.json": json.dumps(result, indent=1).encode() + b"\n",
        args.out / "learned_tables.md": tables(clips).encode(),
    }
    for name, picture in pictures.items():
        _, jpg = cv2.imencode(".jpg", picture[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, 60])
        written[args.out / f"learned_{name}.jpg"] = jpg.tobytes()
    save_bytes(written)
    json.dump(result, sys.stdout, indent=1)
    print()


if __name__ == "__main__":
    main()
