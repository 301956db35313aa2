"""Where and when a recording departs from its simulation, and where the cause may lie."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from surgisim.artifacts.base import Artifact, check
from surgisim.problem import Problem


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
    """What goes on in each frame: a word of PHASES, or its number, (T,)."""

    UNITS = {"points": "m", "residual_before": "m", "residual_after": "m", "z": "1", "particles": "m", "cause": "1"}

    def __post_init__(self) -> None:
        k, t = self.z.shape
        shapes = [self.points.shape, self.residual_before.shape, self.residual_after.shape, self.phase.shape]
        check(shapes == [(k, 3), (k, t, 3), (k, t, 3), (t,)], f"Mismatch: shapes {shapes} do not fit z {self.z.shape}.")
        check(len(self.cause) == len(self.particles), "Mismatch: cause must have one number a particle.")


PHASES = ("rest", "load", "hold", "released")
FIELDS = ("points", "residual_before", "residual_after", "z", "particles", "cause", "cause_time", "phase")
"""That every diagnosis writes, whoever made it."""


def read_mismatch(path: Path) -> Mismatch:
    """The mismatch at `path`. Raises Problem for an array that is missing or of another shape."""
    if not path.is_file():
        raise Problem(f"{path}: no such file, but a diagnosis' mismatch is wanted here. Run the diagnosis first.")
    with np.load(path, allow_pickle=False) as archive:
        missing = [name for name in FIELDS if name not in archive]
        if missing:
            raise Problem(f"{path}: lacks {missing}. Diagnose anew.")
        arrays = {name: archive[name] for name in FIELDS}
        significant = float(archive["significant"]) if "significant" in archive else float("inf")
    k, t, p = len(arrays["points"]), len(arrays["phase"]), len(arrays["particles"])
    shapes = {
        "points": (k, 3),
        "residual_before": (k, t, 3),
        "residual_after": (k, t, 3),
        "z": (k, t),
        "particles": (p, 3),
        "cause": (p,),
        "cause_time": (t,),
        "phase": (t,),
    }
    for name, shape in shapes.items():
        if arrays[name].shape != shape:
            raise Problem(f"{path}: '{name}' is {arrays[name].shape}, but {shape} is wanted. Diagnose anew.")
    return Mismatch(**(arrays | {"phase": _words(arrays["phase"], path), "significant": significant}))


def _words(phase: np.ndarray, path: Path) -> np.ndarray:
    """Words or numbers of PHASES as words."""
    if phase.dtype.kind in "iu":
        phase = np.array(PHASES)[phase]
    phase = np.where(phase == "release", "released", phase)
    strange = sorted(set(phase.tolist()) - set(PHASES))
    if strange:
        raise Problem(f"{path}: 'phase' holds {strange}, and {list(PHASES)} are known. Diagnose anew.")
    return phase
