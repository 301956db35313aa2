"""The stages before the physics, phase by phase: what a mean over a clip's long rest would hide."""

from typing import Any

import numpy as np

from surgisim.artifacts.frames import BETWEEN
from surgisim.measure.compared import OF_MOVING, from_start, moving
from surgisim.measure.flow_at import flow_at
from surgisim.measure.groups.tracking import HOW
from surgisim.measure.number import ranged
from surgisim.measure.psnr import psnr
from surgisim.measure.resample import mean, median, ratio
from surgisim.measure.run import Run
from surgisim.measure.spans import SPANS, phases_of, within


def masking_by_phase(run: Run) -> dict[str, dict[str, Any]]:
    if run.truth is None:
        return {}
    tool, true, phase = run.masks.tool, run.truth.tool, phases_of(run)
    both, either = (tool & true).sum((1, 2)), (tool | true).sum((1, 2))
    return {
        f"tool_iou_{span}": ranged(
            ratio(np.where(within(phase, span), both, 0), np.where(within(phase, span), either, 0)), "1",
            f"intersection over union of the tool's pixels with the true ones, pooled over frames {words}",
            drawn="frames", why_not=f"there is no frame {words}",
        )
        for span, (_, words) in SPANS.items()
    }  # fmt: skip


def tracking_by_phase(run: Run) -> dict[str, dict[str, Any]]:
    """Of moving points: where tissue stays still, every tracker is right."""
    if run.truth is None:
        return {}
    truth, phase = run.truth, phases_of(run)
    counted = truth.visible.copy()
    counted[:, 0] = False
    counted &= moving(from_start(truth.xyz), counted, counted.any(1))
    found = flow_at(truth.xy[:, 0], run.tracks.xy, run.tracks.visible)
    apart = np.linalg.norm(found - truth.xy, axis=-1)
    still = np.linalg.norm(from_start(truth.xy), axis=-1)
    numbers = {}
    for span, (_, words) in SPANS.items():
        here, how = counted & within(phase, span), f"of {OF_MOVING}, {words}; {HOW}"
        why_not = f"no moving point is seen {words}"
        answered = here & np.isfinite(apart)
        numbers[f"moving_{span}"] = ranged(median(apart, here), "px", f"median {how}", why_not=why_not)
        numbers[f"moving_{span}_still"] = ranged(
            median(still, answered), "px", f"median if every point were said to stay in its place, {how}",
            why_not=why_not,
        )  # fmt: skip
        numbers[f"moving_{span}_answered"] = ranged(
            ratio(answered.sum(1), here.sum(1)), "1", f"share answered {how}", why_not=why_not
        )
    return numbers


def reconstruction_by_phase(run: Run) -> dict[str, dict[str, Any]]:
    """On frames held out between used ones, beside frame 0 held still."""
    frames, tissue, phase = run.frames.rgb, run.masks.tissue, phases_of(run)
    between = np.flatnonzero(run.frames.split == BETWEEN)
    drawn, still = np.full((2, len(frames)), np.nan)
    for t in between:
        drawn[t] = psnr(run.rendered.rgb[t], frames[t], tissue[t])
        still[t] = psnr(run.inpainted.rgb[0], frames[t], tissue[t])
    numbers = {}
    for span, (_, words) in SPANS.items():
        how = f"frames held out between used ones {words}, mean of the frame's PSNR over tissue pixels"
        here, why_not = within(phase, span), f"there is no frame held out between used ones {words}"
        for name, each, what in (
            (f"psnr_between_{span}", drawn, "the scene"),
            (f"psnr_between_{span}_still", still, "the inpainted frame 0 held still"),
            (f"psnr_between_{span}_gain", drawn - still, "what the scene gains on frame 0 held still"),
        ):
            numbers[name] = ranged(
                mean(np.where(here, each, np.nan)), "dB", f"{what}; {how}", drawn="frames", why_not=why_not
            )
    return numbers
