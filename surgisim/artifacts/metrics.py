"""Every number of a run, with its unit and protocol."""

from dataclasses import dataclass
from typing import Any

from surgisim.artifacts.base import JsonArtifact


@dataclass(frozen=True)
class Metrics(JsonArtifact):
    clip: str
    variant: str
    values: dict[str, Any]
    """Group -> name -> {"value", "unit", "protocol"}; a number that could not be had is absent, never guessed."""
    stages: dict[str, dict[str, float]]
    """Stage -> {"seconds", "peak_mb"}."""
