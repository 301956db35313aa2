"""How far a number would move had other points or frames been looked at: the bootstrap, whole clusters at a time.

Frames of one point are no independent samples of an error, so a point is drawn anew with all of its frames; where
there are no points, a frame with all of its pixels. Neighbouring points err alike, so what holds for all points of a
clip at once (its depth, its grip) is not in the interval.

Efron and Tibshirani, An introduction to the bootstrap, 1993; Field and Welsh, Bootstrapping clustered data, 2007.
"""

from dataclasses import dataclass

import numpy as np

DRAWS = 400
LEVEL = 0.9
FEW = 5
"""Clusters below which an interval would say nothing."""


@dataclass(frozen=True)
class Estimate:
    value: float
    low: float | None
    """Ends of the 90 % interval; None with too few clusters for one."""
    high: float | None
    count: int
    """Clusters: points, or frames."""


NOTHING = Estimate(float("nan"), None, None, 0)


def ratio(top: np.ndarray, bottom: np.ndarray, *, root: bool = False, seed: int = 0) -> Estimate:
    """Sum of `top` over sum of `bottom`, a value of each a cluster, (K,); with `root` its square root.

    Mean error: a point's summed errors over its frames. A share: one's summed errors over another's. Clusters with
    nothing in `bottom` do not count.
    """
    top, bottom = np.asarray(top, float), np.asarray(bottom, float)
    there = np.isfinite(top) & np.isfinite(bottom) & (bottom > 0)
    top, bottom = top[there], bottom[there]
    if not len(top):
        return NOTHING
    finish = np.sqrt if root else np.asarray
    value = float(finish(top.sum() / bottom.sum()))
    if len(top) < FEW:
        return Estimate(value, None, None, len(top))
    weight = _drawn(len(top), seed)
    return Estimate(value, *_ends(finish(weight @ top / (weight @ bottom))), len(top))


def mean(values: np.ndarray, seed: int = 0) -> Estimate:
    """Mean of one value a cluster, (K,), without those that are NaN."""
    return ratio(values, np.where(np.isfinite(values), 1.0, 0.0), seed=seed)


def median(values: np.ndarray, counted: np.ndarray, *, seed: int = 0) -> Estimate:
    """Median of the values counted, (K, T), a row a cluster."""
    counted = counted & np.isfinite(values)
    rows = counted.any(1)
    if not rows.any():
        return NOTHING
    values, counted = values[rows], counted[rows]
    owner, single = np.nonzero(counted)[0], values[counted]
    value = float(np.median(single))
    if len(values) < FEW:
        return Estimate(value, None, None, len(values))
    order = np.argsort(single)
    weight = np.cumsum(_drawn(len(values), seed)[:, owner[order]], axis=1)
    middle = [np.searchsorted(w, w[-1] / 2) for w in weight]
    return Estimate(value, *_ends(single[order][middle]), len(values))


def _drawn(count: int, seed: int) -> np.ndarray:
    """How often each cluster is drawn, (DRAWS, count)."""
    return np.random.default_rng(seed).multinomial(count, np.full(count, 1 / count), DRAWS)


def _ends(values: np.ndarray) -> tuple[float, float]:
    low, high = np.percentile(values, [50 * (1 - LEVEL), 50 * (1 + LEVEL)])
    return float(low), float(high)
