"""How strong an effect must be to stand out of the tracking noise by a given factor."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

CLOSE = 0.04
"""The search ends this near (logarithm)."""
TRIES = 7
"""Runs that the search may take."""


def signal(difference: np.ndarray, visible: np.ndarray) -> float:
    """RMS length of displacement differences [m], (K, T, 3), over visible points and frames, (K, T)."""
    return float(np.sqrt((difference[visible] ** 2).sum(-1).mean()))


@dataclass(frozen=True)
class Found:
    magnitude: float
    ratio: float
    """Signal-to-noise ratio at this magnitude."""


def scaled(
    measure: Callable[[float], float],
    wanted: float,
    *,
    start: float,
    most: float,
    close: float = CLOSE,
    tries: int = TRIES,
) -> Found:
    """The magnitude in (0, most] at which `measure` is `wanted`, or the one nearest to it, by secants of logarithms.

    `measure` grows with the magnitude, from 0 at 0; it may be 0 below a threshold, and
    infinite where the tissue does not bear the effect.
    """
    low, high = None, None
    magnitude, best = min(start, most), Found(0.0, 0.0)
    for _ in range(tries):
        ratio = measure(magnitude)
        if not math.isinf(ratio) and abs(math.log(max(ratio, 1e-9) / wanted)) < abs(
            math.log(max(best.ratio, 1e-9) / wanted)
        ):
            best = Found(magnitude, ratio)
        if abs(math.log(max(best.ratio, 1e-9) / wanted)) < close or (magnitude == most and ratio < wanted):
            break
        if math.isinf(ratio):
            high = (math.log(magnitude), math.log(8 * wanted))
        elif ratio < wanted:
            low = (math.log(magnitude), math.log(max(ratio, 1e-9)))
        else:
            high = (math.log(magnitude), math.log(ratio))
        magnitude = min(math.exp(_next(low, high, math.log(wanted))), most)
    return best


def _next(low, high, goal: float) -> float:
    """Logarithm of the next magnitude, given the nearest below and above the goal."""
    if low and high:
        share = (goal - low[1]) / (high[1] - low[1])
        # Curved responses pull the secant to one end; it stays away from both.
        return low[0] + min(max(share, 0.15), 0.85) * (high[0] - low[0])
    at, level = low or high
    return at + min(max(goal - level, -2.0), 1.2)
