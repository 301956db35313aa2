"""Shares of few cases, with how little they tell."""

import math
from collections.abc import Iterable
from dataclasses import asdict, dataclass

import numpy as np

Z = 1.959964
"""Of a two-sided 95 % interval."""
FEW = 5
"""Values below which a bootstrapped interval would say nothing."""


@dataclass(frozen=True)
class Share:
    hits: int
    count: int
    low: float
    """Wilson's 95 % interval [1]; 0 to 1 where nothing was counted."""
    high: float

    @property
    def value(self) -> float | None:
        return self.hits / self.count if self.count else None

    def told(self) -> dict:
        return asdict(self) | {"value": self.value}


def share(answers: Iterable[bool | None]) -> Share:
    """How many of the answers are yes; None is no answer.

    Wilson, Probable inference, the law of succession, and statistical inference, JASA 22 (1927).
    """
    given = [bool(a) for a in answers if a is not None]
    return Share(sum(given), len(given), *wilson(sum(given), len(given)))


def wilson(hits: int, count: int) -> tuple[float, float]:
    if not count:
        return 0.0, 1.0
    p, n = hits / count, count
    middle = (p + Z * Z / (2 * n)) / (1 + Z * Z / n)
    half = Z / (1 + Z * Z / n) * math.sqrt(p * (1 - p) / n + Z * Z / (4 * n * n))
    # Rounding must not push the ends past what is certain.
    return 0.0 if hits == 0 else middle - half, 1.0 if hits == count else middle + half


def median(values: Iterable[float | None], seed: int = 0) -> dict:
    """Median of those that are known, with a bootstrap 95 % interval; None where there are none, or too few for one."""
    known = np.array([v for v in values if v is not None], float)
    if not len(known):
        return {"value": None, "low": None, "high": None, "count": 0}
    if len(known) < FEW:
        return {"value": float(np.median(known)), "low": None, "high": None, "count": len(known)}
    drawn = np.random.default_rng(seed).choice(known, (2000, len(known)))
    low, high = np.percentile(np.median(drawn, axis=1), [2.5, 97.5])
    return {"value": float(np.median(known)), "low": float(low), "high": float(high), "count": len(known)}
