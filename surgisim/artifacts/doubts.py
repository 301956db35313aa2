"""What is not known of a fitted body and its grips, as far as it moves what is seen of the tissue."""

from dataclasses import dataclass

import numpy as np

from surgisim.artifacts.base import Artifact, check


@dataclass(frozen=True)
class Doubts(Artifact):
    """C things that may be otherwise by one standard deviation, K tracked points, T frames."""

    names: np.ndarray
    """(C,) str."""
    moved: np.ndarray
    """By how much a point then goes elsewhere, as its pixel shows it at its depth of frame 0, camera frame [m],
    (C, K, T, 3) float32."""

    UNITS = {"moved": "m"}

    def __post_init__(self) -> None:
        check(
            self.moved.ndim == 4 and self.moved.shape[0] == len(self.names) and self.moved.shape[-1] == 3,
            f"Doubts: moved {self.moved.shape} must be ({len(self.names)}, K, T, 3).",
        )
        check(bool(np.all(np.isfinite(self.moved))), "Doubts: moved must be finite.")
