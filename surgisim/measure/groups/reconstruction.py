"""How well the dynamic scene redraws the recording."""

from typing import Any

import numpy as np

from surgisim.artifacts.frames import BETWEEN
from surgisim.measure.groups.pictures import WHEN, mean, parts_of, pictures, table
from surgisim.measure.lpips import SMALLEST, Lpips
from surgisim.measure.number import number
from surgisim.measure.psnr import psnr
from surgisim.measure.run import OfScene, Run
from surgisim.measure.ssim import ssim

BLACK_AS = "as Deform3DGS (metrics.py at 8bc37de) and those who compare with it count"


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
    return numbers | table(drawn, parts_of(run.frames.split) | early) | _otherwise(run, lpips) | still(run)


def _otherwise(run: Run | OfScene, lpips: Lpips | None) -> dict[str, dict[str, Any]]:
    """Pictures between used frames as others count them."""
    between = np.flatnonzero(run.frames.split == BETWEEN)
    counted = ~run.masks.tool[between]
    pairs = [(run.rendered.rgb[t], run.frames.rgb[t]) for t in between]
    outside = [psnr(*pair, here) for pair, here in zip(pairs, counted, strict=True)]
    if len(run.given.depth):
        counted = counted & (run.given.depth[between] > 0)
    black = [[p * here[..., None] for p in pair] for pair, here in zip(pairs, counted, strict=True)]
    whole = np.ones(run.frames.rgb.shape[1:3], bool)
    words = (
        "whole frames, black in both where the instrument is and where no depth came with a recording that has depth"
    )
    lpips = lpips if min(whole.shape) >= SMALLEST else None
    ways = {
        "psnr_between_outside": (outside, "dB", "all pixels but the instrument's, its rim and highlights too"),
        "psnr_between_black": ([psnr(*pair, whole) for pair in black], "dB", f"{words}, {BLACK_AS}"),
        "ssim_between_black": ([ssim(*pair, whole) for pair in black], "1", f"{words}, {BLACK_AS}"),
        "lpips_between_black": ([lpips(*pair, whole) for pair in black] if lpips else [], "1", f"{words}, {BLACK_AS}"),
    }
    return {
        name: number(
            mean(np.array(each)),
            unit,
            f"mean over {WHEN['between'][1]}; {how}",
            why_not=f"there are no {WHEN['between'][1]}" if len(between) == 0 else "no weights, or frames too small",
        )
        for name, (each, unit, how) in ways.items()
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
