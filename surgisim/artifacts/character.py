"""How what has no name behaves, in the words of a diagnosis and of the truth it is scored against."""

from dataclasses import dataclass

CHANGES = ("holds", "grows", "fades")
ENERGIES = ("gives", "takes", "neither")


@dataclass(frozen=True)
class Character:
    at_rest: bool | None
    """Whether it acts on tissue that nothing loads; None where it was only there while something was held."""
    change: str | None
    """One of CHANGES: what becomes of it under a load, or a rest, that stays; None of what is periodic."""
    energy: str
    """One of ENERGIES: whether it does work on the tissue, over all that was seen, or has work done on it."""
    local: bool
    """Whether it acts in one place; else in a layer or everywhere."""
    period: float | None = None
    """Of what comes again and again [s]."""
