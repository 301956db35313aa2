"""Whether the instrument was found."""

from typing import Any

import numpy as np

from surgisim.measure.number import number
from surgisim.measure.overlap import overlap
from surgisim.measure.run import Run

NO_TRUTH = "no truth is known for this clip"


def masking(run: Run) -> dict[str, dict[str, Any]]:
    tool, tissue = run.masks.tool, run.masks.tissue
    numbers = {
        "confidence": number(run.masks.confidence.mean(), "1", "the stage's own, mean over frames"),
        "tool_share": number(tool.mean(), "1", "pixels marked as tool, all frames"),
    }
    if run.truth is None:
        return numbers | {"tool_iou": number(None, "1", "", why_not=NO_TRUTH)}
    true = run.truth.tool
    each = np.array([overlap(a, b) for a, b in zip(tool, true, strict=True)])
    return numbers | {
        "tool_iou": number(
            overlap(tool, true),
            "1",
            "intersection over union of the tool's pixels with the true ones, pooled over all frames",
            series=each,
        ),
        "tool_iou_worst": number(
            np.nanmin(each) if np.isfinite(each).any() else None,
            "1",
            "the frame with the lowest such value",
        ),
        "tool_taken_for_tissue": number(
            (true & tissue).sum() / max(true.sum(), 1), "1", "true tool pixels marked as tissue, all frames"
        ),
    }
