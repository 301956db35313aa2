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


@dataclass(frozen=True)
class Truly:
    """Which answers are right of something whose cause is known; empty where nothing is to be asked."""

    at_rest: tuple[bool | None, ...] = ()
    change: tuple[str | None, ...] = ()
    energy: tuple[str, ...] = ()
    local: tuple[bool, ...] = ()
    periodic: tuple[bool, ...] = (False,)

    def right(self, said: dict) -> dict[str, bool]:
        """Of each question that is asked, whether `said`, a Character's fields, answers it rightly."""
        answers = {**said, "periodic": said["period"] is not None}
        return {name: answers[name] in wanted for name, wanted in vars(self).items() if wanted}
