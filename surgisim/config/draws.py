"""Settings of recordings drawn from a diagnosis' own model."""

from pydantic import Field

from surgisim.config.base import Settings
from surgisim.config.diagnosis import Diagnosing

OF_NULLS = {"refine": 1, "free": 0, "second": False, "experiment": False, "replay": 0.165}
"""What a diagnosis needs for its evidence and its nulls, and nothing more."""


class Draws(Settings):
    count: int = Field(100, ge=1)
    """Recordings [1]."""
    seed: int = Field(0, ge=0)
    """Of what is drawn [1]."""
    diagnosis: Diagnosing = Diagnosing()
    """Settings of the diagnosis whose model is drawn from."""


class Draw(Settings):
    number: int = Field(0, ge=0)
    """Which of the drawn recordings [1]."""
