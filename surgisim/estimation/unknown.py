"""A number that is searched beside the laws' own."""

from dataclasses import dataclass

DIFFERENCE = 0.02
"""Step of the forward differences in search space: well above float32 noise, well below curvature."""
RELAID = 0.12
"""The same of a number that lays particles anew: each comes to lie elsewhere in its cell, which moves tissue by some
.01 mm, whatever the step. Over a small one that looks like a derivative, and makes the number look far surer than it is
(a depth to .6 % that was 13 % off)."""


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
    before: float | None = None
    """What `spread` would be had nothing of the clip been looked at, where that is more."""
    difference: float = DIFFERENCE
    """Step of the differences that its derivative is taken by."""
