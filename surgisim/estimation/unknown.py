"""A number that is searched beside the laws' own."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Unknown:
    """One number beside the laws, searched as it is."""

    name: str
    start: float
    spread: float
    """Standard deviation of its prior about `start`."""
    low: float
    high: float
    unit: str
    logarithmic: bool = False
    """Whether it is the logarithm of a factor."""
    size: float = 1.0
    """What 1 is, in `unit`."""
