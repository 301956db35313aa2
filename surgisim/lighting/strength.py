"""How far a predicted change of brightness explains the recorded one."""

from dataclasses import dataclass

import numpy as np

TURNS = 20
HUBER = 1.345
"""Residuals beyond so many robust standard deviations count less (Huber, Robust statistics, 1981, section 1.3)."""


@dataclass(frozen=True)
class Strength:
    value: float
    """Share of the predicted log change that is applied: the slope, shrunk by its error; never below 0 [1]."""
    slope: float
    """Of the recorded log change over the predicted one [1]."""
    error: float
    """Standard error of the slope [1]."""
    gain: np.ndarray
    """Log exposure of every frame against frame 0, (T,); NaN where nothing was seen."""
    unexplained: float
    """Robust standard deviation of what is left [log]."""


def fit_strength(predicted: np.ndarray, recorded: np.ndarray, seen: np.ndarray, cluster: np.ndarray) -> Strength:
    """Robust slope of recorded over predicted log changes, with a free exposure for each frame.

    predicted, recorded: (K, T) of K points; seen: which count, (K, T) bool; cluster: number of the patch that a point
    belongs to, (K,) int. Errors of one patch go together, over all frames, so that a patch is one observation
    (Liang and Zeger, Longitudinal data analysis using generalized linear models, Biometrika 1986). The slope is
    multiplied by max(0, 1 - error^2 / slope^2) (James and Stein's positive part for one number), so that a model that
    explains nothing is left out by itself.
    """
    k, t = np.nonzero(seen & np.isfinite(predicted) & np.isfinite(recorded))
    frames = predicted.shape[1]
    gain, x, y = np.full(frames, np.nan), predicted[k, t], recorded[k, t]
    patches = len(np.unique(cluster[k]))
    if len(k) == 0 or patches < 3 or np.ptp(x) == 0:
        return Strength(0.0, 0.0, np.inf, gain, np.nan)
    weight = np.ones(len(k))
    for _ in range(TURNS):
        total = np.bincount(t, weight, frames)
        here = np.maximum(total, 1e-12)
        xc = x - (np.bincount(t, weight * x, frames) / here)[t]
        yc = y - (np.bincount(t, weight * y, frames) / here)[t]
        inertia = (weight * xc**2).sum()
        slope = (weight * xc * yc).sum() / inertia
        rest = yc - slope * xc
        size = 1.4826 * np.median(np.abs(rest))
        if size == 0:
            break
        weight = np.minimum(1.0, HUBER * size / np.maximum(np.abs(rest), 1e-12))
    pull = np.bincount(cluster[k], weight * xc * rest)
    error = float(np.sqrt((pull**2).sum() * patches / (patches - 1)) / inertia)
    gain = np.where(total > 0, (np.bincount(t, weight * (y - slope * x), frames)) / here, np.nan)
    value = slope * max(0.0, 1 - (error / slope) ** 2) if slope > 0 else 0.0
    return Strength(float(value), float(slope), error, gain, float(size))


def mildest(choices: tuple[float, ...], error: np.ndarray) -> float:
    """The first of `choices`, mildest first, that explains as well as the best, for squared errors (L, T).

    As well: the sums over T frames differ by no more than one standard error of their difference (Breiman and others,
    Classification and regression trees, 1984, section 3.4.3), so that noise alone changes nothing.
    """
    more = error - error[np.argmin(error.sum(1))]
    slack = more.std(1) * np.sqrt(error.shape[1])
    return choices[int(np.argmax(more.sum(1) <= slack))]
