"""Drawn frames against recorded ones, on the tissue."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from surgisim.artifacts.frames import AFTER, BETWEEN, USED
from surgisim.measure.lpips import SMALLEST, Lpips
from surgisim.measure.number import number
from surgisim.measure.psnr import psnr
from surgisim.measure.run import OfScene, Run
from surgisim.measure.ssim import ssim
from surgisim.side_by_side import in_order

WHEN = {
    "used": (USED, "used frames"),
    "between": (BETWEEN, "frames held out between used ones"),
    "after": (AFTER, "frames held out after the used ones"),
}
"""Parts of the split, their codes and words."""
Part = tuple[np.ndarray, str]
"""Which frames, (T,) bool, and what they are called."""
BLACK = "every other pixel black in both pictures"


@dataclass(frozen=True)
class Pictures:
    """Each metric in every frame, (T,)."""

    psnr: np.ndarray
    ssim: np.ndarray
    lpips: np.ndarray | None
    lpips_why_not: str = ""

    protocol = {
        "psnr": "tissue pixels only (tool, highlights and background left out)",
        "ssim": f"map averaged over tissue pixels, {BLACK}",
        "lpips": f"AlexNet, version 0.1, {BLACK}",
    }

    def columns(self) -> Iterator[tuple[str, str, np.ndarray | None, str]]:
        """Name, unit, values, and why there are none."""
        yield "psnr", "dB", self.psnr, ""
        yield "ssim", "1", self.ssim, ""
        yield "lpips", "1", self.lpips, self.lpips_why_not


def parts_of(split: np.ndarray) -> dict[str, Part]:
    """Parts of the split, (T,)."""
    return {name: (split == code, words) for name, (code, words) in WHEN.items()}


def table(drawn: Pictures, parts: dict[str, Part]) -> dict[str, dict[str, Any]]:
    """PSNR, SSIM and LPIPS over each part, as `psnr_PART` and so on."""
    numbers = {}
    for name, unit, each, why_not in drawn.columns():
        for part, (here, words) in parts.items():
            numbers[f"{name}_{part}"] = number(
                mean(each[here]) if each is not None else None,
                unit,
                f"mean over {words} of the frame's value; {drawn.protocol[name]}",
                series=each if part == "between" else None,
                why_not=why_not or f"there are no {words}",
            )
    return numbers


def mean(each: np.ndarray) -> float | None:
    """None of nothing, and where a frame has no value."""
    return float(np.mean(each)) if len(each) and np.isfinite(each).all() else None


def pictures(drawn: np.ndarray, run: Run | OfScene, lpips: Lpips | None) -> Pictures:
    """Drawn frames, sRGB, (T, H, W, 3) uint8, against the run's recording."""
    triples = list(zip(drawn, run.frames.rgb, run.masks.tissue, strict=True))
    why_not = ""
    if lpips is None:
        why_not = "no weights: evaluation.lpips_weights names no file (lpips_alex.safetensors)"
    elif min(drawn.shape[1:3]) < SMALLEST:
        why_not, lpips = f"frames under {SMALLEST} px are too small for AlexNet", None
    return Pictures(
        np.array(list(in_order(psnr, triples))),
        np.array(list(in_order(ssim, triples))),
        np.array([lpips(*t) for t in triples]) if lpips else None,
        why_not,
    )
