"""How far the depth is from the true or given one."""

from typing import Any

import numpy as np

from surgisim.measure.depth_error import depth_error, scale_between
from surgisim.measure.groups.masking import NO_TRUTH
from surgisim.measure.number import number
from surgisim.measure.run import Run


def depth(run: Run) -> dict[str, dict[str, Any]]:
    numbers = {"confidence": number(run.depth.confidence.mean(), "1", "the stage's own, mean over pixels")}
    if len(run.given.depth):
        numbers |= _against(
            run, run.given.depth, run.masks.tissue, "given", "the depth that came with the recording, tissue pixels"
        )
    if run.truth is None:
        return numbers | {"true_relative": number(None, "%", "", why_not=NO_TRUTH)}
    hidden = run.truth.tool
    numbers |= _against(run, run.truth.depth, ~hidden, "true", "the true depth of seen tissue")
    numbers |= _against(run, run.truth.depth, hidden, "true_hidden", "the true depth of tissue behind the tool")
    return numbers


def scale_to_truth(run: Run) -> float:
    """Factor from the run's lengths to true ones: 1 where the scale is known, else one median ratio of depths."""
    if run.truth is None or run.depth.scale == "known":
        return 1.0
    return scale_between(run.depth.z, run.truth.depth, ~run.truth.tool)


def _against(run: Run, true: np.ndarray, counted: np.ndarray, name: str, what: str) -> dict[str, dict[str, Any]]:
    fitted = run.depth.scale == "arbitrary"
    scale = scale_between(run.depth.z, true, counted) if fitted else 1.0
    how = f"against {what}, all frames, " + (
        f"after one factor for the clip ({scale:.4g}, the median ratio)" if fitted else "no factor fitted"
    )
    found = depth_error(run.depth.z, true, counted, scale=scale)
    if found is None:
        return {f"{name}_relative": number(None, "%", "", why_not=f"{what}: no such pixel")}
    return {
        f"{name}_relative": number(100 * found.relative, "%", f"mean of |z - z_true| / z_true {how}"),
        f"{name}_median": number(1e3 * found.median, "mm", f"median of |z - z_true| {how}"),
        f"{name}_rms": number(1e3 * found.rms, "mm", f"root mean square {how}"),
    }
