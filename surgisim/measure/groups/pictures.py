"""Drawn frames against recorded ones, on the tissue."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from surgisim.artifacts.frames import AFTER, BETWEEN, USED
from surgisim.measure.lpips import SMALLEST, Lpips
from surgisim.measure.psnr import psnr
from surgisim.measure.run import Run
from surgisim.measure.ssim import ssim
from surgisim.side_by_side import in_order

WHEN = {
    "used": (USED, "used frames"),
    "between": (BETWEEN, "frames held out between used ones"),
    "after": (AFTER, "frames held out after the used ones"),
}
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


def pictures(drawn: np.ndarray, run: Run, lpips: Lpips | None) -> Pictures:
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
