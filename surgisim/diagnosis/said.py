"""Place and time of a law, as diagnosis.json has them."""

import numpy as np

from surgisim.diagnosis import candidates
from surgisim.diagnosis.hypothesis import Hypothesis


def place_of(h: Hypothesis) -> dict | str:
    """Centre and radius of what is local; "everywhere" for the rest."""
    if h.place is None or h.place.normal is not None:
        return "everywhere"
    # Of a blob the radius at which it is down to a half; a grip's own radius.
    reach = 1.0 if candidates.of(h).exact_extent else np.sqrt(2 * np.log(2))
    return {"center": [float(c) for c in h.place.center], "extent": float(reach * h.place.extent), "unit": "m"}


def time_of(h: Hypothesis) -> dict[str, float | None]:
    """Onset and end [s]."""
    return {"onset": None if h.onset is None else float(h.onset), "end": None if h.end is None else float(h.end)}
