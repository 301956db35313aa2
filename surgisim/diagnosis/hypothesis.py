"""A law at one place, time and form."""

from dataclasses import dataclass, field

import numpy as np

from surgisim.physics.place import Place

RISE = 0.12
"""How long a load takes to come or leave [s]."""
SETS_IN = 0.3
"""How long a rhythm takes to set in [s]."""


@dataclass(frozen=True)
class Hypothesis:
    term: str
    mix: np.ndarray
    """From amplitudes to the block's columns, (C, H)."""
    sign: int = 0
    """1 where an amplitude below zero is no tissue's; 0 where both are possible."""
    place: Place | None = None
    onset: float | None = None
    end: float | None = None
    about: dict = field(default_factory=dict)
    """The other numbers of the form."""
    scope: str = "everywhere"
    """What kind of place it was tried at: "everywhere", in a "blob", a "layer", a "patch" of the base, at a "grip"."""

    @property
    def in_blob(self) -> bool:
        return self.scope == "blob"

    def apart(self, other: "Hypothesis") -> float:
        """Distance between two blobs' centres [m]."""
        return float(np.linalg.norm(np.subtract(self.place.center, other.place.center)))


def ease(s: np.ndarray) -> np.ndarray:
    s = np.clip(s, 0, 1)
    return s**3 * (10 - 15 * s + 6 * s * s)
