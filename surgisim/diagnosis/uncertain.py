"""Intervals of a law's parameters where only its strength was fitted: 90 %, from the spread of its amplitudes."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from surgisim.estimation.identify import NINETY


@dataclass(frozen=True)
class Spread:
    amplitude: np.ndarray
    """(H,)"""
    each: np.ndarray
    """Standard deviation of every amplitude, (H,)."""
    by_stiffness: float
    """Share by which strength is off because the tissue's stiffness may be [1]."""

    @property
    def share(self) -> float:
        """Of the amplitudes' length [1]."""
        size = max(float(np.linalg.norm(self.amplitude)), 1e-30)
        return min(NINETY * float(np.linalg.norm(self.each * self.amplitude)) / size**2, 0.95)


Interval = Callable[[str, float, Spread], tuple[float, float]]
"""Parameter, its value and the amplitudes' spread -> its ends."""


def scaled(which: str, *, over_stiffness: bool = False) -> Interval:
    """Of a law whose strength scales one number.

    over_stiffness: whether it shows only over the tissue's own stiffness, and is as uncertain as that.
    """

    def interval(key: str, value: float, spread: Spread) -> tuple[float, float]:
        if key != which:
            return value, value
        wide = np.hypot(np.log1p(spread.share), spread.by_stiffness if over_stiffness else 0.0)
        return value * float(np.exp(-wide)), value * float(np.exp(wide))

    return interval
