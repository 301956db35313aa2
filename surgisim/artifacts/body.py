"""The thick body a simulation needs: particles of tissue."""

from dataclasses import dataclass, field

import numpy as np

from surgisim.artifacts.base import Artifact, check


@dataclass(frozen=True)
class Body(Artifact):
    rest: np.ndarray
    """Particle positions in frame 0, camera frame [m], (P, 3) float32."""
    volume: np.ndarray
    """Volume each particle stands for [m^3], (P,) float32."""
    color: np.ndarray
    """Colour, sRGB 0-1, (P, 3) float32."""
    surface: np.ndarray
    """Whether the particle lies on the seen surface, (P,) bool."""
    held: np.ndarray
    """Whether it belongs to a boundary that does not move, (P,) bool."""
    spacing: float
    """Grid spacing the particle density was made for [m]."""
    torn: np.ndarray = field(default_factory=lambda: np.zeros((0, 2, 2)))
    """Walls along the view through which tissue does not hang together: both ends of each across it, camera frame x
    and y [m], (K, 2, 2)."""

    UNITS = {"rest": "m", "volume": "m^3", "color": "sRGB 0-1", "spacing": "m", "torn": "m"}

    def __post_init__(self) -> None:
        p = len(self.rest)
        shapes = [a.shape for a in (self.rest, self.volume, self.color, self.surface, self.held)]
        check(
            shapes == [(p, 3), (p,), (p, 3), (p,), (p,)],
            f"Body: shapes {shapes} do not fit; (P, 3), (P,), (P, 3), (P,), (P,) are wanted.",
        )
        check(self.torn.shape[1:] == (2, 2), f"Body: torn has shape {self.torn.shape}; (K, 2, 2) is wanted.")
        check(p > 0 and bool(np.all(self.volume > 0)), "Body: there must be particles, each with a volume > 0.")
