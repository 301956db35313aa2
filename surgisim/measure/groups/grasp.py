"""Whether the grasp was found where and when it was."""

from typing import Any

from surgisim.measure.grasp_error import grasp_error
from surgisim.measure.groups.depth import scale_to_truth
from surgisim.measure.groups.masking import NO_TRUTH
from surgisim.measure.number import number
from surgisim.measure.run import Run


def grasp(run: Run) -> dict[str, dict[str, Any]]:
    motion = run.motion
    numbers = {
        "grips": number(len(motion.radius), "1", f"driven balls of tissue; source: {motion.source}"),
        "confidence": number(
            motion.confidence.min() if len(motion.radius) else None,
            "1",
            "the stage's own, of the least sure grip",
            why_not="no grasp was found",
        ),
    }
    if run.truth is None:
        return numbers | {"center": number(None, "mm", "", why_not=NO_TRUTH)}
    scale = scale_to_truth(run)
    error = grasp_error(motion, run.truth.motion, scale=scale)
    if error is None:
        return numbers | {"center": number(None, "mm", "", why_not="there is no grasp to compare")}
    how = f"each true grip against the nearest found one, lengths times {scale:.4g} (one factor for the clip)"
    return numbers | {
        "center": number(1e3 * error.center, "mm", f"distance of the gripped centres at rest, the worst grip; {how}"),
        "path": number(1e3 * error.path, "mm", f"root mean square distance of the centres while both hold; {how}"),
        "release": number(error.release, "frames", "release found minus true release; positive is too late"),
    }
