"""Where and when a recording departs from its simulation, and where the cause may lie."""

from dataclasses import dataclass

import numpy as np

from surgisim.artifacts.base import Artifact, check


@dataclass(frozen=True)
class Mismatch(Artifact):
    points: np.ndarray
    """Observed points at rest [m], (K, 3)."""
    residual_before: np.ndarray
    """Recording less base simulation, less each point's own constant [m], (K, T, 3), NaN where not seen."""
    residual_after: np.ndarray
    """The same with the named law; as before where none is named."""
    z: np.ndarray
    """Length of the smoothed residual in standard deviations of noise, (K, T)."""
    significant: float
    """What noise alone reaches somewhere in one clip of twenty [1]."""
    particles: np.ndarray
    """Of the body at rest [m], (P, 3)."""
    cause: np.ndarray
    """How likely the cause is there, 1 at the likeliest, (P,)."""
    cause_time: np.ndarray
    """Score of a cause in every frame over what noise gives, 0 where not fitted, (T,)."""
    phase: np.ndarray
    """0 rest, 1 load, 2 hold, 3 release, (T,)."""

    UNITS = {"points": "m", "residual_before": "m", "residual_after": "m", "z": "1", "particles": "m", "cause": "1"}

    def __post_init__(self) -> None:
        k, t = self.z.shape
        shapes = [self.points.shape, self.residual_before.shape, self.residual_after.shape, self.phase.shape]
        check(shapes == [(k, 3), (k, t, 3), (k, t, 3), (t,)], f"Mismatch: shapes {shapes} do not fit z {self.z.shape}.")
        check(len(self.cause) == len(self.particles), "Mismatch: cause must have one number a particle.")
