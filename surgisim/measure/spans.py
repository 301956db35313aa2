"""The parts of a recording that its numbers are told for: the phases of a pull, without the rest before it."""

import numpy as np

from surgisim.measure.phases import phases
from surgisim.measure.run import Run

SPANS = {
    "load": (("load",), "while the tissue is loaded"),
    "hold": (("hold",), "while it is held"),
    "released": (("released",), "after it is let go"),
    "held_on": (("hold", "released"), "from the hold on"),
    "pull": (("load", "hold", "released"), "from the first pull on"),
}
"""Name -> the phases in it, and how it is called."""
THREE = ("load", "hold", "released")


def within(phase: np.ndarray, span: str) -> np.ndarray:
    """Frames of the span, (T,) bool; phase (T,) str."""
    return np.isin(phase, SPANS[span][0])


def phases_of(run: Run) -> np.ndarray:
    """The clip's phases, (T,) str: by the true grip where it is known, else by the run's."""
    return phases(run.truth.motion if run.truth else run.motion)
