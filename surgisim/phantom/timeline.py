"""When the instrument comes, closes, pulls, holds, opens and leaves."""

from dataclasses import dataclass

import numpy as np

from surgisim.problem import Problem


@dataclass(frozen=True)
class Timeline:
    """All in seconds from frame 0; the tissue is at rest until `pull`."""

    grasp: float
    """The jaws are closed."""
    pull: float
    hold: float
    """The pull has arrived."""
    release: float
    """The jaws let go: the tissue is free after this instant."""
    end: float

    def __post_init__(self) -> None:
        if not 0 < self.grasp <= self.pull < self.hold <= self.release <= self.end:
            raise Problem(
                f"phantom: grasp {self.grasp}, load {self.pull}, hold {self.hold}, release {self.release} and "
                f"duration {self.end} s must come in this order."
            )

    def carried(self, t: np.ndarray) -> np.ndarray:
        """Share of the pull reached at times t, 0-1; jerk is least on the way."""
        return ease((np.asarray(t) - self.pull) / (self.hold - self.pull))

    def gape(self, t: float) -> float:
        """How far open the jaws are, 0-1."""
        return float(1 - ease((t - 0.55 * self.grasp) / (0.45 * self.grasp)) + ease((t - self.release) / 0.10))

    def retreat(self, t: float) -> float:
        """How far the tool has drawn back: 1 at the start, 0 at the grasp, growing to 1 after release."""
        come = 0.35 * (1 - ease(t / (0.6 * self.grasp)))
        return float(come + ease((t - self.release - 0.04) / 0.6))


def ease(s: np.ndarray) -> np.ndarray:
    """0 to 1 with vanishing first and second derivatives at both ends."""
    s = np.clip(s, 0, 1)
    return s**3 * (10 - 15 * s + 6 * s * s)
