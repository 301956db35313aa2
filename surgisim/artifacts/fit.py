"""How the parameters were found and how far to believe them."""

from dataclasses import dataclass
from typing import Any

from surgisim.artifacts.base import JsonArtifact


@dataclass(frozen=True)
class Fit(JsonArtifact):
    history: list[dict[str, Any]]
    """One entry a round: window, parameters, misfits."""
    identifiability: dict[str, Any]
    """Parameter or group -> value, interval, phases that inform it, and whether the clip can tell it."""
    held_out: dict[str, Any]
    """Track error [m] on frames never fitted: fitted and with default parameters."""
    words: str
    """The outcome in plain sentences."""
    numerical_damping: float | None = None
    """Decay of free vibration by the method itself at the fitted step and spacing [1/s]; none where not measured."""
