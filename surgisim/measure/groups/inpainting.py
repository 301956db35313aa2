"""How much of the tissue behind the instrument was ever seen."""

from typing import Any

from surgisim.artifacts.inpainted import COPIED, INVENTED
from surgisim.measure.number import number
from surgisim.measure.run import Run


def inpainting(run: Run) -> dict[str, dict[str, Any]]:
    origin = run.inpainted.origin
    filled = max((origin != 0).sum(), 1)
    return {
        "copied": number((origin == COPIED).sum() / filled, "1", "filled pixels copied from another frame"),
        "invented": number((origin == INVENTED).sum() / filled, "1", "filled pixels never seen in any frame"),
    }
