"""A law with its numbers and its place, as the engine runs it."""

from dataclasses import dataclass

from surgisim.artifacts.motion import Motion
from surgisim.diagnosis.hypothesis import Hypothesis
from surgisim.mpm.setup import Values
from surgisim.physics.place import Place

NEVER = 59.0
"""An end after every clip [s]."""


@dataclass(frozen=True)
class Law:
    """What is added to the base."""

    values: Values
    places: dict[str, Place]
    motion: Motion | None = None
    """Where a grip does not carry its tissue along as recorded."""


def placed(h: Hypothesis, term: str) -> dict[str, Place]:
    """Where a term acts that acts where its hypothesis says; nowhere in particular for the whole body."""
    return {} if h.place is None else {term: h.place}
