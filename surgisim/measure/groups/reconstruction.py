"""How well the dynamic scene redraws the recording."""

from typing import Any

import numpy as np

from surgisim.measure.groups.pictures import WHEN, Pictures, pictures
from surgisim.measure.lpips import Lpips
from surgisim.measure.number import number
from surgisim.measure.psnr import psnr
from surgisim.measure.run import Run


def reconstruction(run: Run, lpips: Lpips | None, first: int) -> dict[str, dict[str, Any]]:
    radii = np.exp(run.scene.scale.astype(np.float64))
    stretch = radii.max(1) / radii.min(1)
    drawn = pictures(run.rendered.rgb, run, lpips)
    count = min(first, len(run.frames.rgb))
    numbers = {
        "gaussians": number(len(run.scene.mean), "1", "splats of the canonical scene"),
        "stretch_median": number(np.median(stretch), "1", "longest over shortest radius of a splat, median"),
        "stretch_95": number(np.percentile(stretch, 95), "1", "the same, 95th percentile"),
        f"psnr_first_{count}": number(
            np.mean(drawn.psnr[:count]), "dB", f"mean over the first {count} frames, used or not; tissue pixels"
        ),
    }
    if run.truth is not None:
        each = [psnr(a, b, ~m) for a, b, m in zip(run.rendered.rgb, run.frames.rgb, run.truth.tool, strict=True)]
        numbers["psnr_between_true_mask"] = number(
            _mean(np.array(each)[run.frames.split == 1]),
            "dB",
            "held out between used frames; all but true tool pixels",
        )
    return numbers | table(drawn, run, WHEN) | still(run)


def still(run: Run) -> dict[str, dict[str, Any]]:
    """What a frozen first frame would score: the number to beat."""
    first, tissue = run.inpainted.rgb[0], run.masks.tissue
    each = np.array([psnr(first, f, m) for f, m in zip(run.frames.rgb, tissue, strict=True)])
    return {
        f"still_psnr_{when}": number(
            _mean(each[run.frames.split == code]), "dB", f"the inpainted frame 0 held still, {words}; tissue pixels"
        )
        for when, (code, words) in WHEN.items()
        if when != "used"
    }


def table(drawn: Pictures, run: Run, when: dict[str, tuple[int, str]]) -> dict[str, dict[str, Any]]:
    """PSNR, SSIM and LPIPS over each part of the split."""
    numbers = {}
    for name, unit, each, why_not in drawn.columns():
        for part, (code, words) in when.items():
            numbers[f"{name}_{part}"] = number(
                _mean(each[run.frames.split == code]) if each is not None else None,
                unit,
                f"mean over {words} of the frame's value; {drawn.protocol[name]}",
                series=each if part == "between" else None,
                why_not=why_not or f"there are no {words}",
            )
    return numbers


def _mean(each: np.ndarray) -> float | None:
    return float(np.mean(each)) if len(each) and np.isfinite(each).all() else None
