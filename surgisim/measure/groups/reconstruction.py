"""How well the dynamic scene redraws the recording."""

from typing import Any

import numpy as np

from surgisim.artifacts.frames import BETWEEN
from surgisim.measure.groups.pictures import WHEN, mean, parts_of, pictures, table
from surgisim.measure.lpips import Lpips
from surgisim.measure.number import number
from surgisim.measure.psnr import psnr
from surgisim.measure.run import OfScene, Run


def reconstruction(run: Run | OfScene, lpips: Lpips | None, first: int) -> dict[str, dict[str, Any]]:
    radii = np.exp(run.scene.scale.astype(np.float64))
    stretch = radii.max(1) / radii.min(1)
    drawn = pictures(run.rendered.rgb, run, lpips)
    count = min(first, len(run.frames.rgb))
    numbers = {
        "gaussians": number(len(run.scene.mean), "1", "splats of the canonical scene"),
        "stretch_median": number(np.median(stretch), "1", "longest over shortest radius of a splat, median"),
        "stretch_95": number(np.percentile(stretch, 95), "1", "the same, 95th percentile"),
    }
    if run.truth is not None:
        each = [psnr(a, b, ~m) for a, b, m in zip(run.rendered.rgb, run.frames.rgb, run.truth.tool, strict=True)]
        numbers["psnr_between_true_mask"] = number(
            mean(np.array(each)[run.frames.split == 1]),
            "dB",
            "held out between used frames; all but true tool pixels",
        )
    early = {f"first_{count}": (np.arange(len(run.frames.rgb)) < count, f"the first {count} frames, used or not")}
    return numbers | table(drawn, parts_of(run.frames.split) | early) | _otherwise(run) | still(run)


def _otherwise(run: Run | OfScene) -> dict[str, dict[str, Any]]:
    """PSNR between used frames as others count it."""
    between = np.flatnonzero(run.frames.split == BETWEEN)
    outside = ~run.masks.tool[between]
    pairs = [(run.rendered.rgb[t], run.frames.rgb[t]) for t in between]
    everywhere = np.ones(outside.shape[1:], bool)
    ways = {
        "outside": (
            [psnr(*pair, here) for pair, here in zip(pairs, outside, strict=True)],
            "all pixels but the instrument's, its rim and highlights too",
        ),
        "black": (
            [psnr(*(p * m[..., None] for p in pair), everywhere) for pair, m in zip(pairs, outside, strict=True)],
            "whole frames with the instrument black in both, as EndoNeRF's evaluation and what follows it count",
        ),
    }
    return {
        f"psnr_between_{name}": number(
            mean(np.array(each)),
            "dB",
            f"mean over {WHEN['between'][1]}; {words}",
            why_not=f"there are no {WHEN['between'][1]}",
        )
        for name, (each, words) in ways.items()
    }


def still(run: Run | OfScene) -> dict[str, dict[str, Any]]:
    """What a frozen first frame would score: the number to beat."""
    first, tissue = run.inpainted.rgb[0], run.masks.tissue
    each = np.array([psnr(first, f, m) for f, m in zip(run.frames.rgb, tissue, strict=True)])
    return {
        f"still_psnr_{when}": number(
            mean(each[run.frames.split == code]), "dB", f"the inpainted frame 0 held still, {words}; tissue pixels"
        )
        for when, (code, words) in WHEN.items()
        if when != "used"
    }
