"""Whether tissue comes to rest between what drives it: its slowest period, beside how fast it is loaded.

    K w = (2 pi / T)^2 M w,   K the tangent stiffness of what is held at rest, M the nodes' masses

A load that rises steadily over a time t leaves a body swinging by T / (pi t) of its response at most. Where that is
small the tangent stiffness answers for tissue; where it is not, and nothing grips the body, the engine must. Of a body
that is gripped the engine runs the base, the release and the best laws in any case, and the tangent only orders them:
there it is kept, since it weighs every law of the catalogue against noise and nuisances.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh

from surgisim.diagnosis.base import TERMS, base_drive, values_on
from surgisim.diagnosis.clip import PHASES, Clip
from surgisim.diagnosis.tangent import operators, stiffness
from surgisim.mpm.grip import runs

LONG = 1.0
"""Slowest period over the shortest time of a load from which on the engine answers [1]; chosen: a third of a response
is then left swinging, and the lines between two tangent states foretell nothing of it."""


@dataclass(frozen=True)
class Responses:
    period: float
    """Slowest of the base held where it is held [s]."""
    loading: float
    """Shortest time in which what drives the body changes in the fitted frames [s]; infinite where nothing does."""
    gripped: bool
    """Whether anything grips it in the fitted frames."""

    @property
    def ratio(self) -> float:
        return self.period / self.loading

    @property
    def by_engine(self) -> bool:
        return self.ratio > LONG and not self.gripped

    def told(self) -> dict:
        """As diagnosis.json has it."""
        finite = float(self.loading) if np.isfinite(self.loading) else None
        used = "engine" if self.by_engine else "tangent"
        return {"used": used, "period": float(self.period), "loading": finite, "ratio": float(self.ratio), "unit": "s"}


def responses(clip: Clip, x: np.ndarray) -> Responses:
    """With a base's numbers, (3,)."""
    return Responses(slowest_period(clip, x), loading(clip), bool(clip.held[: clip.until].any()))


def loading(clip: Clip) -> float:
    """Shortest time in which what drives a body changes [s].

    Weight that lets an unloaded shape go sets in at once: within one frame. Releases are left out: a base is fitted to
    them by the engine in any case.
    """
    if clip.recording.starts == "released" and clip.recording.gravity is not None:
        return 1 / clip.fps
    load = runs(clip.phases()[: clip.until] == PHASES.index("load"))
    return min(((last - first + 1) / clip.fps for first, last in load), default=np.inf)


def slowest_period(clip: Clip, x: np.ndarray) -> float:
    """Of small swings about the rest shape [s]; infinite where nothing holds it."""
    if not clip.body.held.any():
        return np.inf
    prepared, values = clip.prepared(TERMS), values_on(clip, x)
    drive = base_drive(prepared, clip, values)
    value, slope = operators(prepared)
    only_held = np.eye(1, len(drive.path))[0]
    at_rest = np.zeros((len(prepared.simulator.place), 3))
    K = stiffness(prepared, values, drive, at_rest, only_held, slope, value)
    mass = np.repeat(prepared.simulator.node_mass(np.full(prepared.simulator.count, clip.density)), 3)
    root = np.sqrt(np.maximum(mass, 1e-30))
    slowest = eigh(K / np.outer(root, root), eigvals_only=True, subset_by_index=[0, 0])[0]
    return float(2 * np.pi / np.sqrt(max(slowest, 1e-30)))
