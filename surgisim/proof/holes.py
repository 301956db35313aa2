"""How well inpainting fills holes whose pixels are known: real frames, holes planted where they show tissue, as JSON.

    python -m surgisim.proof.holes results/CLIP/main

A clip's own instrument, mirrored left to right, is the hole that moves; where the real one is, nothing is known and
nothing counts. Beside it Telea's method, which fills each frame by itself (radius 5 px).
"""

import argparse
import json
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from surgisim.artifacts.base import load
from surgisim.artifacts.frames import Frames
from surgisim.artifacts.masks import Masks
from surgisim.config.inpainting import Inpainting
from surgisim.measure.psnr import psnr
from surgisim.measure.resample import Estimate, mean
from surgisim.perception.inpainting.removal import without_tool
from surgisim.problem import Problem

LEAST = 50
"""Pixels of a hole below which a frame does not count."""


def planted(frames: Frames, masks: Masks, settings: Inpainting) -> dict[str, np.ndarray]:
    """PSNR [dB] in the planted holes, a value a frame, NaN where a frame has none: `ours`, `telea`; and the share that
    was `hidden`.

    Raises Problem for a clip without an instrument.
    """
    if not masks.tool.any():
        raise Problem("holes: no instrument is in the masks, so there is no hole to plant. Pass a clip that has one.")
    hole = masks.tool[:, :, ::-1] & ~masks.tool
    counted = hole & masks.tissue
    blank = frames.rgb.copy()
    blank[hole] = 0
    hidden = masks.tool | hole
    seen = replace(masks, tool=hidden, tissue=masks.tissue & ~hole)
    filled = without_tool(Frames(blank, frames.split), seen, settings, progress=lambda *_: None).rgb
    ours, telea = np.full((2, len(blank)), np.nan)
    for t in np.flatnonzero(counted.sum((1, 2)) >= LEAST):
        alone = cv2.inpaint(blank[t], hidden[t].astype(np.uint8), 5, cv2.INPAINT_TELEA)
        ours[t], telea[t] = (psnr(a, frames.rgb[t], counted[t]) for a in (filled[t], alone))
    return {"ours": ours, "telea": telea, "hidden": hole.mean((1, 2))}


def told(estimate: Estimate) -> dict[str, Any]:
    """A mean over frames with its 90 % interval, as JSON holds it."""
    ends = [None if end is None else round(end, 2) for end in (estimate.low, estimate.high)]
    return {"value": round(estimate.value, 2), "interval": ends, "frames": estimate.count}


def main() -> None:
    cli = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    cli.add_argument("results", type=Path, help="a clip's folder with ingest/ and masking/")
    home = cli.parse_args().results
    found = planted(
        load(Frames, home / "ingest" / "frames.npz"), load(Masks, home / "masking" / "masks.npz"), Inpainting()
    )
    ours, telea = found["ours"], found["telea"]
    result = {"unit": "dB", "hidden_share": round(float(found["hidden"].mean()), 3)}
    result |= {name: told(mean(each)) for name, each in (("ours", ours), ("telea", telea), ("gain", ours - telea))}
    json.dump(result, sys.stdout, indent=1)
    print()


if __name__ == "__main__":
    main()
