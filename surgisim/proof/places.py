"""How far off a named law's place and onset are."""

import numpy as np

from surgisim.artifacts.verdict import Effect

CELLS = 1.5
"""A place is right within this many grid cells."""


def place(concealed: dict, effect: Effect, cell: float | None) -> dict | None:
    """Distance of the centres [mm, and grid cells], ratio of the extents; None where the concealed one has no place.

    A law said to act everywhere has no distance, and is not right.
    """
    if not isinstance(concealed["place"], dict):
        return None
    if effect.center is None:
        return {"term": concealed["term"], "error_mm": None, "cells": None, "extent_ratio": None, "right": False}
    away = float(np.linalg.norm(np.subtract(effect.center, concealed["place"]["center"])))
    true = concealed["place"].get("extent")
    return {
        "term": concealed["term"],
        "error_mm": 1e3 * away,
        "cells": away / cell if cell else None,
        "extent_ratio": effect.extent / true if effect.extent and true else None,
        "right": away <= CELLS * cell if cell else None,
    }


def onset(concealed: dict, effect: Effect, fps: float) -> dict | None:
    """Onset said minus true [frames]; None where the concealed one acts from the beginning.

    A law said to act from the beginning has its onset at frame 0.
    """
    true = concealed["time"]["onset"]
    if true is None:
        return None
    given = effect.onset
    if given is None:
        given = effect.parameters.get("onset", {}).get("value")
    late = ((given or 0.0) - true) * fps
    return {"term": concealed["term"], "frames": late, "given": given is not None}
