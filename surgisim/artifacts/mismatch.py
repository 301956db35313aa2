"""Where and when a simulation and a recording differ, before and after the named law is added."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from surgisim.problem import Problem


@dataclass(frozen=True)
class Mismatch:
    """Residuals are recorded minus simulated; K tracked points, T frames, P particles."""

    points: np.ndarray
    """Where each tracked point sits at rest [m], (K, 3)."""
    residual_before: np.ndarray
    """With the base law [m], (K, T, 3), NaN where unseen."""
    residual_after: np.ndarray
    """With the named law added [m], (K, T, 3)."""
    z: np.ndarray
    """Symptom: the whitened residual before, in standard deviations, (K, T)."""
    particles: np.ndarray
    """Rest positions [m], (P, 3)."""
    cause: np.ndarray
    """How much each particle's tissue would have to act to explain the symptom, 0 or more, (P,)."""
    cause_time: np.ndarray
    """The same of each frame, (T,)."""
    phase: np.ndarray
    """What goes on in each frame, (T,) words of PHASES."""


PHASES = ("rest", "load", "hold", "released")
FIELDS = ("points", "residual_before", "residual_after", "z", "particles", "cause", "cause_time", "phase")


def read_mismatch(path: Path) -> Mismatch:
    """The mismatch at `path`. Raises Problem for an array that is missing or of another shape."""
    if not path.is_file():
        raise Problem(f"{path}: no such file, but a diagnosis' mismatch is wanted here. Run the diagnosis first.")
    with np.load(path, allow_pickle=False) as archive:
        missing = [name for name in FIELDS if name not in archive]
        if missing:
            raise Problem(f"{path}: lacks {missing}. Diagnose anew.")
        arrays = {name: archive[name] for name in FIELDS}
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
    return Mismatch(**(arrays | {"phase": _words(arrays["phase"], path)}))


def _words(phase: np.ndarray, path: Path) -> np.ndarray:
    """Words or numbers of PHASES as words."""
    if phase.dtype.kind in "iu":
        phase = np.array(PHASES)[phase]
    phase = np.where(phase == "release", "released", phase)
    strange = sorted(set(phase.tolist()) - set(PHASES))
    if strange:
        raise Problem(f"{path}: 'phase' holds {strange}, and {list(PHASES)} are known. Diagnose anew.")
    return phase
